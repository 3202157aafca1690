"""Tasks of a build: in this process, in processes of this machine, or by the workers of a dask scheduler.

A task is a function from values to values that writes no files. If a dask worker dies during a task, another
one repeats it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from queue import SimpleQueue
from typing import Any, Final, TypeVar

from ....models.errors import CrossfieldError
from ....models.processes.child_program import WorkerError
from ....models.processes.cluster import connect_cluster
from ....models.processes.process_pool import process_pool

T = TypeVar("T")

_AHEAD: Final = 64  # tasks submitted to a cluster at once, while it has few workers
_PER_THREAD: Final = 2  # tasks submitted at once for each thread of a cluster or each process


class BuildError(CrossfieldError):
    """Loss of workers."""


@contextmanager
def open_tasks(jobs: int, scheduler: str | None = None) -> Iterator[Tasks]:
    """Yield tasks for that many processes, or for the workers of a scheduler, however many come and go.

    A killed build loses the unfinished ones. Raises InputError without a scheduler or dask; BuildError when
    workers die.
    """
    try:
        if scheduler is None:
            with process_pool(jobs) as executor:
                yield Tasks(executor, lambda: 1 if jobs == 1 else _PER_THREAD * jobs)
            return
        with connect_cluster(scheduler) as client:
            executor = client.get_executor(pure=False)
            yield Tasks(executor, lambda: max(_AHEAD, _PER_THREAD * sum(client.nthreads().values())))
    except WorkerError as error:
        raise BuildError(f"{error}; complete files are kept") from error


class Tasks:
    """Tasks in progress, a limited number at once: function, value, and callback for the result.

    count_ahead: the number of tasks to submit at once; called again from time to time.
    """

    def __init__(self, executor: Executor, count_ahead: Callable[[], int]) -> None:
        self._executor, self._count_ahead = executor, count_ahead
        self._waiting: list[tuple[Callable[[Any], Any], Any, Callable[[Any], None]]] = []

    def add(self, function: Callable[[Any], T], value: Any, finish: Callable[[T], None]) -> None:
        """Schedule a call of the function, and of `finish` in this process with its result.

        Tasks that `finish` adds run first.
        """
        self._waiting.append((function, value, finish))

    def run(self) -> None:
        """Run all tasks. Raises the error of a task."""
        running: dict[Future[Any], Callable[[Any], None]] = {}
        done: SimpleQueue[Future[Any]] = SimpleQueue()
        most = until_count = 0
        while self._waiting or running:
            if until_count == 0:  # a cluster is asked rarely
                most = until_count = self._count_ahead()
            while self._waiting and len(running) < most:
                function, value, finish = self._waiting.pop()
                future = self._executor.submit(function, value)
                running[future] = finish
                future.add_done_callback(done.put)
            future = done.get()
            until_count -= 1
            running.pop(future)(future.result())
