"""The same work on several tasks at once, in processes that Ctrl-C does not reach."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from .interruption import deaf_children

Task = TypeVar("Task")
Found = TypeVar("Found")


@contextmanager
def side_by_side(
    work: Callable[[Task], Found], jobs: int
) -> Iterator[Callable[[Iterable[Task]], list[Found]]]:
    """A function that does the work on each of some tasks, in that many processes, and gives what was found in their order.

    A task is drawn when a process is free for it, so that it may say how much time is left.
    """
    if jobs == 1:
        yield lambda tasks: [work(task) for task in tasks]
        return
    from joblib import Parallel, delayed

    with Parallel(n_jobs=jobs, backend="loky", pre_dispatch=jobs, batch_size=1) as parallel:
        with deaf_children():
            parallel(delayed(int)() for _ in range(jobs))
        yield lambda tasks: list(parallel(delayed(work)(task) for task in tasks))
