"""From a cross field to a surface with the crosses as curvature lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from operator import itemgetter
from typing import Final

import numpy as np
from scipy import ndimage

from ..arguments import check_flag
from ..field.field import CrossField
from ..instance.domain import Floats
from ..instance.grid import Grid
from ..processes.blas_threads import one_thread
from ..processes.deadline import IsOver, Progress, Stop, silent, stop_function
from .equations import FORGIVEN, Equations, Weights, descend, normals_of
from .freedom import LARGE, Freedom, find_deepest, find_open_depth, place_of
from .hints import Hint, check_hints, find_pixels, hint_rows
from .stencils import Crosses, GridLevel, Stencils, levels_of
from .surface import Surface
from .trust import confidence_of, right_angle_deviation

FIRST: Final = Weights(even=1e-4, facing=1e-2)  # stiff, so that starts converge to the same surface
WEIGHTS: Final = Weights(even=1e-6, facing=5e-5, forgiven=FORGIVEN)  # found on surfaces of docs/surface.md
CLEARLY: Final = 0.98  # ratio of energies below which a later start is preferred, the dome being the first
TELLING: Final = np.radians(10)  # least slant of a hint that distinguishes z from -z
_CLOSE: Final = 1.15  # ratio to the least energy of a level up to which a start is solved on the next one
_SAME: Final = 0.003  # relative difference of energies below which two starts have reached the same surface
_LEVEL: Final = 0.05  # ratio of sum to size of the leanings at the border below which neither side is outward


@one_thread()
def surface(
    field: CrossField,
    hints: Iterable[Hint] = (),
    *,
    flip: bool = False,
    concave: Iterable[tuple[float, float]] = (),
    stop: Stop | None = None,
    progress: Progress = silent,
) -> Surface:
    """Surface whose curvature lines look most like the crosses of a field, seen from the front.

    One height at each corner of a pixel, found by minimising the energy of `Equations` from three starts on
    a coarse grid, and from the best of them on finer ones. Neither the order of the two lines nor jumps
    matter. Parts of the mask that share no corner are independent; the mean height of each is 0.
    Deterministic unless `stop` ends it. See docs/surface.md.

    A surface that is turned inside out, z to -z, has the same crosses. So each part leans outward at its
    border on the whole. Where that is undecided, it leans upward, as a floor seen from above.

    Parameters
    ----------
    field
        The field.
    hints
        Normals that are known at some pixels. A part with a hint of 10 degrees slant or more takes its side
        from there. Hints also choose among surfaces of different depth with the same crosses.
    flip
        Whether to turn all other parts inside out.
    concave
        Places (x, y) in the drawing whose parts are bowls: they lean inward at their border on the whole, or
        downward where that is undecided, also with `flip`. Hints of 10 degrees slant or more take precedence.
    stop
        A function that returns whether to stop, or an event. The surface of the heights so far is then
        `interrupted`.
    progress
        Receives a line of text when a part begins.

    Returns
    -------
    Surface
        The surface, with the choices that crosses leave open.

    Raises
    ------
    InputError
        For a hint or place outside the mask, or a hint with angles that no normal has.

    """
    instance, all_hints, is_over = field.instance, tuple(hints), stop_function(stop)
    check_flag("flip", flip)
    check_hints(all_hints, instance)
    bowls = find_pixels(concave, instance)
    part_of, parts = ndimage.label(instance.mask, structure=np.ones((3, 3)))
    heights = np.full((instance.grid.height + 1, instance.grid.width + 1), np.nan)
    freedom: list[Freedom] = []
    all_crosses = Crosses.of(field)
    for number, window in enumerate(ndimage.find_objects(part_of), 1):
        progress("surface" if parts == 1 else f"surface, part {number} of {parts}")
        mask = part_of[window] == number
        stencils, crosses = Stencils(Grid(mask)), all_crosses.at(instance.grid.number[window][mask])
        level = GridLevel(stencils, crosses, (window[0].start, window[1].start))
        part_hints = [hint for hint in all_hints if part_of[hint.row, hint.column] == number]
        is_bowl = any(part_of[bowl] == number for bowl in bowls)
        z = _solve_part(level, part_hints, is_over, flip=flip or is_bowl)
        used, (top, left) = level.stencils.used, level.corner
        heights[top : top + used.shape[0], left : left + used.shape[1]][used] = z - z.mean()
        if level.grid.size >= LARGE * instance.grid.size:
            if not (is_bowl or _decide_side(part_hints)):
                middle = place_of(instance, *find_deepest(part_of == number))
                freedom.append(Freedom("side", number, level.grid.size, middle))
            another = None if part_hints else find_open_depth(level, z)
            if another:
                place = place_of(instance, another.row, another.column)
                freedom.append(Freedom("depth", number, level.grid.size, place, another))
    interrupted = is_over()
    trust = confidence_of(field, right_angle_deviation(field, heights))
    return Surface(field, heights, trust, tuple(freedom), interrupted)


def _solve_part(part: GridLevel, hints: Sequence[Hint], is_over: IsOver, *, flip: bool) -> Floats:
    """Minimum-energy heights: all starts are solved on the coarsest level, promising ones on finer levels."""
    level, *finer = levels_of(part)
    stiff = Equations(level.stencils, level.crosses, FIRST)
    starts = [_orient(level, descend(stiff, z, is_over)[1], flip=flip) for z in level.initial_heights]
    reached = _descend_with_hints(level, starts, hints, is_over)
    if _decide_side(hints):
        turned = _descend_with_hints(level, [-z for z in starts], hints, is_over)
        reached = [min(sides, key=itemgetter(0)) for sides in zip(reached, turned, strict=True)]
    for fine in finer:
        starts = [fine.interpolate(level, z) for z in _find_promising(reached)]
        level, reached = fine, _descend_with_hints(fine, starts, hints, is_over)
    least = min(energy for energy, _ in reached)
    z = next(z for energy, z in reached if CLEARLY * energy <= least)
    return z if hints else _orient(part, z, flip=flip)


def _find_promising(reached: Sequence[tuple[float, Floats]]) -> list[Floats]:
    """The heights that may lead to the least energy on a finer level, those of equal energies once."""
    least, kept = min(energy for energy, _ in reached), dict[float, Floats]()
    for energy, z in reached:
        if energy <= _CLOSE * least and all(abs(energy - other) > _SAME * other for other in kept):
            kept[energy] = z
    return list(kept.values())


def _decide_side(hints: Sequence[Hint]) -> bool:
    """Whether hints distinguish z from -z."""
    return any(hint.slant >= TELLING for hint in hints)


def _descend_with_hints(
    level: GridLevel, starts: Iterable[Floats], hints: Sequence[Hint], is_over: IsOver
) -> list[tuple[float, Floats]]:
    """The energy and heights reached from each start by descent, with the hints."""
    extra = [hint_rows(hint, level) for hint in hints]
    equations = Equations(level.stencils, level.crosses, WEIGHTS, extra)
    return [descend(equations, z, is_over) for z in starts]


def _orient(level: GridLevel, z: Floats, *, flip: bool) -> Floats:
    """The heights or their negatives, whichever lean outward at the border, else upwards; or the opposite."""
    lean = normals_of(level.stencils.gradient(z))[:2].T
    inside = np.pad(level.grid.mask, 1)
    row, column = level.grid.rows + 1, level.grid.columns + 1
    sides = [(0, 1, 1, 0), (0, -1, -1, 0), (-1, 0, 0, 1), (1, 0, 0, -1)]
    outward = np.concatenate([(lean @ (x, y))[~inside[row + r, column + c]] for r, c, x, y in sides])
    total = outward.sum()
    if abs(total) <= _LEVEL * np.abs(outward).sum():
        total = lean[:, 1].sum()
    return -z if (total < 0) != flip else z
