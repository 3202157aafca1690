"""Directional's raw field of a mesh (.rawfield), its singularities (.sings), and the mesh (.obj).

A line `4 F`, then for each of F triangles (triangles.py) u, v, -u, -v as 12 numbers x y z, counter-clockwise.

Other fields are read too: vectors of any length and order that form two pairs of opposite vectors in the
plane of their face.
"""

from __future__ import annotations

import re
from typing import Any, Final

import numpy as np

from ..errors import InstanceError, quote_line
from ..input_limits import MAX_NUMBER
from ..instance.domain import Bools, Floats
from ..instance.instance import Instance
from ..instance.mesh import Mesh
from .field import CrossField
from .triangles import field_of_vectors, mesh_of, singular_vertices, triangle_counts, vectors_of

_ROW: Final = 12  # numbers per face
_OPPOSITE: Final = 1e-3  # radians by which the two vectors of a line may fail to be opposite
_FLAT: Final = 1e-6  # share of a vector that may point out of the plane
_NUMBERS: Final = re.compile(
    rb"(?:[ \t]*+[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?(?![^ \t]))*+[ \t]*+"
)


def to_rawfield(field: CrossField) -> bytes:
    """The text of the field's .rawfield."""
    vectors = vectors_of(field)
    rows = text_of_rows(np.concatenate([vectors, -vectors], axis=1).reshape(-1, _ROW) + 0.0)
    return f"4 {len(vectors)}\n{rows}".encode()


OF_MESH: Final = b"# the mesh of a cross field of crossfield: "
"""How the .obj of a mesh begins, by which it differs from the user's own mesh."""


def to_obj(instance: Instance) -> bytes:
    """The mesh: vertices and, 1-based, faces."""
    mesh, on_mesh = mesh_of(instance), isinstance(instance.domain, Mesh)
    of_pixels = (
        f"# {instance.name}: triangles 2k - 1 and 2k are pixel k = 1, 2, ... of the mask, row by row; y up"
    )
    head = OF_MESH + instance.name.encode() if on_mesh else of_pixels.encode()
    rows = text_of_rows(mesh.vertices, "v ") + text_of_rows(mesh.faces + 1, "f ")
    return head + b"\n" + rows.encode()


def to_sings(field: CrossField) -> bytes:
    """The text of the singularities: a line `4 k`, then vertex, from 0 as in the .obj, and 4 index."""
    vertex, index = singular_vertices(field)
    quarters = np.round(4 * index).astype(np.int64)
    return f"4 {len(vertex)}\n{text_of_rows(np.stack([vertex, quarters], axis=1))}".encode()


def text_of_rows(table: np.ndarray[Any, Any], lead: str = "") -> str:
    """One line of numbers per row of a table, each after a lead."""
    return "".join(f"{lead}{' '.join(map(repr, row))}\n" for row in table.tolist())


def most_rawfield_bytes(instance: Instance) -> int:
    """Most bytes of a .rawfield that is read for the instance."""
    return (MAX_NUMBER + 1) * (2 + triangle_counts(instance)[0] * _ROW)


def parse_rawfield(data: bytes, instance: Instance) -> CrossField:
    """Read the field of a .rawfield on the instance. Raises InstanceError that names the line."""
    lines = data.splitlines()
    rows = _parse_head(lines[0] if lines else b"", instance)
    body = [(number, line) for number, line in enumerate(lines[1:], 2) if line.strip()]
    if len(body) != rows:
        raise InstanceError(f"has {len(body)} rows of vectors, but its first line states {rows}")
    vectors = number_rows(body, _ROW, "x y z of four vectors").reshape(rows, 4, 3)
    return field_of_vectors(instance, *_lines_of_vectors(vectors, [number for number, _ in body], instance))


def _parse_head(head: bytes, instance: Instance) -> int:
    """The number of faces that the first line states."""
    words = head.split()
    if len(words) != 2 or not all(word.isdigit() and len(word) < MAX_NUMBER for word in words):
        raise InstanceError(f"line 1: is {quote_line(head)}, not the degree 4 and a number of faces")
    degree, faces = map(int, words)
    if degree != 4:
        raise InstanceError(f"line 1: has {degree} vectors per face; crosses have 4: u, v, -u, -v")
    check_triangles(faces, instance, "line 1: ")
    return faces


def check_triangles(count: int, instance: Instance, place: str = "") -> None:
    """Raise InstanceError unless a file about an instance may have directions on that many faces."""
    counts, domain = triangle_counts(instance), instance.domain
    if count not in counts:
        remedy = f"{counts[0]}, as in its .obj" + f", or {counts[-1]}, one per pixel" * (len(counts) > 1)
        raise InstanceError(
            f"{place}has {count} faces, but {instance.name} has {domain.size} {domain.kind}s; give {remedy}"
        )


def number_rows(body: list[tuple[int, bytes]], width: int, meaning: str) -> Floats:
    """The numbers (k, width) of numbered lines. Raises InstanceError that names the line and the meaning."""
    for number, line in body:
        words = len(line.split())
        if words != width:
            raise InstanceError(f"line {number}: has {words} numbers; give {width}, {meaning}")
        if not _NUMBERS.fullmatch(line):
            raise InstanceError(f"line {number}: holds something other than numbers: {quote_line(line)}")
    return np.array(b" ".join(line for _, line in body).split(), dtype=np.float64).reshape(-1, width)


def unit_vectors(vectors: Floats, numbers: list[int], instance: Instance) -> Floats:
    """The vectors (k, c, 3) of faces at length 1. Raises InstanceError for one that is no direction there."""
    largest = np.abs(vectors).max(axis=2, keepdims=True)
    _refuse(~np.isfinite(largest).all(axis=(1, 2)), numbers, "holds a number beyond the range of doubles")
    _refuse((largest == 0).any(axis=(1, 2)), numbers, "holds a vector of length 0, which has no direction")
    unit = vectors / largest  # squares of the numbers themselves might exceed the range of doubles
    unit /= np.linalg.norm(unit, axis=2, keepdims=True)
    domain = instance.domain
    normal = domain.normals if isinstance(domain, Mesh) else np.array([[0.0, 0.0, 1.0]])
    beyond = np.abs((unit * normal[:, None]).sum(axis=2)) > _FLAT
    _refuse(np.asarray(beyond.any(axis=1)), numbers, "has a vector out of the plane of its face")
    return np.asarray(unit)


def _lines_of_vectors(vectors: Floats, numbers: list[int], instance: Instance) -> tuple[Floats, Floats]:
    """One vector of each of the two lines (k, 3) that four vectors each form, (k, 4, 3)."""
    unit = unit_vectors(vectors, numbers, instance)
    rows = np.arange(len(unit))
    partner = 1 + np.argmin(np.einsum("kc,kvc->kv", unit[:, 0], unit[:, 1:]), axis=1)
    second_line = np.where(partner == 1, 2, 1)
    # Of the indices 0 to 3, which add up to 6.
    last = 6 - partner - second_line
    off = np.stack(
        [np.linalg.norm(unit[rows, partner] + unit[:, 0], axis=1),
         np.linalg.norm(unit[rows, last] + unit[rows, second_line], axis=1)]
    )  # fmt: skip
    _refuse(
        np.asarray((off > _OPPOSITE).any(axis=0)),
        numbers,
        "has no two pairs of opposite vectors: u, v, -u, -v",
    )
    return unit[:, 0], unit[rows, second_line]


def _refuse(wrong: Bools, numbers: list[int], reason: str) -> None:
    if wrong.any():
        raise InstanceError(f"line {numbers[int(np.argmax(wrong))]}: {reason} ({int(wrong.sum())} such rows)")
