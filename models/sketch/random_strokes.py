"""Random instances by size and seed: random pixels with unrelated directions.

The random sketches of instance libraries come from here too, so `random_instance` with the same values makes
the same strokes.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..errors import InputError, NoStrokeError
from ..instance.instance import SKEW_WEIGHT, STROKE_WEIGHT, Gauge, Instance
from ..memory import check_memory
from .cover import LEAST_WEIGHT
from .outline import largest_part
from .read import DEFAULT_SIZE, check_size

STROKE_SHARE: Final = 0.2  # of the pixels
RAGGED_SHARE: Final = 0.75  # of the square, for the ragged masks of libraries
MOST_SEED: Final = 2**63 - 1


def random_instance(
    seed: int,
    *,
    size: int = DEFAULT_SIZE,
    share: float = STROKE_SHARE,
    mask_share: float = 1.0,
    gauge: Gauge = "strokes",
    name: str | None = None,
    stroke_weight: float = STROKE_WEIGHT,
    skew_weight: float = SKEW_WEIGHT,
) -> Instance:
    """Random instance of a size and a seed, by NumPy's PCG64: the same on every processor.

    Drawn in this order: the mask, the strokes. The pixels are shuffled and the first ones are strokes, with
    theta uniform in [0, pi) and w uniform in [0.1, 1].

    Parameters
    ----------
    seed
        Seed, 0 to 2^63 - 1.
    size
        Pixels on each side of the square grid, 1 to 4096.
    share
        Share of the pixels in the mask that are strokes, above 0 and at most 1; at least one pixel.
    mask_share
        Probability of each pixel to be in the mask, above 0 and at most 1. The largest connected part is
        kept.
    gauge
        Window of alpha, as in `Instance`.
    name
        Name of the instance; by default made from size and seed.
    stroke_weight, skew_weight
        Weights that mean the same on every grid, as in `Instance.with_weights`.

    Raises
    ------
    InputError
        For an option out of range.
    NoStrokeError
        If the mask has no pixel.
    InstanceError
        For a name that is not allowed, and for a weight out of range.

    """
    check_size(size)
    _check_options(seed, share, mask_share)
    check_memory(size * size, "read")
    rng = np.random.Generator(np.random.PCG64(seed))
    mask = np.ones((size, size), dtype=bool)
    if mask_share < 1:
        mask = largest_part(rng.random(mask.shape) < mask_share)
        if not mask.any():
            raise NoStrokeError("the random mask has no pixel; choose a larger mask_share or another seed")
    count = max(1, round(share * int(mask.sum())))
    inside = np.argwhere(mask).astype(np.int32)
    pixels = inside[np.sort(rng.permutation(len(inside))[:count])]
    theta, w = rng.uniform(0.0, np.pi, count), rng.uniform(LEAST_WEIGHT, 1.0, count)
    return Instance.on_pixels(
        name=name or f"rand_n{size:03}_s{seed}",
        mask=mask,
        stroke_pixels=pixels,
        theta=theta,
        w=w,
        gauge=gauge,
        source=_describe_source(seed, share, mask_share),
    ).with_weights(stroke_weight=stroke_weight, skew_weight=skew_weight)


def _check_options(seed: int, share: float, mask_share: float) -> None:
    """Raise InputError that names the option out of range."""
    if not 0 <= seed <= MOST_SEED:
        raise InputError(f"seed is {seed}; choose 0 to {MOST_SEED}")
    for name, value in (("share", share), ("mask_share", mask_share)):
        if not 0 < value <= 1:
            raise InputError(f"{name} is {value}; choose a number above 0 and at most 1")


def _describe_source(seed: int, share: float, mask_share: float) -> str:
    """The source of the instance: shape and seed, then every value that is not the library's default."""
    shape, usual = ("full", 1.0) if mask_share == 1 else ("ragged", RAGGED_SHARE)
    values = (("share", float(share), STROKE_SHARE), ("mask_share", float(mask_share), usual))
    changed = [f"{name} {value}" for name, value, default in values if value != default]
    return ", ".join([f"random strokes on a {shape} mask, seed {seed}", *changed])
