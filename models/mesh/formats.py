"""Mesh files: vertices, triangles, and the polylines of an OBJ.

OBJ is read here, because its polylines are strokes. PLY, OFF and STL are read by trimesh from bytes, so that
it opens no file and no address. Polygons are refused: trimesh would cut them into triangles silently.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..arguments import whole_numbers
from ..errors import InputError, MeshError, quote_line, shortened
from ..input_limits import MAX_BYTES
from ..instance.domain import Floats, Ints
from ..instance.mesh import MOST_FACES, Mesh
from ..storage import read_bytes, require_suffix

_MOST_VERTICES: Final = 3 * MOST_FACES
_HEAD: Final = 1 << 16  # bytes in which a file states the numbers of its vertices and faces
NO_LINES: Final = np.zeros((0, 2), dtype=np.int32)


def read_mesh_file(path: Path) -> tuple[Mesh, Ints]:
    """Mesh in a file, not yet checked, and the edges [vertex, vertex] (k, 2) of its polylines.

    Raises InputError for another suffix or content, or a file that is too large, and MeshError for polygons.
    """
    require_suffix(path, *MESH_READERS)
    return MESH_READERS[path.suffix.lower()](read_bytes(path, MAX_BYTES, "simplify the mesh"))


def _read_obj(data: bytes) -> tuple[Mesh, Ints]:
    """Vertices, faces and polylines of an OBJ; texture, normals, groups and materials are ignored."""
    vertices: list[list[bytes]] = []
    faces: list[list[int]] = []
    edges: list[tuple[int, int]] = []
    for number, line in enumerate(re.sub(rb"\\\r?\n", b" ", data).splitlines(), 1):
        word, *values = line.split(b"#", 1)[0].split() or [b""]
        try:
            if word == b"v":
                vertices.append([values[0], values[1], values[2]])
            elif word in {b"f", b"l"}:
                corners = [_vertex_of(value, len(vertices)) for value in values]
                if word == b"l":
                    edges += pairwise(corners)
                elif len(corners) == 3:
                    faces.append(corners)
                else:
                    raise MeshError(f"line {number}: has a face of {len(corners)} corners; triangulate it")
        except (ValueError, IndexError) as error:
            raise InputError(f"line {number}: {quote_line(line)} is no OBJ; write it again") from error
        _check_size(max(len(vertices), len(edges)), len(faces))
    try:
        positions = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    except ValueError as error:
        raise InputError(f"has a vertex that is no number: {shortened(error)}") from error
    lines = whole_numbers(np.array(edges).reshape(-1, 2), "polylines", MeshError)
    return Mesh(positions, np.array(faces).reshape(-1, 3)), lines


def _vertex_of(corner: bytes, vertices: int) -> int:
    """Number of a vertex `v`, `v/vt` or `v//vn`, from 1, or negative from the last one so far."""
    number = int(corner.split(b"/", 1)[0])
    if number == 0:
        raise ValueError
    return number - 1 if number > 0 else max(vertices + number, -1)


def _read_ply(data: bytes) -> tuple[Mesh, Ints]:
    head = data[:_HEAD].partition(b"end_header")[0]
    numbers = dict(re.findall(rb"^[ \t]*element[ \t]+(\w+)[ \t]+(\d{1,9})\b", head, re.MULTILINE))
    return _read_stated(".ply", data, numbers.get(b"vertex"), numbers.get(b"face"))


def _read_off(data: bytes) -> tuple[Mesh, Ints]:
    head = re.sub(rb"#.*", b"", data[:_HEAD])
    numbers = re.match(rb"\s*(?:ST|C|N)*OFF\s+(\d{1,9})\s+(\d{1,9})\b", head)
    return _read_stated(".off", data, *(numbers.groups() if numbers else (None, None)))


def _read_stated(suffix: str, data: bytes, vertices: bytes | None, faces: bytes | None) -> tuple[Mesh, Ints]:
    """The mesh of a file that states the numbers of its vertices and faces, which must be triangles."""
    if vertices is None or faces is None:
        raise InputError(f"does not begin as {suffix}, with the numbers of its vertices and faces")
    _check_size(int(vertices), int(faces))
    if not int(faces):
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)), NO_LINES
    mesh = Mesh(*_load_by_trimesh(suffix, data))
    if len(mesh.faces) != int(faces):
        raise MeshError(f"has {int(faces)} faces, which are {len(mesh.faces)} triangles; triangulate it")
    return mesh, NO_LINES


def _check_size(vertices: int, faces: int) -> None:
    """Raise MeshError for too many vertices or faces, before their memory is spent."""
    if vertices > _MOST_VERTICES or faces > MOST_FACES:
        raise MeshError(
            f"has more than {_MOST_VERTICES} vertices or {MOST_FACES} faces, the most that are allowed; "
            "simplify it"
        )


def _read_stl(data: bytes) -> tuple[Mesh, Ints]:
    """Triangles that share a corner where their coordinates are equal, vertices in order of appearance."""
    corners, faces = _load_by_trimesh(".stl", data)
    _check_size(0, len(faces))
    vertices, first, number = np.unique(corners + 0.0, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return Mesh(vertices[order], np.argsort(order)[number.ravel()][faces]), NO_LINES


def _load_by_trimesh(suffix: str, data: bytes) -> tuple[Floats, Any]:
    """Vertices (v, 3) and faces (n, 3) as trimesh reads them."""
    try:
        import trimesh
    except ModuleNotFoundError as error:
        raise InputError(
            f"{suffix} is read by trimesh, which is not installed; run pip install 'crossfield[mesh]', "
            "or give an .obj"
        ) from error
    try:
        loaded = trimesh.load_mesh(
            io.BytesIO(data), file_type=suffix[1:], process=False, fix_texture=False, skip_materials=True
        )
        return np.array(loaded.vertices, dtype=np.float64), np.array(loaded.faces)
    except Exception as error:  # trimesh raises what its parsers meet, also for damaged files
        raise InputError(f"is not read as {suffix}: {shortened(error)}; write it again") from error


MESH_READERS: Final[dict[str, Callable[[bytes], tuple[Mesh, Ints]]]] = {
    ".obj": _read_obj,
    ".ply": _read_ply,
    ".off": _read_off,
    ".stl": _read_stl,
}
"""Suffixes of mesh files, and their readers."""
