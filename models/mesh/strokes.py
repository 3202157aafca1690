"""Strokes on faces: along sharp edges, boundaries and polylines, and in given directions."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from ..arguments import whole_numbers
from ..errors import InputError, MeshError
from ..input_limits import MAX_BYTES
from ..instance.angles import HALF, arctangent, cosine, sine
from ..instance.domain import Bools, Floats, Ints
from ..instance.mesh import Mesh
from ..storage import read_bytes
from ..text_rows import filled_lines, number_rows, plain_text

_LEAST_AGREEMENT: Final = 0.5  # length of the mean of several directions, below which a face has no stroke
_EQUAL: Final = 1e-9  # degrees by which rounding may move an angle between faces
_HEADS: Final = {".rawfield": 1, ".rosy": 2}  # lines before the vectors of every face
_UPRIGHT: Final = 1e-6  # share of a vector that must lie in its face
_DECIMALS: Final = 9  # of lengths of means, so that ties are decided alike on every processor


def feature_edges(mesh: Mesh, *, sharp: float | None, boundary: bool, lines: Ints) -> Ints:
    """Directed edges with a stroke on the face that has them, (k,).

    sharp: least angle in degrees between the normals of the two faces of an edge, None for none. boundary:
    whether edges of one face only count. lines: vertices (k, 2) of more edges. Raises MeshError for a line
    that is no edge of the mesh.
    """
    at = np.zeros(0, np.int32) if sharp is None else np.degrees(mesh.dihedral) >= sharp - _EQUAL
    keys, (low, high) = np.minimum(*mesh.edge_keys), np.sort(lines.astype(np.int64), axis=1).T
    of_lines = low * len(mesh.vertices) + high
    missing = ~np.isin(of_lines, keys)
    if missing.any():
        one, other = lines[int(np.argmax(missing))] + 1
        raise MeshError(
            f"a polyline goes from vertex {one} to vertex {other} (from 1), which no edge of a face joins "
            f"({int(missing.sum())} in all); draw polylines along edges"
        )
    of_boundary = keys[mesh.boundary] if boundary else keys[:0]
    chosen = np.concatenate([keys[mesh.pair_edges[at]], of_boundary, of_lines])
    return np.nonzero(np.isin(keys, chosen))[0].astype(np.int32)


def read_directions(path: Path, mesh: Mesh) -> tuple[Ints, Floats, Floats]:
    """Faces (k,), directions (k, 3) and weights (k,) in a table `face,x,y,z` or `face,x,y,z,weight` (CSV), or
    the first vectors of a .rawfield or .rosy.

    A vector of length 0 or weight 0 is no direction. Raises InputError that names a row or a face.
    """
    rows = filled_lines(plain_text(read_bytes(path, MAX_BYTES)))
    heads = _HEADS.get(path.suffix.lower(), 0)
    starts_with_words = bool(rows) and rows[0][1].lstrip()[:1] not in b"+-.0123456789"
    rows = rows[heads or starts_with_words :]
    if not rows:
        raise InputError("has no row of numbers; give face,x,y,z, or leave it out")
    if heads:
        table = np.c_[np.arange(len(rows)), number_rows(rows, 3, "x y z of a vector", more=True)]
    else:
        separator = b";" if b";" in rows[0][1] else b","  # beside semicolons, commas are decimal
        cells = [(number, line.split(separator)) for number, line in rows]
        rows = [(number, b" ".join(cell.strip() or b"nothing" for cell in row)) for number, row in cells]
        width = 5 if len(rows[0][1].split()) == 5 else 4
        table = number_rows(rows, width, "face,x,y,z" if width == 4 else "face,x,y,z,weight")
    if table.shape[1] == 4:
        table = np.c_[table, np.ones(len(table))]
    number, x, y, z, weight = table.T
    face, vector = whole_numbers(number, "the column of faces", InputError), np.stack([x, y, z], axis=1)
    if heads and len(face) != mesh.size:
        raise InputError(f"has {len(face)} rows of vectors for {mesh.size} faces; give one row per face")
    size = np.abs(vector).max(axis=1, initial=0)
    _refuse((face < 0) | (face >= mesh.size), face, "does not exist")
    _refuse(~np.isfinite(size), face, "has a vector that is not finite")
    _refuse(~((weight >= 0) & (weight <= 1)), face, "has a weight that is not from 0 to 1")
    kept = (size > 0) & (weight > 0)
    face, vector, weight = face[kept], vector[kept] / size[kept, None], weight[kept]
    inside = np.abs(np.einsum("kac,kc->ka", mesh.frames[face], vector)).max(axis=1, initial=0)
    _refuse(inside < _UPRIGHT, face, "has a vector at right angles to it, which has no direction there")
    return face, vector, weight


def _refuse(wrong: Bools, face: Ints, reason: str) -> None:
    if wrong.any():
        raise InputError(f"face {face[int(np.argmax(wrong))]}: {reason} ({int(wrong.sum())} such faces)")


def combine_strokes(
    mesh: Mesh, edges: Ints, directions: tuple[Ints, Floats, Floats] | None
) -> tuple[Ints, Floats, Floats, Ints]:
    """One stroke for each face with directions: of edges (k,), whose weight is 1, and given ones.

    Returns the face, the direction theta in its frame and the reliability w of each stroke, (s,); and faces
    without a stroke because their directions cancel each other, (k,).

    Directions that differ by a right angle agree. Of several, the stroke has the weighted mean, by the
    fourfold angle. Its reliability is the length of this mean times the greatest weight; if the length is
    below 1/2, there is no stroke. Of the four directions of the mean it has the one nearest to a given
    direction, or to that of the edge with the lowest vertices.
    """
    ends = np.sort(mesh.edge_vertices(edges), axis=1)
    face = edges // np.int32(3)
    order = np.lexsort((ends[:, 1], ends[:, 0], face))
    face = face[order]
    vector = (mesh.vertices[ends[:, 1]] - mesh.vertices[ends[:, 0]])[order]
    weight = np.ones(len(face))
    if directions is not None:
        face, vector = np.append(directions[0], face), np.concatenate([directions[1], vector])
        weight = np.append(directions[2], weight)
    theta = mesh.angle_in(face, vector)
    faces, first, count = np.unique(face, return_index=True, return_counts=True)
    number = np.searchsorted(faces, face)
    along, across = (
        np.bincount(number, weight * wave(4 * theta), len(faces)).astype(np.float64)
        for wave in (cosine, sine)
    )
    total = np.bincount(number, weight, len(faces))
    length = np.round(np.sqrt(along * along + across * across) / total, _DECIMALS)
    greatest = np.zeros(len(faces))
    np.maximum.at(greatest, number, weight)
    mean = arctangent(across, along) / 4
    mean = mean + HALF * np.round((theta[first] - mean) / HALF)
    single = count == 1
    theta, w = np.where(single, theta[first], mean), np.where(single, 1.0, np.minimum(length, 1.0)) * greatest
    kept = single | (length >= _LEAST_AGREEMENT)
    return faces[kept], theta[kept], w[kept], faces[~kept]
