"""The program of a child process: it calls functions for its parent until its standard input closes."""

from __future__ import annotations

import ctypes
import os
import pickle
import queue
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from . import control
from .messages import Call, Raised, Stop, WorkerError, send


def main() -> None:
    """Answer each call that arrives on standard input by one message on standard output."""
    calls: queue.SimpleQueue[Call] = queue.SimpleQueue()
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)  # what a library prints is no answer
        threading.Thread(target=_receive, args=(calls,), daemon=True).start()
        send(None, answers)  # all imports are done: time limits count from here
        while True:
            call = calls.get()
            with _output_to(call.log):
                answer = _answer(call)
            _hand_over(answer, answers)


def _receive(calls: queue.SimpleQueue[Call]) -> None:
    """Queue calls and pass on requests to stop; end this process when the parent is gone."""
    try:
        # Not sys.stdin: Python aborts at exit while a thread waits there.
        with os.fdopen(os.dup(0), "rb") as stream:
            while True:
                message = pickle.load(stream)  # noqa: S301 - from the process that started this one
                if isinstance(message, Stop):
                    control.ask_to_stop()
                else:
                    control.begin()
                    calls.put(message)
    finally:
        os._exit(1)


def _answer(call: Call) -> Any:
    try:
        work, arguments = pickle.loads(call.work)  # noqa: S301 - from the process that started this one
    except Exception as error:  # noqa: BLE001 - a module may raise anything while it is imported
        return Raised(WorkerError(f"the child process cannot load {call.name}: {_words(error)}"))
    try:
        return work(*arguments)
    except Exception as error:  # noqa: BLE001 - the parent raises it
        return Raised(error, traceback.format_exc())


def _hand_over(answer: Any, answers: IO[bytes]) -> None:
    """Send an answer; one that pickle does not take is replaced by an error that says so."""
    try:
        data = pickle.dumps(answer)
        if isinstance(answer, Raised):
            pickle.loads(data)  # noqa: S301 - exceptions with a constructor of their own may not come back
    except Exception as error:  # noqa: BLE001 - __reduce__ may raise anything
        if isinstance(answer, Raised):
            answer = Raised(WorkerError(_words(answer.error)), answer.trace)
        else:
            kind = type(answer).__name__
            answer = Raised(WorkerError(f"the result, a {kind}, cannot be sent back: {_words(error)}"))
        data = pickle.dumps(answer)
    answers.write(data)
    answers.flush()


def _words(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


@contextmanager
def _output_to(log: Path | None) -> Iterator[None]:
    """Send what the work prints to a file, C libraries included."""
    if log is None:
        yield
        return
    kept = os.dup(1), os.dup(2)
    target = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
    try:
        _redirect(target, target)
        yield
    finally:
        _redirect(*kept)
        for descriptor in (*kept, target):
            os.close(descriptor)


def _redirect(out: int, err: int) -> None:
    """Make descriptors 1 and 2 copies of others, after what is buffered was written."""
    sys.stdout.flush()
    sys.stderr.flush()
    with suppress(OSError, TypeError, AttributeError):  # elsewhere C libraries flush by themselves
        ctypes.CDLL(None).fflush(None)
    os.dup2(out, 1)
    os.dup2(err, 2)
