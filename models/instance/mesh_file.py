"""The parts of instance files that only meshes have: vertices, faces, and strokes by their face."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..array_archive import ExpectedArray
from .domain import Floats
from .instance import Instance
from .mesh import MOST_FACES, Mesh

_MOST_VERTICES: Final = 3 * MOST_FACES

MESH_ARCHIVE: Final = {
    "vertices": ExpectedArray(2, _MOST_VERTICES, "f"),
    "faces": ExpectedArray(2, MOST_FACES, "iu"),
    "stroke_faces": ExpectedArray(1, MOST_FACES, "iu"),
}
"""Limits of the arrays in an .npz."""


def mesh_blocks(instance: Instance) -> dict[str, list[str]]:
    """Lines of JSON for vertices [x, y, z], faces [a, b, c] and strokes [face, theta, w]."""
    mesh = instance.mesh
    strokes = zip(instance.stroke_index.tolist(), instance.theta.tolist(), instance.w.tolist(), strict=True)
    rows = {"vertices": mesh.vertices.tolist(), "faces": mesh.faces.tolist(), "strokes": map(list, strokes)}
    return {name: [repr(row) for row in listed] for name, listed in rows.items()}


def mesh_arrays(instance: Instance) -> dict[str, NDArray[Any]]:
    """Vertices (v, 3), faces (n, 3) and numbers of the faces with strokes (s,) for an .npz."""
    mesh = instance.mesh
    return {"vertices": mesh.vertices, "faces": mesh.faces, "stroke_faces": instance.stroke_index}


def mesh_arguments(document: dict[str, Any]) -> dict[str, Any]:
    """Arguments of `Instance.on_faces` from the rows of a document or the arrays of an archive.

    Raises MeshError for arrays of another kind or shape.
    """
    arguments: dict[str, Any] = {"mesh": Mesh(document["vertices"], document["faces"])}
    if "strokes" in document:
        strokes = np.array(document["strokes"], dtype=np.float64).reshape(-1, 3)
        return arguments | dict(zip(("stroke_faces", "theta", "w"), strokes.T, strict=True))
    return arguments | {name: document[name] for name in ("stroke_faces", "theta", "w")}


def _are_stroke_rows(table: Floats) -> bool:
    return _are_numbers_of_faces(table[:, 0]) and bool(((table[:, 2] > 0) & (table[:, 2] <= 1)).all())


def _are_numbers_of_faces(numbers: Floats) -> bool:
    return bool(((numbers >= 0) & (numbers < _MOST_VERTICES) & (numbers % 1 == 0)).all())


MESH_ROWS: Final[dict[str, Callable[[Floats], bool]]] = {
    "vertices": lambda _: True,
    "faces": _are_numbers_of_faces,
    "strokes": _are_stroke_rows,
}
"""For each list of rows of three numbers, whether a table of them obeys the schema."""
