"""Directional's raw field of a mesh (.rawfield), its singularities (.sings), and the mesh (.obj).

A line `4 F`, then for each of F faces u, v, -u, -v as 12 numbers x y z, counter-clockwise.
The mesh has two triangles per pixel, 2k and 2k + 1 of pixel k, counter-clockwise with y up, and the field is
per face. Pixels that meet only in a corner each get their own vertex there, so that the mesh is a manifold.
Coordinates are the sketch's, with y negated and z = 0.

Other fields are read too: vectors of any length and order that form two pairs of opposite vectors in the
plane of the mesh. Where the two triangles of a pixel differ, the pixel gets the lines between.
"""

from __future__ import annotations

import re
from typing import Any, Final

import numpy as np

from ..errors import InstanceError, shortened
from ..input_limits import MAX_NUMBER
from ..instance.angles import arctangent, double_angle, line_difference, line_of
from ..instance.domain import Bools, Floats, Ints
from ..instance.grid import Grid
from ..instance.instance import Instance
from .field import CrossField

_ROW: Final = 12  # numbers per face
_OPPOSITE: Final = 1e-3  # radians by which the two vectors of a line may fail to be opposite
_FLAT: Final = 1e-6  # share of a vector that may point out of the plane
_NUMBERS: Final = re.compile(
    rb"(?:[ \t]*+[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?(?![^ \t]))*+[ \t]*+"
)


def to_rawfield(field: CrossField) -> bytes:
    """The text of the field's .rawfield, with each pixel's row twice."""
    vectors = np.zeros((field.instance.grid.size, 4, 3))
    vectors[:, :, :2] = np.stack([field.u, field.v, -field.u, -field.v], axis=1)
    rows = _text_of_rows(np.repeat(vectors.reshape(-1, 12), 2, axis=0) + 0.0)
    return f"4 {2 * len(vectors)}\n{rows}".encode()


def to_obj(instance: Instance) -> bytes:
    """The mesh: vertices and, 1-based, two triangles per pixel, cut from top left to bottom right."""
    places, corners = vertices_of(instance.grid)
    x = instance.origin[0] + instance.pixel_size * places[:, 1]
    y = -(instance.origin[1] + instance.pixel_size * places[:, 0])
    vertices = _text_of_rows(np.stack([x, y, np.zeros(len(x))], axis=1) + 0.0, "v ")
    faces = _text_of_rows(corners[:, [0, 2, 3, 0, 3, 1]].reshape(-1, 3) + 1, "f ")
    return (
        f"# {instance.name}: triangles 2k - 1 and 2k are pixel k = 1, 2, ... of the mask, "
        f"row by row; y up\n{vertices}{faces}"
    ).encode()


def to_sings(field: CrossField) -> bytes:
    """The text of the singularities: a line `4 k`, then vertex, from 0 as in the .obj, and 4 index."""
    places, _ = vertices_of(field.instance.grid)
    singularities = field.singularities
    across = field.instance.grid.width + 1
    at = np.searchsorted(
        places[:, 0] * across + places[:, 1], (singularities.row + 1) * across + singularities.column + 1
    )
    index = np.round(4 * singularities.index).astype(np.int64)
    order = np.argsort(at, kind="stable")
    return f"4 {len(at)}\n{_text_of_rows(np.stack([at[order], index[order]], axis=1))}".encode()


