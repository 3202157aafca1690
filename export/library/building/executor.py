"""Executors of tasks: this process, processes of this machine, or the workers of a dask scheduler.

A task is a function from values to values that writes no files. If a dask worker dies during a task, another
one repeats it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import contextmanager
from typing import Any, Final, TypeVar

from ....models.errors import CrossfieldError
from ....models.processes.child_program import WorkerError
from ....models.processes.cluster import connect_cluster
from ....models.processes.process_pool import process_pool

T = TypeVar("T")

_AHEAD: Final = 64  # tasks submitted to a cluster at once: enough for its workers, at constant memory
_TRIES: Final = 3  # of a task whose dask worker died


class BuildError(CrossfieldError):
    """Loss of workers."""


def tasks_ahead(jobs: int, scheduler: str | None) -> int:
    """Return the number of tasks submitted at once; a killed build loses the unfinished ones."""
    return _AHEAD if scheduler else 1 if jobs == 1 else 2 * jobs


@contextmanager
def open_executor(jobs: int, scheduler: str | None) -> Iterator[Executor]:
    """Yield an executor. Raises InputError without a scheduler or dask; BuildError when workers die."""
    try:
        with _dask_executor(scheduler) if scheduler else process_pool(jobs) as chosen:
            yield chosen
    except WorkerError as error:
        raise BuildError(f"{error}; complete files are kept") from error


@contextmanager
def _dask_executor(address: str) -> Iterator[Executor]:
    with connect_cluster(address) as client:
        yield client.get_executor(pure=False, retries=_TRIES)


class Tasks:
    """Tasks in progress, a limited number at once: function, value, and callback for the result."""

    def __init__(self, chosen: Executor, most: int) -> None:
        self._executor, self._most = chosen, most
        self._waiting: list[tuple[Callable[[Any], Any], Any, Callable[[Any], None]]] = []
        self._running: dict[Future[Any], Callable[[Any], None]] = {}

    def add(self, function: Callable[[Any], T], value: Any, finish: Callable[[T], None]) -> None:
        """Schedule a call of the function, and of `finish` in this process with its result.

        Tasks that `finish` adds run first.
        """
        self._waiting.append((function, value, finish))

    def run(self) -> None:
        """Run all tasks. Raises the error of a task."""
        while self._waiting or self._running:
            while self._waiting and len(self._running) < self._most:
                function, value, finish = self._waiting.pop()
                self._running[self._executor.submit(function, value)] = finish
            done, _ = wait(self._running, return_when=FIRST_COMPLETED)
            for future in done:
                self._running.pop(future)(future.result())
