"""Files of other programs with directions on triangles (triangles.py), all as text.

`.rawfield`, of Directional: a line `4 F`, then for each of F faces u, v, -u, -v as 12 numbers x y z,
counter-clockwise. Its singularities (.sings) and its mesh (.obj) are files of their own. Other fields are
read too: vectors of any length and order that form two pairs of opposite vectors. They are projected to the
plane of their face, because programs round meshes and vectors to a few digits.

`.rosy`, of QuadWild and others: the number of faces, 4, and for each face one vector of an orthogonal cross,
in the plane of its face. A skewed cross is written as the orthogonal cross between its lines.

`.ply` and `.vtk` are written for other programs. They hold the mesh too, and u and v of each face: as
properties ux to vz, and as cell vectors. The .vtk also has the index of each vertex, 0 at most of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..arguments import whole_numbers
from ..errors import InputError, InstanceError, naming, quote_line
from ..input_limits import MAX_BYTES, MAX_NUMBER
from ..instance.domain import Floats, Ints
from ..instance.instance import Instance
from ..instance.mesh import Mesh
from ..storage import read_bytes
from ..text_rows import Lines, filled_lines, number_rows, plain_text
from .field import CrossField
from .triangles import field_of_vectors, mesh_of, triangle_counts, vectors_of

_COMPONENTS: Final = ("ux", "uy", "uz", "vx", "vy", "vz")
_VTK_TRIANGLE: Final = "5\n"  # type of a cell
_PER_FACE: Final = 20  # numbers about a face and its vertices in any of these files, and words of a head
_OPPOSITE: Final = 1e-3  # radians by which the two vectors of a line may fail to be opposite
_FLAT: Final = 0.05  # share of a vector that may point out of the plane: programs round meshes to 6 digits


def _to_rawfield(field: CrossField) -> bytes:
    """The text of the .rawfield of a field."""
    vectors = vectors_of(field)
    rows = _text_of_rows(np.concatenate([vectors, -vectors], axis=1).reshape(-1, 12) + 0.0)
    return f"4 {len(vectors)}\n{rows}".encode()


def to_obj(instance: Instance) -> bytes:
    """The mesh: vertices and, 1-based, faces."""
    mesh, on_mesh = mesh_of(instance), isinstance(instance.domain, Mesh)
    of_pixels = (
        f"# {instance.name}: triangles 2k - 1 and 2k are pixel k = 1, 2, ... of the mask, row by row; y up"
    )
    head = f"# the mesh of a cross field of crossfield: {instance.name}" if on_mesh else of_pixels
    rows = _text_of_rows(mesh.vertices, "v ") + _text_of_rows(mesh.faces + 1, "f ")
    return f"{head}\n{rows}".encode()


def to_sings(field: CrossField) -> bytes:
    """The text of the singularities: a line `4 k`, then vertex, from 0 as in the .obj, and 4 index."""
    vertex, index = field.singularities.vertex, field.singularities.index
    quarters = np.round(4 * index).astype(np.int64)
    return f"4 {len(vertex)}\n{_text_of_rows(np.stack([vertex, quarters], axis=1))}".encode()


def _to_rosy(field: CrossField) -> bytes:
    """The text of the .rosy of a field."""
    straight = CrossField(
        replace(field.instance, orthogonal=True), field.alpha, np.zeros_like(field.beta), field.p
    )
    vectors = vectors_of(straight)[:, 0]
    return f"{len(vectors)}\n4\n{_text_of_rows(vectors)}".encode()


def _to_ply(field: CrossField) -> bytes:
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
    return (head + _text_of_rows(mesh.vertices) + faces).encode()


def _to_vtk(field: CrossField) -> bytes:
    """The text of the .vtk of a field."""
    mesh, vectors = mesh_of(field.instance), vectors_of(field)
    index = np.zeros((len(mesh.vertices), 1))
    index[field.singularities.vertex, 0] = field.singularities.index
    u, v = (f"VECTORS {name} double\n{_text_of_rows(vectors[:, k])}" for k, name in enumerate("uv"))
    return (
        f"# vtk DataFile Version 3.0\ncrosses on {field.instance.name}\nASCII\n"
        "DATASET UNSTRUCTURED_GRID\n"
        f"POINTS {len(mesh.vertices)} double\n{_text_of_rows(mesh.vertices)}"
        f"CELLS {mesh.size} {4 * mesh.size}\n{_text_of_rows(mesh.faces, '3 ')}"
        f"CELL_TYPES {mesh.size}\n{mesh.size * _VTK_TRIANGLE}"
        f"CELL_DATA {mesh.size}\n{u}{v}"
        f"POINT_DATA {len(index)}\nSCALARS index double 1\nLOOKUP_TABLE default\n{_text_of_rows(index)}"
    ).encode()


def _text_of_rows(table: np.ndarray[Any, Any], lead: str = "") -> str:
    """One line of numbers per row of a table, each after a lead."""
    return "".join(f"{lead}{' '.join(map(repr, row))}\n" for row in table.tolist())


def most_text_bytes(instance: Instance) -> int:
    """Most bytes of such a file that is read for the instance."""
    return (MAX_NUMBER + 1) * _PER_FACE * (triangle_counts(instance)[0] + _PER_FACE)


def _parse_rawfield(data: bytes, instance: Instance) -> CrossField:
    """Read the field of a .rawfield on the instance. Raises InstanceError that names the line."""
    (first, head), *rows = filled_lines(plain_text(data)) or [(1, b"")]
    words = head.split()
    if len(words) != 2 or not all(word.isdigit() and len(word) < MAX_NUMBER for word in words):
        raise InstanceError(f"line {first}: is {quote_line(head)}, not the degree 4 and a number of faces")
    degree, faces = map(int, words)
    if degree != 4:
        raise InstanceError(f"line {first}: has {degree} vectors per face; crosses have 4: u, v, -u, -v")
    _check_triangles(faces, instance, f"line {first}: ")
    _check_stated(rows, faces)
    vectors = number_rows(rows, 12, "x y z of four vectors", InstanceError).reshape(-1, 4, 3)
    return field_of_vectors(instance, *_pair_opposites(_unit_vectors(vectors, rows, instance), rows))


def _parse_rosy(data: bytes, instance: Instance) -> CrossField:
    """Read the field of a .rosy on the instance. Raises InstanceError that names the line."""
    body = filled_lines(plain_text(data))
    if [line.split() for _, line in body[1:2]] != [[b"4"]]:
        raise InstanceError("line 2: is not 4, the number of directions of a cross; give a field of crosses")
    (faces,), rows = number_rows(body[:1], 1, "the number of faces", InstanceError)[0], body[2:]
    _check_triangles(len(rows), instance)
    _check_stated(rows, faces)
    u = _unit_vectors(number_rows(rows, 3, "x y z of a vector", InstanceError)[:, None], rows, instance)[:, 0]
    normals = mesh_of(instance).normals
    return field_of_vectors(instance, u, np.cross(normals if len(normals) == len(u) else normals[::2], u))


def read_sings(path: Path) -> Ints:
    """Vertices and four times their indices in a .sings, (k, 2). Raises InputError that names the line."""
    with naming(path):
        body = filled_lines(plain_text(read_bytes(path, MAX_BYTES)))
        numbers = number_rows(body, 2, "a vertex and four times its index (in the first line 4 and a count)")
        if numbers[:1].tolist() != [[4, len(numbers) - 1]]:
            raise InputError(f"does not begin with 4 {max(len(numbers) - 1, 0)}, the number of its vertices")
        return whole_numbers(numbers[1:], "a row", InputError)


def _check_triangles(count: int, instance: Instance, place: str = "") -> None:
    """Raise InstanceError unless a file about an instance may have directions on that many faces."""
    counts, domain = triangle_counts(instance), instance.domain
    if count not in counts:
        remedy = f"{counts[0]}, as in its .obj" + f", or {counts[-1]}, one per pixel" * (len(counts) > 1)
        raise InstanceError(
            f"{place}has {count} faces, but {instance.name} has {domain.size} {domain.kind}s; give {remedy}"
        )


def _check_stated(rows: Lines, stated: float) -> None:
    if len(rows) != stated:
        raise InstanceError(f"has {len(rows)} rows of vectors, but its first line states {stated:.15g}")


def _unit_vectors(vectors: Floats, rows: Lines, instance: Instance) -> Floats:
    """The vectors (k, c, 3) of faces at length 1. Raises InstanceError for one that is no direction there."""
    largest = np.abs(vectors).max(axis=2, keepdims=True)
    _refuse(~np.isfinite(largest).all(axis=(1, 2)), rows, "holds a number beyond the range of doubles")
    _refuse((largest == 0).any(axis=(1, 2)), rows, "holds a vector of length 0, which has no direction")
    unit = vectors / largest  # squares of the numbers themselves might exceed the range of doubles
    unit /= np.linalg.norm(unit, axis=2, keepdims=True)
    domain = instance.domain
    normal = domain.normals if isinstance(domain, Mesh) else np.array([[0.0, 0.0, 1.0]])
    beyond = (np.abs((unit * normal[:, None]).sum(axis=2)) > _FLAT).any(axis=1)
    if len(beyond) < 2 * beyond.sum():
        raise InstanceError(
            f"has vectors out of the plane of their faces in {beyond.sum()} of {len(beyond)} rows, as fields "
            f"of another mesh; give the field of {instance.name}, with its faces in the same order"
        )
    _refuse(beyond, rows, "has a vector out of the plane of its face")
    return np.asarray(unit)


def _pair_opposites(unit: Floats, rows: Lines) -> tuple[Floats, Floats]:
    """One vector of each of the two lines (k, 3) that four unit vectors each form, (k, 4, 3)."""
    face, first = np.arange(len(unit)), unit[:, 0]
    partner = 1 + np.argmin(np.einsum("kc,kvc->kv", first, unit[:, 1:]), axis=1)
    second_line = np.where(partner == 1, 2, 1)
    last = 6 - partner - second_line  # of the indices 0 to 3, which add up to 6
    second = unit[face, second_line]
    both = np.stack([unit[face, partner] + first, unit[face, last] + second])
    off = np.linalg.norm(both, axis=2).max(axis=0)
    _refuse(off > _OPPOSITE, rows, "has no two pairs of opposite vectors: u, v, -u, -v")
    return first, second


def _refuse(wrong: Any, rows: Lines, reason: str) -> None:
    if wrong.any():
        raise InstanceError(f"line {rows[int(np.argmax(wrong))][0]}: {reason} ({int(wrong.sum())} such rows)")


TEXT_WRITERS: Final[dict[str, Callable[[CrossField], bytes]]] = {
    ".rawfield": _to_rawfield,
    ".rosy": _to_rosy,
    ".ply": _to_ply,
    ".vtk": _to_vtk,
}
TEXT_READERS: Final[dict[str, Callable[[bytes, Instance], CrossField]]] = {
    ".rawfield": _parse_rawfield,
    ".rosy": _parse_rosy,
}
