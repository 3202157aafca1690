"""Instances of recipes, from samples, drawings, random strokes and meshes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

from ....models.errors import CrossfieldError, InputError, NoStrokeError
from ....models.instance.instance import Gauge, Instance
from ....models.samples.samples import sample
from ....models.sketch.drawing_file import parse_drawing
from ....models.sketch.random_strokes import RAGGED_SHARE, random_instance
from ....models.sketch.read import instance_of_drawing, read_mask
from ....models.sketch.samples import SAMPLES
from .recipe import InstanceRecipe


def make_instance(recipe: InstanceRecipe) -> Instance:
    """Return the instance of a recipe. Raises InputError; NoStrokeError if its size leaves no strokes."""
    sketch = recipe.sketch
    try:
        instance = replace(_draw_instance(recipe), name=recipe.name)
        if sketch.kind != "mesh":
            # The coefficients of the paper, 1 and 1e-6, on every grid, so that published results apply.
            instance = replace(
                instance,
                stroke_coefficient=Instance.stroke_coefficient,
                skew_coefficient=Instance.skew_coefficient,
            )
        return instance.with_weights(stroke_weight=sketch.stroke_weight, skew_weight=sketch.skew_weight)
    except NoStrokeError as error:
        raise NoStrokeError(f"{recipe.name}: {error}") from error
    except CrossfieldError as error:
        raise InputError(f"{recipe.name}: {error}") from error


def kind_of(recipe: InstanceRecipe) -> str:
    """Return `sketch`, `analytic`, `file`, `random` or `mesh`."""
    kind = recipe.sketch.kind
    return SAMPLES[recipe.sketch.what].kind if kind == "sample" else kind


def _draw_instance(recipe: InstanceRecipe) -> Instance:
    sketch, size, gauge = recipe.sketch, recipe.size, cast("Gauge", recipe.gauge)
    if sketch.kind == "mesh":
        return sample(sketch.what, gauge=gauge)
    if sketch.kind == "sample":
        return sample(sketch.what, size, gauge=gauge)
    if sketch.kind == "file":
        drawing = parse_drawing(sketch.drawing, Path(sketch.what).suffix, size)
        white = read_mask(sketch.mask, drawing) if sketch.mask else None
        return instance_of_drawing(
            drawing, size, white=white, name=recipe.name, source=sketch.what, gauge=gauge
        )
    assert recipe.seed is not None  # as the schema of specifications demands
    mask_share = RAGGED_SHARE if sketch.what == "ragged" else 1.0
    return random_instance(recipe.seed, size=size, share=sketch.share, mask_share=mask_share, gauge=gauge)
