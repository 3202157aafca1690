"""A field on triangles in space: the faces of its mesh, or two per pixel of its grid.

The triangles of pixel k are 2k and 2k + 1, cut from top left to bottom right. Pixels that meet only in a
corner each get their own vertex there, so that the mesh is a manifold. Coordinates are the sketch's, with y
negated and z = 0.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.angles import arctangent, double_angle, line_difference, line_of
from ..instance.domain import Floats
from ..instance.instance import Instance
from ..instance.mesh import Mesh
from .field import CrossField

_EQUAL: Final = 1e-12  # radians between two directions that are the same


def mesh_of(instance: Instance) -> Mesh:
    """The mesh of an instance, or the triangles of its pixels."""
    if isinstance(instance.domain, Mesh):
        return instance.domain
    places, corners = instance.grid.vertices
    x = instance.origin[0] + instance.pixel_size * places[:, 1]
    y = -(instance.origin[1] + instance.pixel_size * places[:, 0])
    vertices = np.stack([x, y, np.zeros(len(x))], axis=1) + 0.0
    return Mesh(vertices, corners[:, [0, 2, 3, 0, 3, 1]].reshape(-1, 3))


def vectors_of(field: CrossField) -> Floats:
    """Unit vectors u and v of each triangle, shape (triangles, 2, 3)."""
    domain = field.instance.domain
    if isinstance(domain, Mesh):
        faces = np.arange(domain.size, dtype=np.int32)
        lines = (domain.vectors(faces, angle) for angle in (field.u_angle, field.v_angle))
        return np.stack(list(lines), axis=1) + 0.0
    vectors = np.zeros((domain.size, 2, 3))
    vectors[:, :, :2] = np.stack([field.u, field.v], axis=1)
    return np.repeat(vectors, 2, axis=0) + 0.0


def field_of_vectors(instance: Instance, u: Floats, v: Floats) -> CrossField:
    """The field whose lines have given directions on each triangle, or each pixel, (k, 3).

    Where the two triangles of a pixel differ, the pixel gets the lines between.
    """
    if isinstance(instance.domain, Mesh):
        faces = np.arange(instance.domain.size, dtype=np.int32)
        angles = [instance.domain.angle_in(faces, vectors) for vectors in (u, v)]
        return CrossField.from_lines(instance, *angles)
    u_angle, v_angle = (arctangent(vectors[:, 1], vectors[:, 0]) for vectors in (u, v))
    if len(u) == 2 * instance.grid.size:
        u_angle, v_angle = _lines_between(u_angle.reshape(-1, 2).T, v_angle.reshape(-1, 2).T)
    return CrossField.from_lines(instance, u_angle, v_angle)


def triangle_counts(instance: Instance) -> tuple[int, ...]:
    """Numbers of rows that a file about the instance may have, the one that is written first."""
    size = instance.domain.size
    return (size,) if isinstance(instance.domain, Mesh) else (2 * size, size)


def _lines_between(u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """The lines between the lines of two crosses, shapes (2, n), with the closest lines paired."""
    straight = line_difference(u[0], u[1]) + line_difference(v[0], v[1])
    crossed = line_difference(u[0], v[1]) + line_difference(v[0], u[1])
    swap = crossed < straight
    first, second = np.stack([u[0], v[0]]), np.where(swap, [v[1], u[1]], [u[1], v[1]])
    middle = line_of(double_angle(first) + double_angle(second))
    between = np.where(line_difference(first, second) < _EQUAL, first, middle)
    return between[0], between[1]
