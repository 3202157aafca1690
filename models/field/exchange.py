"""Files of other programs with directions on triangles (triangles.py): .rosy, .ply and .vtk, all as text.

`.rosy`, of QuadWild and others: the number of faces, 4, and for each face one vector of an orthogonal cross,
in the plane of its face. A skewed cross is written as the orthogonal cross between its lines.

`.ply` and `.vtk` hold the mesh too, and u and v of each face: as properties ux to vz, and as cell vectors.
The .vtk also has the index of each vertex, 0 at most of them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from ..errors import InstanceError
from ..input_limits import MAX_NUMBER
from ..instance.domain import Floats
from ..instance.instance import Instance
from .field import CrossField
from .rawfield import check_triangles, number_rows, text_of_rows, unit_vectors
from .triangles import field_of_vectors, mesh_of, singular_vertices, triangle_counts, vectors_of

_COMPONENTS: Final = ("ux", "uy", "uz", "vx", "vy", "vz")
_PER_FACE: Final = 20  # numbers about a face and its vertices in any of these files, and words of a head


def to_rosy(field: CrossField) -> bytes:
    """The text of the .rosy of a field."""
    straight = CrossField(
        replace(field.instance, orthogonal=True), field.alpha, np.zeros_like(field.beta), field.p
    )
    vectors = vectors_of(straight)[:, 0]
    return f"{len(vectors)}\n4\n{text_of_rows(vectors)}".encode()


def to_ply(field: CrossField) -> bytes:
    """The text of the .ply of a field."""
    mesh, vectors = mesh_of(field.instance), vectors_of(field)
    properties = "".join(f"property double {name}\n" for name in _COMPONENTS)
    head = (
        f"ply\nformat ascii 1.0\ncomment crosses on {field.instance.name}: lines u and v of each face\n"
        f"element vertex {len(mesh.vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {mesh.size}\nproperty list uchar int vertex_indices\n{properties}end_header\n"
    )
    rows = zip(mesh.faces.tolist(), vectors.reshape(-1, 6).tolist(), strict=True)
    faces = "".join(f"3 {' '.join(map(repr, [*corners, *numbers]))}\n" for corners, numbers in rows)
    return (head + text_of_rows(mesh.vertices) + faces).encode()


def to_vtk(field: CrossField) -> bytes:
    """The text of the .vtk of a field."""
    mesh, vectors = mesh_of(field.instance), vectors_of(field)
    vertex, turns = singular_vertices(field)
    index = np.zeros((len(mesh.vertices), 1))
    index[vertex, 0] = turns
    u, v = (f"VECTORS {name} double\n{text_of_rows(vectors[:, k])}" for k, name in enumerate("uv"))
    return (
        f"# vtk DataFile Version 3.0\ncrosses on {field.instance.name}\nASCII\nDATASET POLYDATA\n"
        f"POINTS {len(mesh.vertices)} double\n{text_of_rows(mesh.vertices)}"
        f"POLYGONS {mesh.size} {4 * mesh.size}\n{text_of_rows(mesh.faces, '3 ')}"
        f"CELL_DATA {mesh.size}\n{u}{v}"
        f"POINT_DATA {len(index)}\nSCALARS index double 1\nLOOKUP_TABLE default\n{text_of_rows(index)}"
    ).encode()


def most_exchange_bytes(instance: Instance) -> int:
    """Most bytes of such a file that is read for the instance."""
    return (MAX_NUMBER + 1) * _PER_FACE * (triangle_counts(instance)[0] + _PER_FACE)


def parse_rosy(data: bytes, instance: Instance) -> CrossField:
    """Read the field of a .rosy on the instance. Raises InstanceError that names the line."""
    body = [(number, line) for number, line in enumerate(data.splitlines(), 1) if line.strip()]
    if [line.split() for _, line in body[1:2]] != [[b"4"]]:
        raise InstanceError("line 2: is not 4, the number of directions of a cross; give a field of crosses")
    (faces,), rows = number_rows(body[:1], 1, "the number of faces")[0], body[2:]
    check_triangles(len(rows), instance)
    if faces != len(rows):
        raise InstanceError(f"has {len(rows)} rows of vectors, but its first line states {faces:g}")
    vectors = number_rows(rows, 3, "x y z of a vector")
    u = unit_vectors(vectors[:, None], [number for number, _ in rows], instance)[:, 0]
    return field_of_vectors(instance, u, _turned(u, instance))


def _turned(vectors: Floats, instance: Instance) -> Floats:
    """The vectors (k, 3) of faces turned by a quarter counter-clockwise."""
    normals = mesh_of(instance).normals
    return np.cross(normals if len(normals) == len(vectors) else normals[::2], vectors)


def parse_ply(data: bytes, instance: Instance) -> CrossField:
    """Read the field of a .ply that `to_ply` wrote. Raises InstanceError that names the line."""
    lines = data.splitlines()
    mesh, end = mesh_of(instance), next((k for k, line in enumerate(lines) if line == b"end_header"), 0)
    expected = [f"property double {name}".encode() for name in _COMPONENTS]
    if lines[end - len(expected) : end] != expected:
        raise InstanceError("its faces have no properties ux, uy, uz, vx, vy, vz; give a .ply of crossfield")
    start = end + 1 + len(mesh.vertices)
    return _field_of_rows(list(enumerate(lines[start:], start + 1)), 4, instance)


def parse_vtk(data: bytes, instance: Instance) -> CrossField:
    """Read the field of a .vtk with cell vectors u and v. Raises InstanceError that names the line."""
    lines, count = data.splitlines(), triangle_counts(instance)[0]
    heads = [
        k for name in (b"u", b"v") for k, line in enumerate(lines) if line.split()[:2] == [b"VECTORS", name]
    ]
    if len(heads) != 2:
        raise InstanceError("has no cell vectors u and v as text; give a .vtk of crossfield")
    u, v = (lines[head + 1 : head + 1 + count] for head in heads)
    rows = [(heads[0] + 2 + k, b" ".join(pair)) for k, pair in enumerate(zip(u, v, strict=False))]
    return _field_of_rows(rows, 0, instance)


def _field_of_rows(body: list[tuple[int, bytes]], skipped: int, instance: Instance) -> CrossField:
    """The field of rows that end with u and v, after a number of others."""
    check_triangles(len(body), instance)
    table = number_rows(body, skipped + 6, "the last six x y z of u and v")[:, skipped:].reshape(-1, 2, 3)
    u, v = unit_vectors(table, [number for number, _ in body], instance).swapaxes(0, 1)
    return field_of_vectors(instance, u, v)
