"""The program of a child process, its messages, and requests of its parent to stop the work."""

from __future__ import annotations

import ctypes
import os
import pickle
import queue
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, Final, NamedTuple

from ..errors import CrossfieldError

_STOP: Final = threading.Event()
_HOOKS: Final[list[Callable[[], object]]] = []
_LOCK: Final = threading.Lock()


class WorkerError(CrossfieldError):
    """A child process ended early, or a task, result or error cannot be sent to or from it."""


class TaskMessage(NamedTuple):
    """A pickled function with its arguments, and the file for its output, or None."""

    work: bytes
    log: Path | None


class StopMessage(NamedTuple):
    """A request to end the current work with its present result."""


def send(value: Any, stream: IO[bytes]) -> None:
    """Write a value to a pipe at once."""
    stream.write(pickle.dumps(value))
    stream.flush()


def error_text(error: Exception) -> str:
    """Name and message of an error of any kind."""
    return f"{type(error).__name__}: {error}"


def is_stopped() -> bool:
    """Return whether the parent has requested a stop of the current work."""
    return _STOP.is_set()


@contextmanager
def on_stop(hook: Callable[[], object]) -> Iterator[None]:
    """Call `hook` from another thread at each request to stop, and at once if one has arrived already."""
    with _LOCK:
        _HOOKS.append(hook)
        late = _STOP.is_set()
    try:
        if late:
            hook()
        yield
    finally:
        with _LOCK:
            _HOOKS.remove(hook)


def ask_to_stop() -> None:
    """Record that the parent requests a stop, and call the hooks."""
    with _LOCK:
        _STOP.set()
        hooks = tuple(_HOOKS)
    for hook in hooks:
        hook()


def forget_stops() -> None:
    """Forget requests to stop earlier work."""
    _STOP.clear()


def main() -> None:
    """Answer each task from standard input by a message on standard output, until either closes."""
    tasks: queue.SimpleQueue[TaskMessage] = queue.SimpleQueue()
    with suppress(BrokenPipeError), os.fdopen(os.dup(1), "wb") as answers:  # the reader may have been killed
        os.dup2(2, 1)  # output of libraries is not an answer
        threading.Thread(target=_receive, args=(tasks,), daemon=True).start()
        send(b"", answers)  # all imports are done: time limits count from here
        while True:
            task = tasks.get()
            with output_to(task.log):
                answer = _answer(task.work)
            send(answer, answers)


def _receive(tasks: queue.SimpleQueue[TaskMessage]) -> None:
    """Queue tasks and pass on requests to stop; end this process when the parent is gone."""
    try:
        # Not sys.stdin: Python aborts at exit while a thread waits there.
        with os.fdopen(os.dup(0), "rb") as stream:
            while True:
                message = pickle.load(stream)  # noqa: S301 - from the process that started this one
                if isinstance(message, StopMessage):
                    ask_to_stop()
                else:
                    forget_stops()
                    tasks.put(message)
    finally:
        os._exit(1)


def _answer(task: bytes) -> bytes:
    """Pickle of whether the task succeeded, and of its result or error."""
    try:
        work: Callable[[], object] = pickle.loads(task)  # noqa: S301 - from the process that started this one
    except Exception as error:  # noqa: BLE001 - imports raise anything
        message = f"a process cannot import the function of its task or read its data: {error_text(error)}"
        return pickle.dumps((False, _with_traceback(WorkerError(message))))
    try:
        result = work()
    except Exception as error:  # noqa: BLE001 - the parent raises it where the task came from
        return _pickle_error(error)
    try:
        return pickle.dumps((True, result))
    except Exception as error:  # noqa: BLE001 - pickling calls methods of any class
        message = f"the result of a task cannot be sent back: {error_text(error)}"
        return pickle.dumps((False, _with_traceback(WorkerError(message))))


def _pickle_error(error: Exception) -> bytes:
    """Pickle of an error of the work, or of a WorkerError that names it if it cannot be pickled."""
    try:
        # Pickles call the class of an error with its `args`, which do not fit every constructor.
        sent = pickle.dumps((False, _with_traceback(error)))
        _, arrived = pickle.loads(sent)  # noqa: S301 - made in the line above
        if type(arrived) is type(error) and str(arrived) == str(error):
            return sent
    except Exception:  # noqa: BLE001, S110 - an exception while pickling does not concern the work
        pass
    return pickle.dumps((False, _with_traceback(WorkerError(error_text(error)))))


def _with_traceback(error: Exception) -> Exception:
    """The error, with the traceback of the exception being handled as a note."""
    error.add_note(traceback.format_exc())
    return error


@contextmanager
def output_to(log: Path | None) -> Iterator[None]:
    """Redirect the output of this process to a file, including C libraries."""
    if log is None:
        yield
        return
    originals = os.dup(1), os.dup(2)
    target = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
    try:
        _redirect(target, target)
        yield
    finally:
        _redirect(*originals)
        for descriptor in (*originals, target):
            os.close(descriptor)


def _redirect(out: int, err: int) -> None:
    """Make descriptors 1 and 2 copies of others, after writing buffered output."""
    for stream in filter(None, (sys.stdout, sys.stderr)):
        stream.flush()
    with suppress(OSError, TypeError, AttributeError):  # elsewhere C libraries flush by themselves
        ctypes.CDLL(None).fflush(None)
    os.dup2(out, 1)
    os.dup2(err, 2)
