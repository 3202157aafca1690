"""Instances of recipes, from samples, drawings and random strokes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

from ....models.errors import CrossfieldError, InputError, NoStrokeError
from ....models.instance.instance import Gauge, Instance
from ....models.samples.samples import sample
from ....models.sketch.drawing_file import parse_drawing
from ....models.sketch.random_strokes import random_instance
from ....models.sketch.read import instance_of_drawing, read_mask
from ....models.sketch.samples import SAMPLES
from .recipe import InstanceRecipe


def make_instance(recipe: InstanceRecipe) -> Instance:
    """Return the instance of a recipe. Raises InputError; NoStrokeError if its size leaves no strokes."""
    if recipe.sketch.kind == "mesh":
        return replace(sample(recipe.sketch.what, gauge=cast("Gauge", recipe.gauge)), name=recipe.name)
    make = {"sample": _sample_instance, "file": _drawing_instance, "random": _random_instance}[
        recipe.sketch.kind
    ]
    try:
        # The coefficients of the paper, 1 and 1e-6, on every grid, so that published results apply.
        of_paper = {name: getattr(Instance, name) for name in ("stroke_coefficient", "skew_coefficient")}
        return replace(make(recipe), name=recipe.name, **of_paper)
    except NoStrokeError as error:
        raise NoStrokeError(f"{recipe.name}: {error}") from error
    except CrossfieldError as error:
        raise InputError(f"{recipe.name}: {error}") from error


def kind_of(recipe: InstanceRecipe) -> str:
    """Return `sketch`, `analytic`, `file`, `random` or `mesh`."""
    kind = recipe.sketch.kind
    return SAMPLES[recipe.sketch.what].kind if kind == "sample" else kind


def _sample_instance(recipe: InstanceRecipe) -> Instance:
    return sample(recipe.sketch.what, recipe.size, gauge=cast("Gauge", recipe.gauge))


def _drawing_instance(recipe: InstanceRecipe) -> Instance:
    sketch = recipe.sketch
    drawing = parse_drawing(sketch.drawing, Path(sketch.what).suffix, recipe.size)
    white = read_mask(sketch.mask, drawing) if sketch.mask else None
    gauge = cast("Gauge", recipe.gauge)
    return instance_of_drawing(
        drawing, recipe.size, white=white, name=recipe.name, source=sketch.what, gauge=gauge
    )


def _random_instance(recipe: InstanceRecipe) -> Instance:
    assert recipe.seed is not None  # as the schema of specifications demands
    return random_instance(
        recipe.seed,
        size=recipe.size,
        gauge=cast("Gauge", recipe.gauge),
        name=recipe.name,
        **recipe.sketch.drawn,
    )