def vertices_of(grid: Grid) -> tuple[Ints, Ints]:
    """Vertices [row, column] (k, 2), and the vertex at each corner of each pixel (n, 4), row by row."""
    down, right = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    row, column = grid.rows[:, None] + down, grid.columns[:, None] + right
    inside = np.pad(grid.mask, 1)
    # Pixels round the corner: the one diagonally across, and the two at its sides.
    across = inside[row + down, column + right]
    beside = inside[row + down, column + 1 - right] | inside[row + 1 - down, column + right]
    apart = across & ~beside & (right == 1)
    key = 2 * (row.astype(np.int64) * (grid.width + 1) + column) + apart
    vertices, corners = np.unique(key, return_inverse=True)
    places = np.stack(np.divmod(vertices // 2, grid.width + 1), axis=1)
    return places.astype(np.int32), corners.reshape(key.shape).astype(np.int32)


def _text_of_rows(table: np.ndarray[Any, Any], lead: str = "") -> str:
    return "".join(f"{lead}{' '.join(map(repr, row))}\n" for row in table.tolist())


def most_rawfield_bytes(instance: Instance) -> int:
    """Most bytes of a .rawfield that is read for the instance."""
    return (MAX_NUMBER + 1) * (2 + 2 * instance.grid.size * _ROW)


def parse_rawfield(data: bytes, instance: Instance) -> CrossField:
    """Read the field of a .rawfield on the instance. Raises InstanceError that names the line."""
    lines = data.splitlines()
    rows = _parse_head(lines[0] if lines else b"", instance)
    body = [(number, line) for number, line in enumerate(lines[1:], 2) if line.strip()]
    if len(body) != rows:
        raise InstanceError(f"has {len(body)} rows of vectors, but its first line states {rows}")
    vectors = _parse_vectors(body).reshape(rows, 4, 3)
    u, v = _lines_of_vectors(vectors, [number for number, _ in body])
    if rows == 2 * instance.grid.size:
        u, v = _lines_between(u.reshape(-1, 2).T, v.reshape(-1, 2).T)
    return CrossField.from_lines(instance, u, v)


def _parse_head(head: bytes, instance: Instance) -> int:
    """The number of faces that the first line states."""
    words = head.split()
    if len(words) != 2 or not all(word.isdigit() and len(word) < MAX_NUMBER for word in words):
        raise InstanceError(f"line 1: is {_quoted(head)}, not the degree 4 and the number of faces as text")
    degree, faces = map(int, words)
    if degree != 4:
        raise InstanceError(f"line 1: has {degree} vectors per face; crosses have 4: u, v, -u, -v")
    size = instance.grid.size
    if faces not in (size, 2 * size):
        raise InstanceError(
            f"line 1: has {faces} faces, but {instance.name} has {size} pixels; "
            f"give {2 * size}, as in its .obj, or {size}, one per pixel"
        )
    return faces


def _parse_vectors(body: list[tuple[int, bytes]]) -> Floats:
    """The numbers of all rows, 12 per row."""
    for number, line in body:
        words = len(line.split())
        if words != _ROW:
            raise InstanceError(f"line {number}: has {words} numbers; give {_ROW}, x y z of four vectors")
        if not _NUMBERS.fullmatch(line):
            raise InstanceError(f"line {number}: holds something other than numbers: {_quoted(line)}")
    return np.array(b" ".join(line for _, line in body).split(), dtype=np.float64)


def _quoted(line: bytes) -> str:
    return repr(shortened(line.decode("utf-8", "replace")))


def _lines_of_vectors(vectors: Floats, numbers: list[int]) -> tuple[Floats, Floats]:
    """The angles u, v (k,) in radians of the two lines given by four vectors each, (k, 4, 3)."""
    largest = np.abs(vectors).max(axis=2, keepdims=True)
    _refuse(~np.isfinite(largest).all(axis=(1, 2)), numbers, "holds a number beyond the range of doubles")
    _refuse((largest == 0).any(axis=(1, 2)), numbers, "holds a vector of length 0, which has no direction")
    unit = vectors / largest  # squares of the numbers themselves might exceed the range of doubles
    unit /= np.linalg.norm(unit, axis=2, keepdims=True)
    _refuse((np.abs(unit[:, :, 2]) > _FLAT).any(axis=1), numbers, "has a vector out of the plane z = 0")
    rows = np.arange(len(unit))
    partner = 1 + np.argmin(np.einsum("kc,kvc->kv", unit[:, 0], unit[:, 1:]), axis=1)
    second_line = np.where(partner == 1, 2, 1)
    angle = arctangent(unit[:, :, 1], unit[:, :, 0])
    u, v = angle[:, 0], angle[rows, second_line]
    # Of the indices 0 to 3, which add up to 6.
    last = 6 - partner - second_line
    opposite = np.stack([angle[rows, partner] - u, angle[rows, last] - v])
    off = np.abs(np.mod(opposite, 2 * np.pi) - np.pi)
    _refuse((off > _OPPOSITE).any(axis=0), numbers, "has no two pairs of opposite vectors: u, v, -u, -v")
    return u, v


def _refuse(wrong: Bools, numbers: list[int], reason: str) -> None:
    if wrong.any():
        raise InstanceError(f"line {numbers[int(np.argmax(wrong))]}: {reason} ({int(wrong.sum())} such rows)")


def _lines_between(u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """The lines between the lines of two crosses, shapes (2, n), with the closest lines paired."""
    straight = line_difference(u[0], u[1]) + line_difference(v[0], v[1])
    crossed = line_difference(u[0], v[1]) + line_difference(v[0], u[1])
    swap = crossed < straight
    first, second = np.stack([u[0], v[0]]), np.where(swap, [v[1], u[1]], [u[1], v[1]])
    middle = line_of(double_angle(first) + double_angle(second))
    between = np.where(line_difference(first, second) < _OPPOSITE * 1e-9, first, middle)
    return between[0], between[1]
