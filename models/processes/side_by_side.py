"""Tasks in several processes of the package, which Ctrl-C does not reach and which never outlive this one.

The pools of the standard library read the user's program again in every process, and they and joblib leave
processes behind. The processes here get tasks through a pipe and end when it closes, whatever the reason.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from typing import IO, Any, Final, ParamSpec, Self, TypeVar

from ..errors import CrossfieldError, InputError
from .groups import KILLED, ending, kill, start

Task = TypeVar("Task")
Found = TypeVar("Found")
P = ParamSpec("P")

MOST: Final = max(16, 2 * (os.cpu_count() or 1))
"""Most threads or processes: beyond twice the cores nothing is quicker, and each takes memory."""

_ONE_THREAD: Final = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_PROGRAM: Final = (
    "import sys; sys.path += [each for each in sys.argv[1:] if each not in sys.path]; "
    f"from {__package__}.worker import main; main()"
)
"""Finds modules wherever this process does, but puts no folder of the user before those of libraries."""


class WorkerError(CrossfieldError):
    """A worker process ended early, or a task, result or error cannot be sent to or from it."""


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

    work: a function of a module, not of the user's program. Raises what the work and `workers` raise.
    """
    with workers(jobs) as chosen:
        yield lambda tasks: list(chosen.map(work, tasks))


@contextmanager
def workers(jobs: int) -> Iterator[Executor]:
    """Executor whose tasks run in that many processes, or in this one for a single job.

    Functions must belong to a module, not to the user's program. A process starts when there is a task for
    it. All have ended afterwards. Raises InputError for a number of jobs that is out of range. Futures raise
    what their task raises, and WorkerError when a process dies or something cannot be sent.
    """
    if checked(jobs) == 1:
        yield _Here()
        return
    with _Processes(jobs) as processes:
        yield processes


class _Here(Executor):
    """Executor that runs a task in this process when it is submitted."""

    def submit(self, fn: Callable[P, Found], /, *args: P.args, **kwargs: P.kwargs) -> Future[Found]:
        future: Future[Found] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


class _Processes(Executor):
    """Processes, started one by one as tasks come, each asked by a thread."""

    def __init__(self, jobs: int) -> None:
        self._threads = ThreadPoolExecutor(jobs)
        self._all: list[subprocess.Popen[bytes]] = []
        self._idle: list[subprocess.Popen[bytes]] = []
        self._lock = threading.Lock()
        self._ended = False

    def __enter__(self) -> Self:
        return self

    def submit(self, fn: Callable[P, Found], /, *args: P.args, **kwargs: P.kwargs) -> Future[Found]:
        return self._threads.submit(self._ask, partial(fn, *args, **kwargs))

    def __exit__(self, *_: object) -> None:
        """End all processes, whatever they are doing; threads that wait for one then end as well."""
        with self._lock:
            self._ended = True
            for child in self._all:
                kill(child)
        self._threads.shutdown()
        for child in self._all:
            with suppress(OSError), child:  # a task that was on its way cannot be sent any more
                pass

    def _ask(self, work: Callable[[], Found]) -> Found:
        """What a process answers to a task."""
        try:
            task = pickle.dumps(work)
        except Exception as error:
            raise WorkerError(f"a task cannot be sent to a process: {reason(error)}") from error
        child = self._take()
        assert child.stdin is not None
        assert child.stdout is not None
        try:
            send(task, child.stdin)
            answer = pickle.load(child.stdout)  # noqa: S301 - from a process of our own
        except (OSError, EOFError, pickle.UnpicklingError) as error:
            raise self._death(child) from error
        with self._lock:
            self._idle.append(child)
        found: Found = _result(answer)
        return found

    def _take(self) -> subprocess.Popen[bytes]:
        with self._lock:
            if self._ended:
                raise WorkerError("the work was ended before its time")
            if self._idle:
                return self._idle.pop()
            self._all.append(_started())
            return self._all[-1]

    def _death(self, child: subprocess.Popen[bytes]) -> WorkerError:
        """The error for a process that answers no more."""
        code = child.wait()
        if self._ended:
            return WorkerError("the work was ended before its time")
        remedy = ", probably for lack of memory; try fewer jobs or threads" if code == KILLED else ""
        return WorkerError(f"a process ended before its work was done: it {ending(code)}{remedy}")


def _started() -> subprocess.Popen[bytes]:
    # -P: a file numpy.py where the user happens to be is not meant.
    return start(
        [sys.executable, "-P", "-c", _PROGRAM, *sys.path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | _ONE_THREAD,
    )


def _result(answer: bytes) -> Any:
    """The result in an answer of a process. Raises the error in it."""
    try:
        done, found = pickle.loads(answer)  # noqa: S301 - from a process of our own
    except Exception as error:
        raise WorkerError(f"the result of a task cannot be read: {reason(error)}") from error
    if not done:
        raise found
    return found


def reason(error: Exception) -> str:
    """Name and message of an error of any kind."""
    return f"{type(error).__name__}: {error}"


def send(value: Any, stream: IO[bytes]) -> None:
    """Write a value to a pipe at once."""
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
