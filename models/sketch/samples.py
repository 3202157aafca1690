"""The built-in sketches and surfaces: drawn for crossfield, or computed exactly."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from typing import Final, Literal

from ..arguments import check_choice
from ..errors import InputError
from ..instance.instance import SKEW_WEIGHT, STROKE_WEIGHT, Gauge, Instance
from ..mesh.read import mesh_sample
from ..mesh.shapes import MESHES
from .read import DEFAULT_SIZE, Silhouette, check_silhouette, check_size, instance_of_drawing
from .surfaces import analytic
from .svg import read_svg

SampleKind = Literal["sketch", "analytic", "mesh"]


@dataclass(frozen=True)
class Sample:
    """A built-in sample: name, whether a drawing, a surface (`analytic`) or a mesh, one line."""

    name: str
    kind: SampleKind
    description: str


_DRAWN: Final = {
    "cylinder_bend": "a pipe with a bend; red curvature lines, black silhouette",
    "mouse": "a computer mouse with cross-section lines, all in one colour",
    "bottle": "a bottle, a surface of revolution; red curvature lines, black silhouette",
    "saddle": "a saddle bounded and crossed by its curvature lines, all in one colour",
    "skew": "a tilted flat sheet; two straight families that cross at 65 degrees, constant answer",
    "singular": "a rounded cube seen on its corner; red lines turn round a singularity of index +1/4",
    "ring": "a torus with its hole; red curvature lines, black silhouette",
}
_COMPUTED: Final = {
    "tilted_cylinder": "half a cylinder, tilted; exact answer, strokes on a third of the pixels",
    "torus_patch": "a quarter of a torus; exact answer, strokes on a fifth of the pixels",
    "wave_sheet": "a wavy sheet; exact answer, strokes on a fifth of the pixels",
    "cone": "half a truncated cone; exact answer, strokes on a quarter of the pixels",
    "vase": "half a vase; exact answer, strokes on a quarter of the pixels",
    "spheroid": "half a spheroid; exact answer, strokes on a quarter of the pixels",
    "ellipsoid": "an ellipsoid with three different axes; exact answer, strokes on a quarter of the pixels",
}
SAMPLES: Final[dict[str, Sample]] = {
    **{name: Sample(name, "sketch", text) for name, text in _DRAWN.items()},
    **{name: Sample(name, "analytic", text) for name, text in _COMPUTED.items()},
}


def samples() -> list[Sample]:
    """Names, kinds and descriptions of the built-in samples: drawings, surfaces, meshes."""
    return [*SAMPLES.values(), *(Sample(name, "mesh", text) for name, (text, _) in MESHES.items())]


def sample(
    name: str,
    size: int | None = None,
    *,
    gauge: Gauge = "strokes",
    stroke_weight: float = STROKE_WEIGHT,
    skew_weight: float = SKEW_WEIGHT,
    silhouette: Silhouette = "none",
) -> Instance:
    """Instance of a built-in sample.

    Parameters
    ----------
    name
        A name in `samples()`.
    size
        Pixels on the longer side of the grid, 1 to 4096; 24 by default. A mesh has none.
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
        For a weight out of range.

    """
    if name in MESHES:
        if size is not None or silhouette != "none":
            raise InputError(f"{name} is a mesh with its own faces; leave size and silhouette out")
        return mesh_sample(name, gauge, stroke_weight)
    size = DEFAULT_SIZE if size is None else size
    check_size(size)
    check_silhouette(silhouette)
    check_choice("sample", name, [*SAMPLES, *MESHES])
    if SAMPLES[name].kind == "analytic":
        if silhouette != "none":
            raise InputError(f"{name} is computed, not drawn; choose the silhouette none")
        return analytic(
            name, size, gauge=gauge, stroke_weight=stroke_weight, skew_weight=skew_weight
        ).instance
    drawing = read_svg(sample_svg(name).encode())
    instance = instance_of_drawing(
        drawing, size, name=name, source=f"{name}.svg", gauge=gauge, silhouette=silhouette
    )
    return instance.with_weights(stroke_weight=stroke_weight, skew_weight=skew_weight)


def sample_svg(name: str) -> str:
    """The SVG text of a built-in sketch. Raises InputError for an unknown name and for a computed sample."""
    check_choice("drawn sample", name, _DRAWN)
    return files(__package__).joinpath("drawings", f"{name}.svg").read_text("utf-8")
