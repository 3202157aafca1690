"""Child processes that run functions of the package: start, time limit, interruption, result, failure.

A child is a program of the package, not a second copy of the user's program: the pools of the standard
library import the user's script again in every process. It receives calls through a pipe and ends when the
pipe closes, so it never outlives its parent. Requests to stop travel through the same pipe, not as signals.
"""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

from .child_program import StopMessage, TaskMessage, WorkerError, error_text, send
from .deadline import Deadline, IsOver, never
from .process_groups import KILLED, describe_exit, kill_group, start_group

GRACE: Final = 0.5
GRACE_SHARE: Final = 0.05
"""Seconds after its deadline, plus a share of its time, for work to return its result."""
PATIENCE: Final = 4.0
"""Seconds for work to answer Ctrl-C: the request is repeated half way, then the work is killed."""
_TICK: Final = 0.1
_CLOSED: Final = "the program ended before this work was done"
_PROGRAM: Final = (
    "import sys; sys.path += [each for each in sys.argv[1:] if each not in sys.path]; "
    f"from {__package__}.child_program import main; main()"
)
"""Finds modules where this process does, but puts no folder of the user before those of libraries."""
_ONE_THREAD: Final = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


class KilledError(WorkerError):
    """Work that was killed because it did not end in time; `interrupted` is True for Ctrl-C."""

    def __init__(self, message: str, *, interrupted: bool = False) -> None:
        """Store whether the user requested the end."""
        super().__init__(message)
        self.interrupted = interrupted


class Returned(NamedTuple):
    """The result of a call, and whether the user or the caller interrupted it."""

    value: Any
    interrupted: bool


class Child(AbstractContextManager["Child"]):
    """A process that runs functions of modules, one call at a time.

    folder: its current folder, this process' folder by default. one_thread: whether numerical libraries there
    use one thread. remedy: advice after a kill for lack of memory. The process starts with the first call,
    and restarts if it did not survive a call.
    """

    def __init__(
        self,
        folder: Path | None = None,
        *,
        one_thread: bool = False,
        remedy: str = "try fewer jobs or threads",
    ) -> None:
        """Store the settings; no process starts yet."""
        self._folder, self._one_thread, self._remedy = folder, one_thread, remedy
        self._process: subprocess.Popen[bytes] | None = None
        self._answers: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._closed = False
        self._loaded: set[str] = set()

    def __exit__(self, *_: object) -> None:
        """End the process."""
        self.close()

    def call(
        self,
        work: Callable[..., Any],
        *arguments: Any,
        deadline: Deadline | None = None,
        log: Path | None = None,
        stop: IsOver = never,
    ) -> Returned:
        """Call `work(*arguments)` in the child and return its result.

        work: a function of an importable module. deadline: when the work is asked to stop. log: file for the
        output of the work. stop: returns whether to interrupt the work. The first Ctrl-C interrupts it as
        well, the second kills it and is raised.

        Raises the exceptions of the work, KilledError for work that does not stop in time, and WorkerError,
        with the reason, when the process dies or a value cannot be sent.
        """
        watch = _Watch(deadline or Deadline(), self._ask_to_stop, stop)
        if watch.deadline.passed():
            raise KilledError("no time was left to start the work")
        try:
            process = self._ensure_process(watch)
            self._load(work, process, watch)
            self._send(TaskMessage(_pickle_task(work, arguments), log), process)
            answer = self._next_message(watch)
        except _UnsentError:
            raise
        except BaseException:
            self.end()
            raise
        return Returned(_unpickle_result(answer), watch.interrupted)

    def close(self) -> None:
        """Kill the process, and prevent another start."""
        self._closed = True
        self.end()

    def end(self) -> None:
        """Kill the process and its children."""
        with self._lock:
            process, self._process = self._process, None
        if process is None:
            return
        kill_group(process)
        process.wait()
        if process.stdin is not None:
            with suppress(OSError):  # unwritten output is lost
                process.stdin.close()

    def _ensure_process(self, watch: _Watch) -> subprocess.Popen[bytes]:
        """Return the process, started if needed and ready for a call."""
        with self._lock:
            if self._closed:
                raise WorkerError(_CLOSED)
            process = self._process
            fresh = process is None
            if process is None:
                process = self._process = self._start_process()
        if fresh:
            self._next_message(watch)  # the worker reports that it is ready
        return process

    def _load(self, work: Callable[..., Any], process: subprocess.Popen[bytes], watch: _Watch) -> None:
        """Have the child import the module of the work first, because deadlines in its arguments then run."""
        module = getattr(work, "func", work).__module__
        if module in self._loaded:
            return
        self._send(TaskMessage(_pickle_task(_import_only, (work,)), None), process)
        _unpickle_result(self._next_message(watch))
        self._loaded.add(module)

    @staticmethod
    def _send(task: TaskMessage, process: subprocess.Popen[bytes]) -> None:
        assert process.stdin is not None
        with suppress(BrokenPipeError):  # the child died; its exit code shows why
            send(task, process.stdin)

    def _start_process(self) -> subprocess.Popen[bytes]:
        # -P: a folder `crossfield` or a file numpy.py in the current folder must not be imported.
        process = start_group(
            [sys.executable, "-P", "-c", _PROGRAM, *sys.path],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=self._folder,
            env=os.environ | (_ONE_THREAD if self._one_thread else {}),
        )
        self._answers, self._loaded = queue.SimpleQueue(), set()
        threading.Thread(target=_listen, args=(process, self._answers), daemon=True).start()
        return process

    def _next_message(self, watch: _Watch) -> Any:
        """Wait for the next message of the child."""
        while True:
            try:
                answer = self._answers.get(timeout=_TICK)
            except queue.Empty:
                watch.look()
            except KeyboardInterrupt:
                watch.interrupt()
            else:
                if answer is _ENDED:
                    if watch.asked:
                        raise KilledError("ended on a request to stop", interrupted=watch.interrupted)
                    raise WorkerError(self._describe_end())
                return answer

    def _describe_end(self) -> str:
        process = self._process
        if process is None:
            return _CLOSED
        code = process.wait()
        remedy = f", probably for lack of memory; {self._remedy}" if code == KILLED else ""
        return f"a process ended before its work was done: it {describe_exit(code)}{remedy}"

    def _ask_to_stop(self) -> None:
        process = self._process
        if process is not None and process.stdin is not None:
            with suppress(OSError):
                send(StopMessage(), process.stdin)


