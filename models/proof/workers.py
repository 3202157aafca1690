"""The strips of a proof on the workers of a cluster, for grids that one machine cannot hold.

Each worker holds the shares of its strip from the beginning of a chain of levels to its end. This process
has the lattice, a byte for each label, and the levels that are recorded.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import numpy as np

from ..errors import InputError
from ..instance.grid import Grid
from ..processes.cluster import cluster
from ..processes.compiled import Crew
from ..processes.control import WorkerError
from ..processes.deadline import Over
from .dual import Answer, Divide, Place
from .lattice import Lattice
from .strip import Part, Passed, Strip, part_of


@contextmanager
def strips_on(scheduler: str) -> Iterator[Divide]:
    """Yield a function that divides a lattice into strips, one on each worker of a dask scheduler.

    Raises InputError without dask, and without a scheduler or workers at that address; WorkerError when a
    worker is lost.
    """
    with cluster(scheduler) as client, client.as_current():
        if not client.nthreads():
            raise InputError(
                f"the scheduler at {scheduler[:100]} has no worker; start some with `dask worker`"
            )
        yield lambda lattice: _begun(client, lattice)


def _begun(client: Any, lattice: Lattice) -> list[Place]:
    """The strips of a lattice, each on a worker."""
    with _reached():
        threads = client.nthreads()
        if not threads:
            raise WorkerError("all workers are lost")
        asked = []
        for own, name in zip(strips(lattice.instance.grid, len(threads)), sorted(threads), strict=False):
            given = part_of(lattice, own), threads[name]
            asked.append((own, client.submit(_StripThere, *given, workers=[name], actor=True)))
        return [_There(own, actor.result()) for own, actor in asked]


def strips(grid: Grid, count: int) -> list[slice]:
    """The pixels of a grid in strips of whole rows, about equal and at most as many as wanted."""
    rows = np.append(np.flatnonzero(np.diff(grid.rows, prepend=-1)), grid.size)
    goals = np.linspace(0, grid.size, count + 1)
    ends = np.unique(rows[np.abs(rows[:, None] - goals).argmin(axis=0)])
    return [slice(int(begin), int(end)) for begin, end in pairwise(ends)]


@contextmanager
def _reached() -> Iterator[None]:
    """Raise WorkerError where dask does not reach the worker of a strip."""
    try:
        yield
    except OSError as error:
        raise WorkerError(f"a worker with a strip is lost: {error}") from error
    except RuntimeError as error:
        if "Actor was lost" not in str(error):
            raise
        raise WorkerError("a worker with a strip is lost") from error


class _StripThere(Strip):
    """A strip on a worker, with the worker's threads."""

    def __init__(self, part: Part, threads: int) -> None:
        super().__init__(part, Crew(threads, ThreadPoolExecutor(max(1, threads - 1))))


class _There:
    """A strip on a worker."""

    def __init__(self, pixels: slice, actor: Any) -> None:
        self.pixels, self._actor = pixels, actor

    def ask(self, name: str, *arguments: Any, **named: Any) -> Answer:
        """Call a method of the strip. Raises WorkerError, then or later, when the worker is lost."""
        with _reached():
            answer = getattr(self._actor, name)(*arguments, **named)

        def waited() -> Any:
            with _reached():
                return answer.result()

        return waited

    def sweep(self, earlier: int, over: Over) -> Passed | None:
        """Do a pass, unless time is over."""
        passed: Passed | None = None if over() else self.ask("sweep", earlier)()
        return passed
