"""A process that does tasks for another one; models/processes/side_by_side.py starts it."""

from __future__ import annotations

import os
import pickle
import queue
import traceback
from collections.abc import Callable

from .side_by_side import WorkerError, leave_with_parent, reason, send


def main() -> None:
    """Do tasks from standard input one by one, answering on standard output, until it closes."""
    tasks: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)  # what a library prints is no answer
        leave_with_parent(tasks.put)
        while True:
            send(_answer(tasks.get()), answers)


def _answer(task: bytes) -> bytes:
    """Pickle of whether the task succeeded, and of its result or error."""
    try:
        work: Callable[[], object] = pickle.loads(task)  # noqa: S301 - from the process that started this one
    except Exception as error:  # noqa: BLE001 - imports raise anything
        message = f"a process cannot import the function of its task or read its data: {reason(error)}"
        return pickle.dumps((False, _noted(WorkerError(message))))
    try:
        found = work()
    except Exception as error:  # noqa: BLE001 - it is raised where the task came from
        return _failure(error)
    try:
        return pickle.dumps((True, found))
    except Exception as error:  # noqa: BLE001 - pickling calls methods of any class
        message = f"the result of a task cannot be sent back: {reason(error)}"
        return pickle.dumps((False, _noted(WorkerError(message))))


def _failure(error: Exception) -> bytes:
    """Pickle of an error of the work, or of a WorkerError with its name and message where it cannot travel.

    Pickles call the class of an error with its `args`, which do not fit every constructor.
    """
    try:
        sent = pickle.dumps((False, _noted(error)))
        _, arrived = pickle.loads(sent)  # noqa: S301 - made in the line above
        if type(arrived) is type(error) and str(arrived) == str(error):
            return sent
    except Exception:  # noqa: BLE001, S110 - what pickling such an error raises says nothing about the work
        pass
    return pickle.dumps((False, _noted(WorkerError(reason(error)))))


def _noted(error: Exception) -> Exception:
    """The error with the traceback of the one that is being handled as a note."""
    error.add_note(traceback.format_exc())
    return error
