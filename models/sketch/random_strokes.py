"""Random instances by size and seed: random pixels with directions, or pixels along random curves.

The random sketches of instance libraries come from here too, so `random_instance` with the same values makes
the same strokes.
"""

from __future__ import annotations

from typing import Final, Literal, get_args

import numpy as np

from ..arguments import check_arguments
from ..errors import InputError, NoStrokeError
from ..instance.angles import line_of
from ..instance.domain import Bools, Floats, Ints
from ..instance.instance import SKEW_WEIGHT, STROKE_WEIGHT, Gauge, Instance
from ..memory import check_memory
from .cover import LEAST_WEIGHT, Cover, Frame
from .curves import Curves, lines_as_cubics
from .outline import largest_part
from .read import DEFAULT_SIZE, check_size

Strokes = Literal["pixels", "straight", "curved"]
STROKES: Final[tuple[Strokes, ...]] = get_args(Strokes)

STROKE_SHARE: Final = 0.2  # of the pixels
RAGGED_SHARE: Final = 0.75  # of the square, for the ragged masks of libraries
MOST_SEED: Final = 2**63 - 1
MOST_NOISE: Final = 10.0  # radians: many turns, after which directions are uniform
_BEND: Final = 0.3  # sides of the grid by which inner control points of a curve leave its chord
_CURVES_PER_PIXEL: Final = 4  # of the side: later curves mostly cross earlier ones, which removes directions


@check_arguments
def random_instance(
    seed: int,
    *,
    size: int = DEFAULT_SIZE,
    share: float = STROKE_SHARE,
    mask_share: float = 1.0,
    strokes: Strokes = "pixels",
    noise: float = 0.0,
    gauge: Gauge = "strokes",
    name: str | None = None,
    stroke_weight: float = STROKE_WEIGHT,
    skew_weight: float = SKEW_WEIGHT,
) -> Instance:
    """Random instance of a size and a seed, by NumPy's PCG64: the same on every processor.

    Drawn in this order: the mask, the strokes, the noise. With `pixels`, the pixels are shuffled and the
    first ones are strokes, with theta uniform in [0, pi) and w uniform in [0.1, 1].

    Parameters
    ----------
    seed
        Seed, 0 to 2^63 - 1.
    size
        Pixels on each side of the square grid, 1 to 4096.
    share
        Share of the pixels in the mask that are strokes, above 0 and at most 1; at least one pixel. Curves
        are added until they cover this share, at most 4 `size` of them.
    mask_share
        Probability of each pixel to be in the mask, above 0 and at most 1. The largest connected part is
        kept.
    strokes
        `pixels` for separate pixels with unrelated directions, `straight` or `curved` for pixels along random
        lines or cubic curves, with their directions and w as `read_sketch` computes them.
    noise
        Standard deviation of normal errors of theta in radians, 0 to 10; only along lines and curves.
    gauge
        Window of alpha, as in `Instance`.
    name
        Name of the instance; by default made from size and seed.
    stroke_weight, skew_weight
        Weights that mean the same on every grid, as in `Instance.with_weights`.

    Returns
    -------
    Instance
        The instance.

    Raises
    ------
    InputError
        For an option out of range.
    NoStrokeError
        If the mask has no pixel, or no curve crosses it.
    InstanceError
        For a name that is not allowed, and for a weight out of range.

    """
    check_size(size)
    _check_options(seed, share, mask_share, strokes, noise)
    check_memory(size * size)
    rng = np.random.Generator(np.random.PCG64(seed))
    mask = np.ones((size, size), dtype=bool)
    if mask_share < 1:
        mask = largest_part(rng.random(mask.shape) < mask_share)
        if not mask.any():
            raise NoStrokeError("the random mask has no pixel; choose a larger mask_share or another seed")
    count = max(1, round(share * int(mask.sum())))
    pixels, theta, w = (
        _draw_pixels(rng, mask, count)
        if strokes == "pixels"
        else _draw_curves(rng, mask, count, bend=_BEND if strokes == "curved" else 0.0)
    )
    if noise > 0:
        theta = theta + noise * rng.standard_normal(len(theta))
    return Instance.on_pixels(
        name=name or f"rand_n{size:03}_s{seed}",
        mask=mask,
        stroke_pixels=pixels,
        theta=theta,
        w=w,
        gauge=gauge,
        source=_describe_source(seed, share, mask_share, strokes, noise),
    ).with_weights(stroke_weight=stroke_weight, skew_weight=skew_weight)


def _check_options(seed: int, share: float, mask_share: float, strokes: str, noise: float) -> None:
    """Raise InputError that names the option out of range."""
    if not 0 <= seed <= MOST_SEED:
        raise InputError(f"seed is {seed}; choose 0 to {MOST_SEED}")
    for name, value in (("share", share), ("mask_share", mask_share)):
        if not 0 < value <= 1:
            raise InputError(f"{name} is {value}; choose a number above 0 and at most 1")
    if strokes not in STROKES:
        raise InputError(f"there are no strokes {strokes!r}; choose one of {', '.join(STROKES)}")
    if not 0 <= noise <= MOST_NOISE:
        raise InputError(f"noise is {noise}; choose 0 to {MOST_NOISE:g} radians")
    if noise > 0 and strokes == "pixels":
        raise InputError("noise needs strokes straight or curved: directions of pixels are uniform already")


def _describe_source(seed: int, share: float, mask_share: float, strokes: str, noise: float) -> str:
    """The source of the instance: shape and seed, then every value that is not the library's default."""
    shape, usual = ("full", 1.0) if mask_share == 1 else ("ragged", RAGGED_SHARE)
    changed = [
        f"{name} {value}"
        for name, value, default in (
            ("strokes", strokes, "pixels"),
            ("share", float(share), STROKE_SHARE),
            ("mask_share", float(mask_share), usual),
            ("noise", float(noise), 0.0),
        )
        if value != default
    ]
    return ", ".join([f"random strokes on a {shape} mask, seed {seed}", *changed])


def _draw_pixels(rng: np.random.Generator, mask: Bools, count: int) -> tuple[Ints, Floats, Floats]:
    """Pixels (s, 2), theta (s,) and w (s,) of strokes of one pixel each."""
    inside = np.argwhere(mask)
    chosen = np.sort(rng.permutation(len(inside))[:count])
    theta = rng.uniform(0.0, np.pi, count)
    return inside[chosen].astype(np.int32), theta, rng.uniform(LEAST_WEIGHT, 1.0, count)


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