def _import_only(_work: Callable[..., Any]) -> None:
    """Do nothing; the module of the work was imported when this call arrived."""


class _UnsentError(WorkerError):
    """A task that pickle refuses; the child is unchanged."""


def _pickle_task(work: Callable[..., Any], arguments: tuple[Any, ...]) -> bytes:
    try:
        return pickle.dumps(partial(work, *arguments))
    except Exception as error:
        raise _UnsentError(f"a task cannot be sent to a process: {error_text(error)}") from error


def _unpickle_result(answer: bytes) -> Any:
    """Return the result in an answer, or raise the error in it."""
    try:
        done, result = pickle.loads(answer)  # noqa: S301 - from a process of our own
    except Exception as error:
        raise WorkerError(f"the result of a task cannot be read: {error_text(error)}") from error
    if not done:
        raise result
    return result


_ENDED: Final = object()  # item in the queue of answers after the child has closed its end of the pipe


def _listen(process: subprocess.Popen[bytes], answers: queue.SimpleQueue[Any]) -> None:
    assert process.stdout is not None
    with process.stdout as stream:
        try:
            while True:
                answers.put(pickle.load(stream))  # noqa: S301 - from a process of our own
        except Exception:  # noqa: BLE001 - pickle raises anything for a truncated message
            answers.put(_ENDED)


@dataclass
class _Watch:
    """When a call is asked to stop and when it is killed: by its deadline, by the caller and by Ctrl-C."""

    deadline: Deadline
    ask: Callable[[], None]
    stop: IsOver = never
    asked: int = 0
    patience: Deadline | None = None

    def __post_init__(self) -> None:
        self.kill = self.deadline.later(GRACE + GRACE_SHARE * min(self.deadline.left(), 1e9))

    @property
    def interrupted(self) -> bool:
        return self.patience is not None

    def interrupt(self) -> None:
        """Note Ctrl-C; raise it when it is the second."""
        if self.patience is not None:
            raise KeyboardInterrupt
        self.patience = Deadline.after(PATIENCE)
        self.look()

    def look(self) -> None:
        """Ask the work to stop when it is due; raise KilledError when it had its time."""
        if self.patience is None and self.stop():
            self.patience = Deadline.after(PATIENCE)
        if self.patience is not None and self.patience.passed():
            raise KilledError("did not stop when it was interrupted and was killed", interrupted=True)
        if self.kill.passed():
            raise KilledError("did not stop at its time limit and was killed", interrupted=self.interrupted)
        if self.asked < self._stops_due():
            self.asked += 1
            self.ask()

    def _stops_due(self) -> int:
        """Return how many requests to stop are due by now."""
        late = int(self.deadline.passed())
        if self.patience is None:
            return late
        return late + 1 + self.patience.later(-PATIENCE / 2).passed()
