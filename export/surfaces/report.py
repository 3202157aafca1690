"""What is said of a surface: how well it fits its crosses, why it may be wrong, and what stays open."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from ...models.instance.grid import Floats
from ...models.surface.surface import Surface
from ..formats.registry import generator

SIGN: Final = (
    "inside or outside: a bump and a hollow have the same crosses; without hints normals point outward at the"
    " border of the mask, and --flip turns the surface inside out"
)
DEPTH: Final = (
    "depth: parts that bend in one direction only (cylinders, cones, waves) can be deeper or flatter with the"
    " same crosses; --hint ROW,COLUMN,SLANT,TILT settles it"
)


def surface_document(surface: Surface, about: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The report of a surface as JSON. about: how it was made, for instance the method of its field."""
    instance = surface.instance
    return {
        "format": "crossfield-surface",
        "version": 1,
        "generator": generator(),
        "instance": {
            "name": instance.name,
            "source": instance.source,
            "sha256": instance.sha256,
            "height": instance.grid.height,
            "width": instance.grid.width,
            "pixels": instance.grid.size,
            "pixel_size": instance.pixel_size,
        },
        **(about or {}),
        **surface_facts(surface),
        "open": [SIGN, DEPTH],
    }


def surface_facts(surface: Surface) -> dict[str, Any]:
    """Whether a surface can be trusted, and why not; its heights in pixels and angles in degrees."""
    off = np.degrees(right_angle_error(surface))
    slant = np.degrees(np.arccos(np.clip(surface.normals[:, 2], -1.0, 1.0)))
    return {
        "trusted": not surface.doubts,
        "doubts": list(surface.doubts),
        "confidence_mean": _rounded(surface.confidence.mean()),
        "confidence_least_tenth": _rounded(np.percentile(surface.confidence, 10)),
        "right_angle_error_mean_degrees": _rounded(off.mean()),
        "right_angle_error_90_percent_degrees": _rounded(np.percentile(off, 90)),
        "slant_mean_degrees": _rounded(slant.mean()),
        "slant_most_degrees": _rounded(slant.max()),
        "height_range_pixels": _rounded(np.ptp(surface.corners)),
    }


def right_angle_error(surface: Surface) -> Floats:
    """Radians by which the two lines of each cross, lifted to the surface, miss a right angle; shape (n,).

    Lines u and v become the tangents (u, u.g) and (v, v.g), with g the slopes of the surface.
    """
    field, slopes = surface.field, surface.gradient
    rise_u, rise_v = (np.sum(line * slopes, axis=1) for line in (field.u, field.v))
    product = np.sum(field.u * field.v, axis=1) + rise_u * rise_v
    cosine = product / np.sqrt((1 + rise_u**2) * (1 + rise_v**2))
    error: Floats = np.arcsin(np.clip(np.abs(cosine), 0.0, 1.0))
    return error


def _rounded(value: Any) -> float:
    """A number to four digits behind the point, so that files are short."""
    return round(float(value), 4)
