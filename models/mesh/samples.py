"""The built-in meshes as instances: strokes at their sharp edges and boundaries."""

from __future__ import annotations

from typing import Final

import numpy as np

from ..errors import InputError
from ..instance.instance import STROKE_WEIGHT, Gauge, Instance
from .shapes import MESHES
from .strokes import combine_strokes, feature_edges

SHARP: Final = 35.0
"""Degrees between two faces from which their edge is a stroke on both."""
_SMOOTH: Final = frozenset({"bump", "half_torus", "doughnut"})  # their edges bend a coarse smooth surface


def mesh_sample(
    name: str,
    *,
    gauge: Gauge = "strokes",
    stroke_weight: float = STROKE_WEIGHT,
    orthogonal: bool = True,
) -> Instance:
    """Instance of a built-in mesh. Raises InputError for an unknown name, InstanceError for a weight."""
    if name not in MESHES:
        raise InputError(f"there is no mesh {name!r}; choose one of {', '.join(MESHES)}")
    mesh = MESHES[name][1]()
    none = np.zeros((0, 2), dtype=np.int32)
    edges = feature_edges(mesh, sharp=None if name in _SMOOTH else SHARP, boundary=True, lines=none)
    strokes = combine_strokes(mesh, edges, None)
    return Instance.on_faces(
        name,
        mesh,
        strokes.face,
        strokes.theta,
        strokes.w,
        stroke_coefficient=stroke_weight,
        gauge=gauge,
        orthogonal=orthogonal,
        source=f"the built-in mesh {name}",
    )
