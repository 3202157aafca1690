"""Gaps in an outline, and the short bridges between ends of strokes that close them.

A drawing's outline is seldom drawn without a break. A bridge is a straight line between two ends of strokes,
or from an end to the next stroke; it is kept only if it closes off room that would be open without it
(`close_outline`).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.angles import vector_length
from ..instance.grid import Bools, Floats
from .cover import Frame, Indices, curve_pixels
from .outline import enclosed_region

LONGEST: Final = 0.08  # longest bridge, as a share of the grid's longer side; wider gaps are meant
WIDER: Final = 0.7  # least width of the room behind a bridge per pixel of the bridge
AHEAD: Final = 0.5
ASIDE: Final = -0.1  # least cosines of the turns from the two strokes into the bridge
_NEAREST: Final = 8  # most other ends that an end may be bridged to: the work stays linear
_MOST_BRIDGES: Final = 10_000  # only the shortest: the work has a bound
_MOST_TRIED: Final = 32  # bridges that are tested for being unnecessary


def close_outline(walls: Bools, ends: Floats, frame: Frame) -> tuple[Bools, Floats]:
    """The walls with the bridges that close an outline, and those bridges, (m, 2, 2) with x and y.

    walls: bool [height, width], pixels that strokes cover. ends: (n, 2, 2), points and ways out. A bridge
    leads from an end at the outside to another such end, or to the next stroke. It is no longer than LONGEST
    and than the strokes that it connects, continues them, and closes off room as wide as the gap.
    """
    outside = ~enclosed_region(walls)
    bridges = _find_candidates(walls, outside, ends, frame)
    if not len(bridges):
        return walls, bridges
    number, row, column = curve_pixels(bridges, np.arange(len(bridges), dtype=np.int32), frame, 0.0)
    rooms, mouths = _find_rooms(walls, outside, row, column)
    if not rooms.any():
        return walls, bridges[:0]
    pixels = (number, row, column)
    chosen = _choose_bridges(walls, rooms, mouths, pixels)
    return _draw_bridges(walls, pixels, chosen), bridges[chosen]


def _stroke_extents(walls: Bools, row: Indices, column: Indices) -> Floats:
    """Extents (n,) in pixels of the connected strokes that are at or next to these pixels."""
    from scipy import ndimage

    label, _ = ndimage.label(walls, np.ones((3, 3), dtype=bool))
    sides = [0, *(max(part.stop - part.start for part in box) for box in ndimage.find_objects(label))]
    return np.asarray(ndimage.maximum_filter(np.array(sides, dtype=np.float64)[label], size=3)[row, column])


def _find_candidates(walls: Bools, outside: Bools, ends: Floats, frame: Frame) -> Floats:
    """The lines (m, 2, 2) from ends at the outside to other such ends, or to the next stroke."""
    from scipy import ndimage

    place = np.floor((ends[:, 0] - (frame.x, frame.y)) / frame.pixel).astype(np.int64)
    column, row = np.clip(place, 0, np.array(walls.shape[::-1]) - 1).T
    open_there = ndimage.binary_dilation(outside, np.ones((3, 3), dtype=bool), border_value=1)[row, column]
    longest = np.minimum(LONGEST * max(walls.shape), _stroke_extents(walls, row, column))[open_there]
    on_grid = (ends[open_there] - [(frame.x, frame.y), (0.0, 0.0)]) / frame.pixel
    first = slice(_MOST_BRIDGES)
    to_strokes = _lines_to_next_stroke(walls, on_grid[first], longest[first])
    to_ends = _lines_between_ends(ends[open_there], longest * frame.pixel)
    # Of two equivalent lines the later one is kept, which is between two ends.
    return np.concatenate([to_strokes * frame.pixel + (frame.x, frame.y), to_ends])


def _lines_between_ends(ends: Floats, longest: Floats) -> Floats:
    """The straight lines (m, 2, 2) from each end to the ends near and ahead of it, each once."""
    from scipy.spatial import KDTree

    if len(ends) < 2:
        return np.empty((0, 2, 2))
    point, out = ends[:, 0], ends[:, 1]
    distance, neighbour = KDTree(point).query(
        point, k=1 + min(_NEAREST, len(ends) - 1), distance_upper_bound=longest.max()
    )
    one, place = np.nonzero(np.isfinite(distance))
    two = neighbour[one, place]
    pairs = np.unique(np.sort(np.stack([one, two], axis=1), axis=1)[one != two], axis=0)
    line = np.diff(point[pairs], axis=1)
    far = vector_length(*line[:, 0].T)
    way = out[pairs] * np.array([1.0, -1.0])[:, None]
    length = vector_length(*np.moveaxis(way, -1, 0)) * far[:, None]
    cosine = np.sort((way * line).sum(axis=-1) / np.maximum(length, np.finfo(float).tiny), axis=1)
    ahead = (cosine[:, 0] >= ASIDE) & (cosine[:, 1] >= AHEAD) & (far <= longest[pairs].min(axis=1))
    shortest = np.argsort(far[ahead], kind="stable")[:_MOST_BRIDGES]
    return np.asarray(point[pairs[ahead][np.sort(shortest)]])


def _lines_to_next_stroke(walls: Bools, ends: Floats, longest: Floats) -> Floats:
    """The straight continuations (m, 2, 2) of strokes up to another stroke, all in pixels."""
    point, out = ends[:, 0], ends[:, 1]
    unit = out / np.maximum(vector_length(*out.T), np.finfo(float).tiny)[:, None]
    step = np.arange(0.0, max(longest.max(initial=0.0), 1.0), 0.5)
    way = point[:, None] + step[:, None] * unit[:, None]
    column, row = np.clip(np.floor(way).astype(np.int64), 0, np.array(walls.shape[::-1]) - 1).transpose(
        2, 0, 1
    )
    stroke = walls[row, column]
    left = np.cumsum(~stroke, axis=1) > 0  # beyond the pixels of the stroke itself
    meets = stroke & left & (step <= longest[:, None])
    ahead = meets.any(axis=1)
    met = way[np.arange(len(way)), np.argmax(meets, axis=1)]
    return np.asarray(np.stack([point, met], axis=1)[ahead])


def _draw_bridges(walls: Bools, pixels: tuple[Indices, Indices, Indices], bridges: Indices) -> Bools:
    """The walls and the pixels (bridge, row, column) of these bridges."""
    bridge, row, column = pixels
    drawn = np.isin(bridge, bridges)
    closed = walls.copy()
    closed[row[drawn], column[drawn]] = True
    return closed


def _find_rooms(walls: Bools, outside: Bools, row: Indices, column: Indices) -> tuple[Bools, Bools]:
    """The room, as wide as its gaps, that bridges at these pixels close off, and their pixels in the gaps."""
    from scipy import ndimage

    drawn = walls.copy()
    drawn[row, column] = True
    region, eight = enclosed_region(drawn), np.ones((3, 3), dtype=bool)
    mouths = drawn & ~walls & ndimage.binary_dilation(~region, eight, border_value=1)
    gained = region & outside & ~mouths
    label, count = ndimage.label(gained)
    row, column = np.nonzero(mouths)
    near = np.pad(label, 1)
    room = np.sort([near[row + down, column + right] for down in range(3) for right in range(3)], axis=0)
    room[1:][np.diff(room, axis=0) == 0] = 0  # each pixel once per room
    mouth = np.bincount(room.ravel(), minlength=count + 1)
    wide = np.bincount(label.ravel(), minlength=count + 1) >= np.maximum(4, (WIDER * mouth) ** 2)
    wide[0] = False
    return wide[label], mouths


def _choose_bridges(
    walls: Bools, rooms: Bools, mouths: Bools, pixels: tuple[Indices, Indices, Indices]
) -> Indices:
    """The numbers of few bridges that enclose these rooms, preferring bridges near the outside."""
    from scipy import ndimage

    bridge, row, column = pixels
    count = int(bridge.max()) + 1
    free = ~walls[row, column]
    beside = ndimage.binary_dilation(rooms, np.ones((3, 3), dtype=bool)) & mouths
    outer = np.bincount(bridge[free], mouths[row, column][free], count)
    share = outer / np.maximum(np.bincount(bridge[free], minlength=count), 1)
    chosen = np.unique(bridge[beside[row, column]])
    for one in chosen[np.argsort(share[chosen], kind="stable")][:_MOST_TRIED]:
        fewer = chosen[chosen != one]
        if not (rooms & ~enclosed_region(_draw_bridges(walls, pixels, fewer))).any():
            chosen = fewer
    return chosen
