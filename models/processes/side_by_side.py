"""The same work on several tasks in processes that Ctrl-C does not reach and never outlive this one.

The pools of the standard library read the user's program again in every process, and they and joblib leave
processes behind. These here are programs of the package: they get tasks through a pipe, and end when it
closes, however that comes about.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from typing import IO, Any, Final, Self, TypeVar

from ..errors import CrossfieldError, InputError

Task = TypeVar("Task")
Found = TypeVar("Found")

MOST: Final = max(16, 2 * (os.cpu_count() or 1))
"""Most threads or processes: beyond twice the cores nothing is quicker, and each takes memory."""

_ONE_THREAD: Final = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


class WorkerError(CrossfieldError):
    """A process that ended before its work was done."""


def checked(count: int, what: str = "jobs", *, least: int = 1) -> int:
    """The number of threads or processes, if that many may be asked for. Raises InputError."""
    if not least <= count <= MOST:
        raise InputError(f"{count} {what} cannot be; give {least} to {MOST}")
    return count


def cores() -> int:
    """The number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def side_by_side(work: Callable[[Task], Found], jobs: int) -> Iterator[Callable[[list[Task]], list[Found]]]:
    """A function that does the work on tasks in that many processes; results in the tasks' order.

    work: a function of a module, not of the user's program. A process starts when there is a task for it; all
    have ended afterwards. Raises what the work raises, InputError for a number of jobs that cannot be, and
    WorkerError when a process dies.
    """
    if checked(jobs) == 1:
        yield lambda tasks: [work(task) for task in tasks]
        return
    with _Workers() as workers, ThreadPoolExecutor(jobs) as threads:
        try:
            yield lambda tasks: list(threads.map(lambda task: workers.ask(work, task), tasks))
        finally:
            workers.end()  # whatever they are doing; threads that wait for one then end as well


class Raised:
    """What the work raised instead of giving an answer."""

    def __init__(self, error: Exception) -> None:
        """Keep the error, and where it was raised as a note."""
        error.add_note(traceback.format_exc())
        self.error = error


class _Workers:
    """Processes, started one by one as tasks come, and those among them that have nothing to do."""

    def __init__(self) -> None:
        self._all: list[subprocess.Popen[bytes]] = []
        self._idle: list[subprocess.Popen[bytes]] = []
        self._lock = threading.Lock()
        self._ended = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Leave nothing of them."""
        for child in self._all:
            with suppress(OSError), child:  # a task that was on its way cannot be sent any more
                pass

    def end(self) -> None:
        """End them all; no other starts."""
        with self._lock:
            self._ended = True
            for child in self._all:
                child.kill()

    def ask(self, work: Callable[[Task], Found], task: Task) -> Found:
        """What a process makes of a task."""
        child, new = self._take()
        assert child.stdin is not None
        assert child.stdout is not None
        try:
            if new:  # a deadline in the task counts from its arrival, so that imports must be done by then
                send((_imported, work), child.stdin)
                pickle.load(child.stdout)  # noqa: S301 - from a process of our own
            send((work, task), child.stdin)
            answer = pickle.load(child.stdout)  # noqa: S301 - from a process of our own
        except (OSError, EOFError, pickle.UnpicklingError) as error:
            raise WorkerError(
                "a process ended before its work was done, for want of memory most likely; "
                "try fewer jobs or threads"
            ) from error
        with self._lock:
            self._idle.append(child)
        if isinstance(answer, Raised):
            raise answer.error
        found: Found = answer
        return found

    def _take(self) -> tuple[subprocess.Popen[bytes], bool]:
        """Take an idle process, or a new one: then the second value is true."""
        with self._lock:
            if self._ended:
                raise WorkerError("the work was ended before its time")
            if self._idle:
                return self._idle.pop(), False
            self._all.append(_started())
            return self._all[-1], True


def _imported(_work: Callable[[Task], Found]) -> None:
    """Return when the process has imported the module of the work."""


def _started() -> subprocess.Popen[bytes]:
    # -P: a file numpy.py where the user happens to be is not meant. A session of its own: Ctrl-C on a
    # terminal is for this process.
    return subprocess.Popen(
        [sys.executable, "-P", "-m", f"{__package__}.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
        env=os.environ | _ONE_THREAD,
    )


def send(value: Any, stream: IO[bytes]) -> None:
    """Write a value to a pipe, at once."""
    stream.write(pickle.dumps(value))
    stream.flush()


def leave_with_parent(take: Callable[[Any], object] | None = None) -> None:
    """See to it that this process ends as soon as its standard input closes, a pipe from its parent.

    take: gets each value that comes through the pipe, in a thread.
    """

    def run() -> None:
        try:
            # Not sys.stdin: Python ends with an abort when a thread waits there.
            with os.fdopen(os.dup(0), "rb") as stream:
                while take is not None:
                    take(pickle.load(stream))  # noqa: S301 - from the process that started this one
                stream.read()
        finally:
            os._exit(1)

    threading.Thread(target=run, daemon=True).start()
