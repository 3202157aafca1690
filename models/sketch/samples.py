"""The built-in sketches and surfaces: drawn for crossfield, or computed exactly."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from typing import Final, Literal, get_args

from ..arguments import check_choice
from ..errors import InputError
from ..instance.instance import Gauge, Instance
from .read import DEFAULT_SIZE, Silhouette, check_size, instance_of_drawing
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


def drawn_sample(
    name: str,
    size: int | None,
    *,
    gauge: Gauge,
    stroke_weight: float,
    skew_weight: float,
    silhouette: Silhouette = "none",
) -> Instance:
    """Instance of a built-in sketch or surface, as `sample` describes it. Raises InputError."""
    size = DEFAULT_SIZE if size is None else size
    check_size(size)
    check_choice("silhouette", silhouette, get_args(Silhouette))
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
    if name in _COMPUTED:
        raise InputError(f"sample {name!r} is computed, not drawn; choose one of {', '.join(_DRAWN)}")
    check_choice("drawn sample", name, _DRAWN)
    return files(__package__).joinpath("drawings", f"{name}.svg").read_text("utf-8")
