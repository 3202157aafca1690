"""The search that also starts from the duals of coarse lattices.

A few passes over the first lattices of a proof consider all pixels at once. They often find the right jumps
of a whole drawing, which a search patch by patch does not reach from the greedy field.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Final

from ..arguments import checked_arguments
from ..field.field import CrossField, relabelled
from ..field.jumps import free_jumps
from ..instance.instance import Instance
from ..processes.deadline import Over, Progress, Stop, never, silent, stop_function
from ..processes.limits import Limits
from ..search.search import Search, search_patches

_FEWEST: Final = 64  # pixels up to which a search alone finds the optimum
_MOST: Final = 1000  # beyond, the field comes from the grid of half the resolution
_STEPS: Final = (16, 32)  # in pi/2, one lattice after the other
_FEW: Final = 500  # pixels up to which the second one is worth its time
_PASSES: Final = 3  # forwards and backwards before fields are rounded
_ROUNDINGS: Final = 2  # later ones of this lattice find little
_LEAST_SECONDS: Final = 5.0  # with less, loading compiled code would take a good part of them
_COMPILING: Final = 60.0  # seconds; with less, compiling would


@checked_arguments
def search(
    instance: Instance,
    *,
    limits: Limits | None = None,
    rounds: int | None = None,
    seed: int = 0,
    jobs: int = 2,
    start: CrossField | None = None,
    progress: Progress = silent,
    stop: Stop | None = None,
) -> Search:
    """Search for a field of low 2-norm energy, from the greedy field and other starts.

    The result has at most the energy of `start` and, if time allows, of the first field. On up to 400 pixels,
    the first three rounds explore from all starts, and the later ones from the best field. If the grid, or
    one of its coarser versions, has 65 to 1000 pixels, fields of short proofs are among the starts, unless
    less than 5 s are left, or less than 60 s while compiled code is not in the cache yet.

    Without a time limit the same instance, seed and rounds give the same field on the same kind of processor,
    for any number of jobs and threads. Ctrl-C ends the search with the best field so far.

    Parameters
    ----------
    instance
        The instance.
    limits
        Time limit, and threads of the short proof (0: as many as `jobs`). All work keeps to the time limit,
        the start too. One step of it may exceed the limit (on a grid of 100 x 100 one second), and the last
        solve by 5 % and half a second. None: no time limit.
    rounds
        Number of rounds after which to end. With neither rounds nor a time limit the search ends after 200
        kicks per pixel without success.
    seed
        Seed of all random choices.
    jobs
        Number of processes.
    start
        A field to begin with where, improved, it is lower than the other starts.
    progress
        Receives a line of text after every round.
    stop
        A function that returns whether to stop, or an event. The best field so far is then returned.

    Returns
    -------
    Search
        The field, the number of rounds, the improvements, and why the search ended.

    Raises
    ------
    InputError
        For a negative number of rounds, and for too few or too many jobs.
    InstanceError
        For a start on another instance.

    """
    limits = limits or Limits(math.inf)
    return search_patches(
        instance,
        deadline=limits.deadline(),
        rounds=rounds,
        seed=seed,
        jobs=jobs,
        start=start,
        progress=progress,
        stop=stop_function(stop),
        suggest=partial(suggested, threads=limits.threads or jobs),
    )


def suggested(
    field: CrossField, left: Callable[[], float], over: Over = never, *, threads: int
) -> list[CrossField]:
    """Fields of no more energy, rounded from the duals of the coarsest lattices.

    The first lattice has `field` as its centre, the second one the result of the first. left: returns the
    seconds that are left. The list is empty for small and large grids, and where they are too few. Any number
    of threads gives the same fields.
    """
    found: list[CrossField] = []
    if not _FEWEST < field.instance.grid.size <= _MOST or left() < _LEAST_SECONDS:
        return found
    # Code that Numba compiles is loaded only here: it takes a second.
    from ..processes.compiled import all_compiled, crew
    from .dual import Dual
    from .lattice import Lattice
    from .rounding import Rounding, improve

    if left() < _COMPILING and not all_compiled():
        return found
    with crew(threads) as hands:
        for steps in _STEPS[: 2 if field.instance.grid.size <= _FEW else 1]:
            jumps, _ = free_jumps(field.instance.grid, field.alpha, field.beta)
            centre = relabelled(field.instance.with_gauge("strokes"), field.alpha, field.beta, jumps)
            dual = Dual(Lattice.whole(centre, steps), hands)
            rounding = Rounding(dual, improve)
            for _ in range(_ROUNDINGS):
                if over():
                    break
                dual.ascend(_PASSES, over)
                field = rounding.lower(field, over)
            found.append(field)
    return found
