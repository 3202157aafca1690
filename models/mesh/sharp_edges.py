"""The .sharp files of QuadWild: the edges that its quads follow, beside a mesh and a field of the same faces.

The first line has the number of the others: 1 for a convex edge or 0 for a concave one, the face, and the
side of the face: side k goes from corner k to the next one. An inner edge may be listed from both faces.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..arguments import whole_numbers
from ..errors import InputError, shortened
from ..input_limits import MAX_BYTES
from ..instance.domain import Ints
from ..instance.instance import Instance
from ..instance.mesh import Mesh
from ..storage import read_bytes, write_bytes
from ..text_rows import plain_text


def read_sharp_edges(path: Path, mesh: Mesh) -> Ints:
    """Vertices (k, 2) of the edges in a .sharp with commas or spaces. Raises InputError for other content."""
    words = plain_text(read_bytes(path, MAX_BYTES)).replace(b",", b" ").split()
    try:
        count, *numbers = [float(word) for word in words]
        rows = whole_numbers(numbers, "a row", InputError).reshape(-1, 3)
    except ValueError as error:
        raise InputError(f"is no .sharp, a count and rows of type,face,side: {shortened(error)}") from error
    if len(rows) != count:
        raise InputError(f"has {len(rows)} edges, but its first line states {count:.15g}")
    wrong = (rows < 0) | (rows >= [2, mesh.size, 3])
    if wrong.any():
        row = rows[int(np.argmax(wrong.any(axis=1)))].tolist()
        raise InputError(f"has the edge {row}; give 0 or 1, a face below {mesh.size}, and a side 0 to 2")
    return mesh.edge_vertices(3 * rows[:, 1] + rows[:, 2])


def write_sharp_edges(instance: Instance, path: Path, *, force: bool = False) -> Path:
    """Write the edges along which a mesh was read with strokes. Raises InputError if they are not known."""
    mesh, reading = instance.mesh, instance.reading
    if reading is None or reading.edges is None:
        raise InputError(
            f"{instance.name} has no edges with strokes in its file; give the mesh, with --sharp", file=path
        )
    edges = reading.edges
    face, reverse = edges // np.int32(3), mesh.opposite[edges]
    step = mesh.centres[reverse // 3] - mesh.centres[face]
    concave = (reverse >= 0) & (np.einsum("kc,kc->k", step, mesh.normals[face]) > 0)
    rows = np.stack([np.where(concave, 0, 1), face, edges - 3 * face], axis=1)
    text = "".join(f"{a},{b},{c}\n" for a, b, c in rows.tolist())
    return write_bytes(path, f"{len(rows)}\n{text}".encode(), force=force)
