"""Instances of recipes: samples, drawings and random strokes."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Final, cast

import numpy as np

from ....models.errors import CrossfieldError, InputError, NoStrokeError
from ....models.instance.instance import Gauge, Instance
from ....models.sketch.outline import largest_part
from ....models.sketch.read import LEAST_WEIGHT, instance_of
from ....models.sketch.samples import SAMPLES, sample
from .recipe import InstanceRecipe

STROKE_SHARE: Final = 0.2  # of the pixels of a random instance
RAGGED_SHARE: Final = 0.75  # of the square, for a ragged mask; its largest connected part is kept


def instance_from(recipe: InstanceRecipe) -> Instance:
    """Return the instance of a recipe. Raises InputError; NoStrokeError if its size leaves no strokes."""
    make = {"sample": _of_sample, "file": _of_file, "random": random_instance}[recipe.sketch.kind]
    try:
        # The coefficients of the paper, 1 and 1e-6, on every grid, so that published results apply.
        of_paper = {name: getattr(Instance, name) for name in ("stroke_coefficient", "skew_coefficient")}
        return replace(make(recipe), name=recipe.name, **of_paper)
    except NoStrokeError as error:
        raise NoStrokeError(f"{recipe.name}: {error}") from error
    except CrossfieldError as error:
        raise InputError(f"{recipe.name}: {error}") from error


def kind_of(recipe: InstanceRecipe) -> str:
    """Return `sketch`, `analytic`, `file` or `random`."""
    kind = recipe.sketch.kind
    return SAMPLES[recipe.sketch.what].kind if kind == "sample" else kind


def _of_sample(recipe: InstanceRecipe) -> Instance:
    return sample(recipe.sketch.what, recipe.size, gauge=cast("Gauge", recipe.gauge))


def _of_file(recipe: InstanceRecipe) -> Instance:
    sketch = recipe.sketch
    with tempfile.TemporaryDirectory(prefix="crossfield-") as folder:
        mask = Path(folder) / f"mask{sketch.mask_suffix}"
        mask.write_bytes(sketch.mask)
        return instance_of(
            sketch.drawing,
            size=recipe.size,
            name=recipe.name,
            source=sketch.what,
            mask=mask if sketch.mask else None,
            gauge=cast("Gauge", recipe.gauge),
        )


def random_instance(recipe: InstanceRecipe) -> Instance:
    """Return random strokes of a size and a seed, by NumPy's PCG64.

    Drawn in this order: a ragged mask, the order of the pixels (the first fifth, at least one, are strokes),
    theta uniform in [0, pi), w uniform in [0.1, 1].
    """
    rng = np.random.Generator(np.random.PCG64(recipe.seed))
    mask = np.ones((recipe.size, recipe.size), dtype=bool)
    if recipe.sketch.what == "ragged":
        mask = largest_part(rng.random(mask.shape) < RAGGED_SHARE)
    inside = np.argwhere(mask)
    count = max(1, round(STROKE_SHARE * len(inside)))
    chosen = np.sort(rng.permutation(len(inside))[:count])
    return Instance(
        name=recipe.name,
        mask=mask,
        stroke_pixels=inside[chosen].astype(np.int32),
        theta=rng.uniform(0.0, np.pi, count),
        w=rng.uniform(LEAST_WEIGHT, 1.0, count),
        gauge=cast("Gauge", recipe.gauge),
        source=f"random strokes on a {recipe.sketch.what} mask, seed {recipe.seed}",
    )
