"""Where tasks run: in this process, in processes of this machine, or on the workers of a dask scheduler.

All three are executors of `concurrent.futures`. A task is a function from values to values that writes
nothing, so that a worker may die in the middle of it: it is then done again elsewhere, and its result is used
once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from typing import Any, Final, TypeVar

from ....models.errors import CrossfieldError, InputError
from ....models.processes.messages import WorkerError
from ....models.processes.side_by_side import workers

T = TypeVar("T")

_AHEAD: Final = 64
"""Tasks that are handed out to a cluster at once: enough for its workers, few enough to keep memory flat."""
_TRIES: Final = 3  # of a task whose dask worker died
_PATIENCE: Final = "10s"  # to reach a scheduler


class BuildError(CrossfieldError):
    """Workers that died or went away."""


def ahead(jobs: int, scheduler: str | None) -> int:
    """How many tasks are handed out at once; a build that is killed loses those that are not done."""
    return _AHEAD if scheduler else 1 if jobs == 1 else 2 * jobs


@contextmanager
def executor(jobs: int, scheduler: str | None) -> Iterator[Executor]:
    """Where tasks run. Raises InputError without a scheduler or dask; BuildError when workers die."""
    try:
        with _cluster(scheduler) if scheduler else workers(jobs) as chosen:
            yield chosen
    except WorkerError as error:
        raise BuildError(f"{error}; of a build, what is whole is kept") from error


@contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    try:
        import distributed
    except ModuleNotFoundError as error:
        raise InputError(
            "a scheduler needs dask; pip install 'crossfield[cluster]' here and on the workers"
        ) from error
    try:
        client: Any = distributed.Client(  # type: ignore[no-untyped-call]
            address, timeout=_PATIENCE, set_as_default=False
        )
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"no scheduler answers at {address[:100]}; start one with `dask scheduler`, "
            "and give its address, say tcp://host:8786"
        ) from error
    try:
        yield client.get_executor(pure=False, retries=_TRIES)
    except distributed.KilledWorker as error:
        raise BuildError(
            "a task ended several workers, for want of memory most likely; see their logs and build again, "
            "what is whole is kept"
        ) from error
    except (CancelledError, distributed.comm.core.CommClosedError) as error:
        raise BuildError(
            f"the scheduler at {address[:100]} went away; start it and build again, what is whole is kept"
        ) from error
    finally:
        client.close()


class Tasks:
    """Tasks under way, a limited number at once: function, value, and what to do with the result."""

    def __init__(self, chosen: Executor, most: int) -> None:
        self._executor, self._most = chosen, most
        self._waiting: list[tuple[Callable[[Any], Any], Any, Callable[[Any], None]]] = []
        self._running: dict[Future[Any], Callable[[Any], None]] = {}

    def add(self, function: Callable[[Any], T], value: Any, finish: Callable[[T], None]) -> None:
        """Have the function called with the value somewhere, and `finish` here with its result.

        `finish` may add more, which goes first.
        """
        self._waiting.append((function, value, finish))

    def run(self) -> None:
        """Come back when all tasks are done. Raises what a task raises."""
        while self._waiting or self._running:
            while self._waiting and len(self._running) < self._most:
                function, value, finish = self._waiting.pop()
                self._running[self._executor.submit(function, value)] = finish
            done, _ = wait(self._running, return_when=FIRST_COMPLETED)
            for future in done:
                self._running.pop(future)(future.result())
