"""Random instances whose strokes are pixels along random lines or curves, by kind, size and seed.

Drawn in this order, by NumPy's PCG64: the mask, the curves, the noise.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from crossfield.models.instance.angles import line_of
from crossfield.models.instance.domain import Bools, Floats, Ints
from crossfield.models.instance.instance import SKEW_WEIGHT, STROKE_WEIGHT, Instance
from crossfield.models.sketch.cover import LEAST_WEIGHT, Cover, Frame
from crossfield.models.sketch.curves import Curves, lines_as_cubics
from crossfield.models.sketch.outline import largest_part

_SHARE: Final = 0.2  # of the pixels in the mask that curves cover, one after the other
_BEND: Final = 0.3  # sides of the grid by which inner control points of a curve leave its chord
_CURVES_PER_PIXEL: Final = 4  # of the side: later curves mostly cross earlier ones, which removes directions


def instance_of_curves(kind: str, size: int, seed: int, mask_share: float, noise: float) -> Instance:
    """The instance with `straight` or `curved` strokes on a ragged mask.

    noise: standard deviation of normal errors of theta in radians.
    """
    rng = np.random.Generator(np.random.PCG64(seed))
    mask = largest_part(rng.random((size, size)) < mask_share)
    count = max(1, round(_SHARE * int(mask.sum())))
    pixels, theta, w = _draw_curves(rng, mask, count, bend=_BEND if kind == "curved" else 0.0)
    theta = theta + noise * rng.standard_normal(len(theta))
    source = f"random strokes on a ragged mask, seed {seed}, strokes {kind}, mask_share {mask_share}"
    name = f"rand_n{size:03}_s{seed}"
    instance = Instance.on_pixels(name, mask, pixels, theta, w, source=f"{source}, noise {noise}")
    return instance.with_weights(stroke_weight=STROKE_WEIGHT, skew_weight=SKEW_WEIGHT)


def _draw_curves(
    rng: np.random.Generator, mask: Bools, count: int, *, bend: float
) -> tuple[Ints, Floats, Floats]:
    """Pixels (s, 2), theta (s,) and w (s,) along random curves until `count` pixels have a direction."""
    size = len(mask)
    frame, total = Frame(0.0, 0.0, 1.0, size, size), np.zeros((3, size, size))
    weight, direction = np.zeros(mask.shape), np.zeros((*mask.shape, 2))
    for _ in range(_CURVES_PER_PIXEL * size):
        cover = _cover_by_cubic(_draw_curve(rng, size, bend), frame)
        total += np.concatenate([cover.amount[None], np.moveaxis(cover.direction, -1, 0) * cover.amount])
        amount = total[0]
        direction = np.moveaxis(total[1:] / np.where(amount > 0, amount, 1.0), 0, -1)
        weight = np.where(mask, Cover(amount, direction).weight, 0.0)
        if (weight >= LEAST_WEIGHT).sum() >= count:
            break
    stroke = weight >= LEAST_WEIGHT
    pixels = np.argwhere(stroke).astype(np.int32)
    return pixels, line_of(direction[stroke]), np.minimum(weight[stroke], 1.0)


def _draw_curve(rng: np.random.Generator, size: int, bend: float) -> Floats:
    """Control points (4, 2) of a random cubic whose ends are in the square; a line if it has no bend."""
    ends = rng.uniform(0.0, size, (2, 2))
    off = rng.uniform(-1.0, 1.0, (2, 2))
    cubic: Floats = lines_as_cubics(ends[:1], ends[1:])[0]
    cubic[1:3] += bend * size * off
    return cubic


def _cover_by_cubic(cubic: Floats, frame: Frame) -> Cover:
    """The cover of the pixels by one cubic."""
    curves = Curves(cubic[None], np.zeros(1, dtype=np.int32), np.zeros(1, dtype=bool), None)
    return curves.covers(frame).lines
