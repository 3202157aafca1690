"""The search that starts from the dual of a coarse lattice where this is lower.

A few passes over the first lattice of a proof consider all pixels at once. They often find the right jumps
of a whole drawing, which a search patch by patch does not reach from the greedy field.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from ..field.field import CrossField, relabelled
from ..field.jumps import free_jumps
from ..instance.instance import Instance
from ..processes.deadline import Deadline, Over, never
from ..search.search import RoundProgress, Search
from ..search.search import search as search_patches

_FEWEST: Final = 64  # pixels up to which a search alone finds the optimum
_MOST: Final = 1000  # beyond, the field comes from the grid of half the resolution
_STEPS: Final = 16  # in pi/2
_PASSES: Final = 3  # forwards and backwards before fields are rounded
_ROUNDINGS: Final = 2  # later ones of this lattice find little
_LEAST_SECONDS: Final = 5.0  # with less, loading compiled code would take a good part of them
_COMPILING: Final = 60.0  # seconds; with less, compiling would


def search(
    instance: Instance,
    *,
    seconds: float | Deadline | None = None,
    rounds: int | None = None,
    seed: int = 0,
    jobs: int = 2,
    start: CrossField | None = None,
    progress: RoundProgress = lambda *_: None,
) -> Search:
    """Search for the field of least 2-norm energy, never above `start`.

    The result is also not above the first field, unless time cuts that off, and not above the result of a
    short proof. The search begins at the best of them (grids of 65 to 1000 pixels, or that many at lower
    resolution; with 5 s or more, or 60 s while code is not compiled yet).

    seconds, rounds: when to end, whichever comes first; with neither, after 200 perturbations per pixel
    without success. All work respects the seconds, the start too. One step may exceed them (on a grid of 100
    x 100 a second), and so may the last solve, by 5 % and half a second. Without seconds the same instance,
    seed and rounds give the same field on the same kind of processor. jobs: number of processes; start: a
    field that is used if, improved, it is better than the others; seed: of all random choices. Ctrl-C ends
    the search with the best field so far. Raises InputError for a limit that is not positive and too many
    jobs, InstanceError for a start on another instance.
    """
    return search_patches(
        instance,
        seconds=seconds,
        rounds=rounds,
        seed=seed,
        jobs=jobs,
        start=start,
        progress=progress,
        suggest=partial(suggested, jobs=jobs),
    )


def suggested(field: CrossField, left: Callable[[], float], over: Over = never, *, jobs: int) -> CrossField:
    """A field of no more energy: the given one, or one rounded from the dual of the coarsest lattice.

    left: seconds that are left; with few of them, and for very small and large grids, the given field
    returns. over: whether the time is over. jobs: threads; any number of them gives the same field.
    """
    if not _FEWEST < field.instance.grid.size <= _MOST:
        return field
    if left() < _LEAST_SECONDS:
        return field
    # Code that Numba compiles is loaded only here: it takes a second.
    from ..processes.compiled import all_compiled
    from ..processes.crew import crew
    from .lattice import Lattice
    from .rounding import Rounding, improve
    from .sweep import Dual

    if left() < _COMPILING and not all_compiled():
        return field
    with crew(jobs) as hands:
        instance, (jumps, _) = field.instance, free_jumps(field.instance.grid, field.alpha, field.beta)
        centre = relabelled(instance.with_gauge("strokes"), field.alpha, field.beta, jumps)
        dual = Dual(Lattice.whole(centre, _STEPS), hands)
        rounding = Rounding(dual, improve)
        for _ in range(_ROUNDINGS):
            if over():
                break
            dual.ascend(_PASSES, over)
            field = rounding.lower(field, over)
    return field
