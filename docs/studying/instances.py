"""The instances of the study, reproducible from the samples and from seeds.

whole NAME    the sample, its longer side as many pixels as the rung
crop NAME     the square of the rung's size with most stroke pixels in the sample of twice that size, 24
              at least; turned by a quarter for every second of SHAPES
lines SEED    a full square with straight strokes at random
noise SEED    a full square, half of its pixels with a stroke in a random direction
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Final

import crossfield as cf
import numpy as np
from crossfield.models.evaluation.hidden import HiddenCurve, hidden_curves
from crossfield.models.instance.instance import Instance
from crossfield.models.sketch.samples import SAMPLES
from crossfield.models.sketch.tracing import curves_of

SHAPES: Final = (
    "cylinder_bend", "mouse", "bottle", "saddle", "skew", "singular", "ring",
    "tilted_cylinder", "torus_patch", "wave_sheet",
)  # fmt: skip
"""The samples of the rungs. They are named here, because rows refer to these, whatever samples are added."""
RANDOM: Final = 5  # instances of each random kind on a rung
FEWEST: Final = 3  # stroke pixels of a whole sample on a rung
SMALLEST: Final = 24  # size of the sample of a crop


@cache
def rung(size: int) -> tuple[str, ...]:
    """The names of the 30 instances of a size; lines replace samples with too few strokes left."""
    names = [f"whole {name}" for name in SHAPES if _is_there(name, size)]
    names += [f"crop {name}" for name in SHAPES]
    missing = len(SHAPES) - sum(name.startswith("whole") for name in names)
    for seed in range(RANDOM):
        names += [f"lines {seed}", f"noise {seed}"]
    return (*names, *(f"lines {RANDOM + seed}" for seed in range(missing)))


def _is_there(name: str, size: int) -> bool:
    try:
        return len(cf.sample(name, size).theta) >= FEWEST
    except cf.CrossfieldError:  # the outline leaves no room on so coarse a grid
        return False


@lru_cache(maxsize=8)
def made(name: str, size: int) -> Instance:
    """The instance of that name on a rung, with the coefficients of the paper, 1 and 1e-6."""
    kind, _, what = name.partition(" ")
    found = {"whole": cf.sample, "crop": crop, "lines": lines, "noise": noise}[kind](
        what if kind in {"whole", "crop"} else int(what), size
    )
    label = f"{kind}_{what}_{size}"
    coefficients = {name: getattr(Instance, name) for name in ("stroke_coefficient", "skew_coefficient")}
    return replace(found, name=label, **coefficients)


def crop(name: str, size: int) -> Instance:
    """The square of a sample with most stroke pixels, the first of equal ones."""
    whole = cf.sample(name, max(SMALLEST, 2 * size))
    height, width = whole.mask.shape
    strokes = np.zeros(whole.mask.shape)
    strokes[tuple(whole.stroke_pixels.T)] = 1
    total = np.pad(strokes.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    high, wide = min(size, height), min(size, width)
    count = total[high:, wide:] - total[:-high, wide:] - total[high:, :-wide] + total[:-high, :-wide]
    row, column = np.unravel_index(int(count.argmax()), count.shape)
    inside = (slice(row, row + high), slice(column, column + wide))
    at = whole.stroke_pixels - [row, column]
    kept = ((at >= 0) & (at < [high, wide])).all(axis=1)
    found = Instance(f"crop_{name}", whole.mask[inside], at[kept], whole.theta[kept], whole.w[kept])
    return found.turned() if SHAPES.index(name) % 2 else found


def lines(seed: int, size: int) -> Instance:
    """Straight strokes right across a full square, one for every third of its side and one more."""
    rng = np.random.default_rng([1, seed, size])
    theta = np.full((size, size), np.nan)
    for _ in range(size // 3 + 1):
        middle, angle = rng.uniform(0, size, 2), rng.uniform(0, np.pi)
        way = np.linspace(-1.5 * size, 1.5 * size, 12 * size)
        row = np.floor(middle[0] - way * np.sin(angle)).astype(int)
        column = np.floor(middle[1] + way * np.cos(angle)).astype(int)
        within = (row >= 0) & (row < size) & (column >= 0) & (column < size)
        theta[row[within], column[within]] = angle
    pixels = np.argwhere(~np.isnan(theta))
    found = theta[tuple(pixels.T)]
    return Instance(f"lines_{seed}", np.ones((size, size), bool), pixels, found, np.ones(len(found)))


def noise(seed: int, size: int) -> Instance:
    """Random directions on half of the pixels of a full square."""
    rng = np.random.default_rng([2, seed, size])
    pixels = np.argwhere(rng.random((size, size)) < 0.5)
    theta = rng.uniform(0, np.pi, len(pixels))
    return Instance(f"noise_{seed}", np.ones((size, size), bool), pixels, theta, np.ones(len(theta)))


# Drawings and surfaces


def drawings(folder: Path | None) -> list[str]:
    """The drawn samples, and the names of the drawings in a folder."""
    own = [name for name, entry in SAMPLES.items() if entry.kind == "sketch"]
    if folder is None:
        return own
    files = sorted(each for each in folder.iterdir() if each.suffix in {".svg", ".png", ".scap"})
    return own + [each.name for each in files if not each.stem.endswith("_mask")]


def surfaces() -> list[str]:
    """The samples whose true field is known."""
    return [name for name, entry in SAMPLES.items() if entry.kind == "analytic"]


@lru_cache(maxsize=8)
def drawing(name: str, size: int, folder: Path | None = None) -> Instance:
    """A drawing at a size, with the default weights."""
    return cf.sample(name, size) if name in SAMPLES else cf.read_sketch(_file(name, folder), size=size)


def _file(name: str, folder: Path | None) -> str | Path:
    return name if folder is None or name in SAMPLES else folder / name


@lru_cache(maxsize=8)
def curves(name: str, size: int, most: int, folder: Path | None = None) -> list[HiddenCurve]:
    """The longest curves of a drawing that can be hidden."""
    instance = drawing(name, size, folder)
    return hidden_curves(instance, curves_of(instance, _file(name, folder)), most)


def noisy(instance: Instance, degrees: float, seed: int) -> Instance:
    """The instance with an independent error of that standard deviation on each stroke pixel."""
    error = np.random.default_rng(seed).standard_normal(len(instance.theta))
    return replace(instance, theta=instance.theta + np.radians(degrees) * error)
