"""Report of a surface: its fit to the crosses, its doubts, and what they do not determine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...models.surface.surface import Surface
from ...models.surface.trust import off_right_angles
from ..formats.registry import generator


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
    }


def surface_facts(surface: Surface) -> dict[str, Any]:
    """Whether a surface can be trusted, doubts, and freedom; in pixels and degrees."""
    off = np.degrees(off_right_angles(surface.field, surface.heights))
    slant = np.degrees(np.arccos(np.clip(surface.normals[:, 2], -1.0, 1.0)))
    return {
        "trusted": not surface.doubts,
        "doubts": list(surface.doubts),
        "freedom": list(surface.freedom),
        "firmness": _rounded(surface.firmness),
        "confidence_mean": _rounded(surface.confidence.mean()),
        "confidence_least_tenth": _rounded(np.percentile(surface.confidence, 10)),
        "right_angle_error_mean_degrees": _rounded(off.mean()),
        "right_angle_error_90_percent_degrees": _rounded(np.percentile(off, 90)),
        "slant_mean_degrees": _rounded(slant.mean()),
        "slant_most_degrees": _rounded(slant.max()),
        "height_range_pixels": _rounded(np.ptp(surface.corners)),
    }


def _rounded(value: Any) -> float:
    """A number to four decimals, so that files are short."""
    return round(float(value), 4)
