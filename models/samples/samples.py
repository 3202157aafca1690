"""All built-in samples by name: sketches and surfaces (models/sketch/samples.py), and meshes."""

from __future__ import annotations

from dataclasses import replace

from ..arguments import check_choice
from ..errors import InputError
from ..instance.instance import SKEW_WEIGHT, STROKE_WEIGHT, Gauge, Instance
from ..mesh.read import mesh_sample
from ..mesh.shapes import MESHES
from ..sketch.read import Silhouette
from ..sketch.samples import SAMPLES, Sample, drawn_sample


def samples() -> list[Sample]:
    """Names, kinds and descriptions of the built-in samples: drawings, surfaces, meshes."""
    return [*SAMPLES.values(), *(Sample(name, "mesh", text) for name, (text, _) in MESHES.items())]


def sample(
    sample_name: str,
    size: int | None = None,
    *,
    name: str = "",
    gauge: Gauge = "strokes",
    stroke_weight: float = STROKE_WEIGHT,
    skew_weight: float = SKEW_WEIGHT,
    silhouette: Silhouette = "none",
) -> Instance:
    """Instance of a built-in sample.

    Parameters
    ----------
    sample_name
        Name of a sample; `crossfield list` lists them.
    size
        Pixels on the longer side of the grid, 1 to 4096; 24 by default. A mesh has none.
    name
        Name of the instance, and so of its files; by default that of the sample.
    gauge
        Window of alpha, as in `Instance`.
    stroke_weight, skew_weight
        Weights that mean the same on every grid, as in `Instance.with_weights`.
    silhouette
        `outer` or `none`, as in `read_sketch`; only for drawn samples.

    Returns
    -------
    Instance
        The instance. `analytic` also returns the exact answer of a computed sample.

    Raises
    ------
    InputError
        For an unknown name, and for a size out of range.
    InstanceError
        For a weight out of range, or a name that is not allowed.

    """
    if sample_name in MESHES:
        if size is not None or silhouette != "none":
            raise InputError(f"{sample_name} is a mesh with its own faces; leave size and silhouette out")
        instance = mesh_sample(sample_name, gauge, stroke_weight)
    else:
        check_choice("sample", sample_name, [*SAMPLES, *MESHES])
        weights = {"stroke_weight": stroke_weight, "skew_weight": skew_weight}
        instance = drawn_sample(sample_name, size, gauge=gauge, silhouette=silhouette, **weights)
    return replace(instance, name=name or sample_name)
