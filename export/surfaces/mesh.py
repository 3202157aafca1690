"""A surface as a mesh (.obj): a quad for each pixel, with texture coordinates and normals.

x runs to the right, y up, z towards the viewer, all in pixels; the lower left corner of the grid is at
x = y = 0. Texture coordinates cover the grid.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ...models.field.rawfield import vertices_of
from ...models.instance.grid import Floats, Ints
from ...models.surface.surface import Surface

MATERIAL: Final = "drawing"
_WALK: Final = [2, 3, 1, 0]  # corners of a pixel counter-clockwise, from the lower left


def to_obj(surface: Surface, materials: str) -> bytes:
    """The mesh as text. materials: name of the .mtl file in its folder."""
    instance = surface.instance
    places, corners = vertices_of(instance.grid)
    height, width = instance.mask.shape
    row, column = places.T
    points = np.column_stack([column, height - row, surface.heights[row, column]])
    texture = np.column_stack([column / width, 1 - row / height])
    faces = corners[:, _WALK] + 1
    return "".join(
        [
            f"# {instance.name}: quad k is pixel k = 1, 2, ... of the mask, row by row; y up, z to you\n",
            f"mtllib {materials}\n",
            _lines("v", points),
            _lines("vt", texture),
            _lines("vn", vertex_normals(surface, corners, len(places))),
            f"usemtl {MATERIAL}\ns 1\n",
            *("f " + " ".join(f"{k}/{k}/{k}" for k in face) + "\n" for face in faces.tolist()),
        ]
    ).encode()


def to_mtl(texture: str) -> bytes:
    """The material as text: dull, with a picture in the same folder as its colour."""
    return (f"newmtl {MATERIAL}\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {texture}\n").encode()


def vertex_normals(surface: Surface, corners: Ints, count: int) -> Floats:
    """Means (count, 3) of the normals of pixels round their corners, numbers of vertices (n, 4)."""
    summed = np.zeros((count, 3))
    np.add.at(summed, corners, surface.normals[:, None, :])
    unit: Floats = summed / np.linalg.norm(summed, axis=1, keepdims=True)
    return unit


def _lines(lead: str, table: np.ndarray[Any, Any]) -> str:
    form = lead + " {:.6f}" * table.shape[1] + "\n"
    return "".join(form.format(*row) for row in (np.round(table, 6) + 0.0).tolist())
