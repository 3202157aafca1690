"""The curve of a sketch that each stroke pixel belongs to; not part of the instance.

In a vector sketch a curve is an unbroken run of a path (SVG), a cluster of strokes (.scap), or a stroke
(.curves), together with shorter ones that redraw it. Without a vector sketch it is a chain of stroke pixels
that continue in each other's direction. A chain ends at a corner, and may end at a crossing.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Final

import numpy as np
from crossfield.models.errors import InputError, naming
from crossfield.models.instance.angles import arctangent, line_difference
from crossfield.models.instance.domain import Ints
from crossfield.models.instance.instance import Instance
from crossfield.models.sketch.cover import LEAST_WEIGHT, Frame, Indices, curve_pixels
from crossfield.models.sketch.curves import Curves
from crossfield.models.sketch.drawing_file import parse_drawing, read_file
from crossfield.models.sketch.read import DEFAULT_SIZE
from crossfield.models.sketch.samples import SAMPLES, sample_svg
from crossfield.models.sketch.svg import read_svg
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

REACH: Final = 2  # rows and columns from a pixel of a chain to the next, across crossings without a direction
ASIDE: Final = np.radians(27.0)  # greatest angle to the next pixel of a chain; atan(1/2) is less
TURN: Final = np.radians(15.0)  # greatest turn of a chain per pixel, as on a circle of four pixels in radius
REDRAWN: Final = 0.5  # least share of its stroke pixels at which a curve only redraws another one
SEVERAL: Final = -1  # the number of a stroke pixel on several curves
_NONE: Final = -2


def curves_of(instance: Instance, sketch: str | Path | None = None) -> Ints:
    """The number of the only curve of each stroke pixel, int (s,), SEVERAL where more curves pass through it.

    sketch: the file that the instance was read from, or the name of a sample. None, pictures, computed
    samples and instance files record no curves. Raises InputError for another sketch.
    """
    curves = None if sketch is None else _drawn(sketch)
    if curves is None:
        return chains(instance)
    x, y = instance.origin
    frame = Frame(x, y, instance.pixel_size, instance.grid.height, instance.grid.width)
    segments, curve, line = curves.segments(frame)
    owner, row, column = curve_pixels(segments[line], curve[line], frame, LEAST_WEIGHT)
    number = np.full(frame.shape, -1, dtype=np.int64)
    number[tuple(instance.stroke_pixels.T)] = np.arange(len(instance.theta))
    stroke = number[row, column]
    there = stroke >= 0
    only = _only(owner[there], stroke[there], len(instance.theta))
    if (only == _NONE).any():
        raise InputError(
            f"draws nothing at {int((only == _NONE).sum())} stroke pixels of {instance.name}; "
            "give the sketch that the instance was read from",
            file=sketch,
        )
    return only


def _only(owner: Indices, stroke: Indices, count: int) -> Ints:
    """The only curve (s,) at each stroke pixel, SEVERAL, or _NONE, from pairs of curve and stroke pixel."""
    names, curve = np.unique(owner, return_inverse=True)
    through = csr_array((np.ones(len(curve)), (curve, stroke)), shape=(len(names), count))
    single = csr_array(
        (np.ones(len(names)), (_redrawn(through), np.arange(len(names)))), shape=(len(names), len(names))
    )
    merged = (single @ through).tocoo()
    curves_there = np.bincount(merged.col, minlength=count)
    only = np.where(curves_there == 0, _NONE, SEVERAL)
    one = curves_there[merged.col] == 1
    only[merged.col[one]] = names[merged.row[one]]
    return only.astype(np.int32)


def _redrawn(through: csr_array) -> Indices:
    """The curve (c,) that each curve redraws, or itself. through: 1 at its stroke pixels, (c, s)."""
    at_stroke = through.T.tocsr()
    length = np.diff(through.indptr)
    stands_for = np.full(len(length), -1)
    for curve in np.argsort(-length, kind="stable"):
        if stands_for[curve] >= 0:
            continue
        strokes = through.indices[through.indptr[curve] : through.indptr[curve + 1]]
        other, shared = np.unique(at_stroke[strokes].indices, return_counts=True)
        same = (shared > REDRAWN * length[other]) & (stands_for[other] < 0)
        stands_for[other[same]] = curve
    return stands_for


def chains(instance: Instance) -> Ints:
    """The number of the chain that each stroke pixel belongs to, int (s,), numbered from 0."""
    theta, count = instance.theta, len(instance.theta)
    number = np.full(np.add(instance.mask.shape, 2 * REACH), -1, dtype=np.int32)
    row, column = instance.stroke_pixels.T + REACH
    number[row, column] = np.arange(count)
    ends = []
    for down, right in product(range(REACH + 1), range(-REACH, REACH + 1)):
        other = number[row + down, column + right]
        one = np.nonzero((other >= 0) & (down != 0 or right != 0))[0]
        first, second = theta[one], theta[other[one]]
        way = arctangent(np.full(len(one), -float(down)), np.full(len(one), float(right)))
        aside = np.maximum(line_difference(first, way), line_difference(second, way))
        linked = (aside <= ASIDE) & (line_difference(first, second) <= TURN)
        ends.append(np.stack([one[linked], other[one][linked]]))
    first, second = np.concatenate(ends, axis=1)
    links = csr_array((np.ones(len(first)), (first, second)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1].astype(np.int32))


def _drawn(sketch: str | Path) -> Curves | None:
    """The curves of a vector sketch, in a file or a sample; None for other sources."""
    path = Path(sketch)
    if not path.is_file() and str(sketch) in SAMPLES:
        analytic = SAMPLES[str(sketch)].kind == "analytic"
        return None if analytic else read_svg(sample_svg(str(sketch)).encode())
    if path.suffix.lower() in {".json", ".npz"}:
        return None
    with naming(path):
        drawing = parse_drawing(read_file(path), path.suffix, DEFAULT_SIZE)
    return drawing if isinstance(drawing, Curves) else None
