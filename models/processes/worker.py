"""A process that does tasks for another one: run as a program by models/processes/side_by_side.py."""

from __future__ import annotations

import os
import queue
from collections.abc import Callable
from typing import Any

from .side_by_side import Raised, leave_with_parent, send


def main() -> None:
    """Do tasks from standard input one by one, answering on standard output, until it closes."""
    tasks: queue.SimpleQueue[Any] = queue.SimpleQueue()
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)  # what a library prints is no answer
        leave_with_parent(tasks.put)
        while True:
            send(_answer(*tasks.get()), answers)


def _answer(work: Callable[[Any], Any], task: Any) -> Any:
    try:
        return work(task)
    except Exception as error:  # noqa: BLE001 - it is raised where the task came from
        return Raised(error)


if __name__ == "__main__":
    main()
