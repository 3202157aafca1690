"""The surface of a triangle mesh as a domain: faces with frames, edges between them, rings around vertices.

The x axis of a face's frame is its first edge, its z axis the normal of its counter-clockwise side. Numbers
are equal on every processor: see angles.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from ..arguments import float_array, whole_numbers
from ..errors import MeshError
from .angles import arctangent, wrap
from .domain import Bools, Domain, Floats, Ints, Rings, Walks

MOST_FACES: Final = 2_000_000
_FARTHEST: Final = 1e30  # coordinates whose products are finite numbers
_THINNEST: Final = 1e-12  # height of a face relative to its longest edge, below which it has no normal
_DECIMALS: Final = 12  # of kappa
_PARALLEL: Final = 1e-8  # turns between frames up to here are 0: readers of files drop so small numbers
_SHOWN: Final = 8  # faces that an error lists


@dataclass(frozen=True, eq=False)
class Mesh(Domain):
    """Triangles with positions of their corners; neighbours share an edge.

    Points of the domain are faces. A pair is an inner edge: its first face has the edge from the lower to
    the higher vertex, its second face has it reversed. Pairs are ordered by their first face.

    Parameters
    ----------
    vertices
        Positions, float (v, 3).
    faces
        Numbers of the three vertices of each face, counter-clockwise seen from outside, int (n, 3).

    Raises
    ------
    MeshError
        For values that are no numbers. An `Instance` checks that they are a mesh.

    """

    vertices: Floats
    faces: Ints

    kind: ClassVar[str] = "face"
    side: ClassVar[int] = 1
    reference: ClassVar[int] = 1

    def __post_init__(self) -> None:
        """Store read-only copies in the documented types."""
        for name, convert in (("vertices", float_array), ("faces", whole_numbers)):
            array = convert(getattr(self, name), name, MeshError)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __repr__(self) -> str:
        return f"<Mesh: {len(self.faces)} faces, {len(self.vertices)} vertices>"

    def check(self) -> None:
        """Raise MeshError, with numbers of faces, unless the mesh is an oriented manifold of triangles."""
        self.check_arrays()
        longest = _length(self._sides).max(axis=1)
        _refuse(
            ~(2 * self.areas > _THINNEST * longest * longest),
            "no area in {}: two corners are one, or all lie on a line; merge close vertices and remove such "
            "faces",
        )
        _, number, count = np.unique(self.edge_keys[0], return_inverse=True, return_counts=True)
        if (count > 1).any() and self._is_one_sided():
            raise MeshError("is one-sided, as a Moebius strip is: it cannot be oriented; cut it open")
        _refuse(
            (count[number] > 1).reshape(-1, 3).any(axis=1),
            "{} go along the same edge in the same direction: they are turned against their neighbours, or "
            "more than two share it; orient all faces alike and remove inner walls",
        )
        used, count = np.unique(self.faces, return_counts=True)
        split = used[np.bincount(self._walk_around(used)[1], minlength=len(used)) != count]
        if len(split):
            _refuse(
                np.isin(self.faces, split).any(axis=1),
                f"{{}} touch others at vertex {split[0]} alone; "
                "split it, so that each vertex has one fan of faces",
            )

    def _is_one_sided(self) -> bool:
        """Whether neighbours disagree however faces are turned. False where an edge has more than two."""
        from scipy.sparse import coo_array  # not needed by programs that only read and write files
        from scipy.sparse.csgraph import connected_components

        edge = np.minimum(*self.edge_keys)
        order = np.argsort(edge, kind="stable")
        same = edge[order][1:] == edge[order][:-1]
        one, other = order[:-1][same], order[1:][same]
        turned = self._edges[0][one] == self._edges[0][other]
        # Two copies of each face, one turned, with the neighbours that agree with it.
        ends = np.concatenate([one, one]) // 3, np.concatenate([other, other]) // 3
        copies = np.repeat([0, self.size], len(one)), np.concatenate([turned, ~turned]) * self.size
        shape = (2 * self.size, 2 * self.size)
        graph = coo_array((np.ones(2 * len(one)), (ends[0] + copies[0], ends[1] + copies[1])), shape=shape)
        part = connected_components(graph, directed=False)[1]
        return not (same[1:] & same[:-1]).any() and bool((part[: self.size] == part[self.size :]).any())

    def check_arrays(self) -> None:
        """Raise MeshError for arrays of other shapes, vertices that do not exist, and infinite positions."""
        if self.vertices.ndim != 2 or self.vertices.shape[1] != 3 or self.faces.ndim != 2:
            raise MeshError("give vertices as (v, 3) and faces as (n, 3)")
        if not len(self.faces):
            raise MeshError("has no face; give a triangle mesh")
        if self.faces.shape[1] != 3:
            raise MeshError(f"has faces of {self.faces.shape[1]} corners; triangulate it")
        if len(self.faces) > MOST_FACES:
            raise MeshError(f"has {len(self.faces)} faces; at most {MOST_FACES} are allowed, simplify it")
        if not (np.abs(self.vertices) <= _FARTHEST).all():
            raise MeshError(f"has a coordinate that is not a number up to {_FARTHEST:g}")
        wrong = (self.faces < 0) | (self.faces >= len(self.vertices))
        _refuse(wrong.any(axis=1), "a vertex does not exist in {}")

    @property
    def size(self) -> int:
        """Number of faces n."""
        return len(self.faces)

    @cached_property
    def _edges(self) -> tuple[Ints, Ints]:
        """First and second vertex of each directed edge, (3 n,): edge 3 f + k leaves corner k of face f."""
        return self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel()

    @property
    def edge_keys(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """A number for each directed edge and for its reverse, (3 n,)."""
        start, end = (vertex.astype(np.int64) for vertex in self._edges)
        return start * len(self.vertices) + end, end * len(self.vertices) + start

    @cached_property
    def opposite(self) -> Ints:
        """The directed edge that is each one reversed, -1 at the boundary, (3 n,)."""
        key, reversed_key = self.edge_keys
        order = np.argsort(key, kind="stable")
        at = np.minimum(np.searchsorted(key[order], reversed_key), len(key) - 1)
        return np.where(key[order][at] == reversed_key, order[at], -1).astype(np.int32)

    @cached_property
    def pair_edges(self) -> Ints:
        """The directed edge of each pair that its first face has, shape (m,)."""
        start, end = self._edges
        return np.nonzero((self.opposite >= 0) & (start < end))[0].astype(np.int32)

    @cached_property
    def first(self) -> Ints:
        """Face i of each pair, shape (m,)."""
        return self.pair_edges // np.int32(3)

    @cached_property
    def second(self) -> Ints:
        """Face j of each pair, shape (m,)."""
        return np.asarray(self.opposite[self.pair_edges] // np.int32(3))

    @property
    def pair_vertices(self) -> Ints:
        """Lower and higher vertex of each pair's edge, shape (m, 2)."""
        return self.edge_vertices(self.pair_edges)

    @property
    def boundary(self) -> Ints:
        """The directed edges with a face on one side only, shape (b,): edge 3 f + k is in face f."""
        return np.nonzero(self.opposite < 0)[0].astype(np.int32)

    def edge_vertices(self, edges: Ints) -> Ints:
        """First and second vertex of directed edges, shape (k, 2)."""
        start, end = self._edges
        return np.stack([start[edges], end[edges]], axis=1)

    @property
    def _sides(self) -> Floats:
        """The edges that leave the three corners of each face, shape (n, 3, 3)."""
        corners = self.vertices[self.faces]
        return np.asarray(np.roll(corners, -1, axis=1) - corners)

    @cached_property
    def _cross(self) -> Floats:
        """Normal of each face times twice its area, shape (n, 3)."""
        sides = self._sides
        return np.cross(sides[:, 0], -sides[:, 2])

    @cached_property
    def normals(self) -> Floats:
        """Unit normal of each face, shape (n, 3)."""
        return _unit(self._cross)

    @cached_property
    def areas(self) -> Floats:
        """Area of each face, shape (n,)."""
        return np.asarray(_length(self._cross) / 2)

    @cached_property
    def frames(self) -> Floats:
        """Unit x and y axis of each face, shape (n, 2, 3)."""
        x = _unit(self._sides[:, 0])
        return np.stack([x, np.cross(self.normals, x)], axis=1)

    @cached_property
    def centres(self) -> Floats:
        """Mean of the corners of each face, shape (n, 3)."""
        corners = self.vertices[self.faces]
        return np.asarray((corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3)

    def angle_in(self, faces: Ints, vectors: Floats) -> Floats:
        """Angle of a vector (k, 3) in the frame of its face, projected to it, in (-pi, pi]; shape (k,)."""
        frames = self.frames[faces]
        return arctangent(_dot(frames[:, 1], vectors), _dot(frames[:, 0], vectors))

    def vectors(self, faces: Ints, angles: Floats) -> Floats:
        """Unit vectors (k, 3) of angles (k,) in the frames of their faces."""
        frames = self.frames[faces]
        return np.asarray(np.cos(angles)[:, None] * frames[:, 0] + np.sin(angles)[:, None] * frames[:, 1])

    @cached_property
    def kappa(self) -> Floats:
        """Angle of the common edge in face j less that in face i, shape (m,), in (-pi, pi]."""
        low, high = self.pair_vertices.T
        edge = self.vertices[high] - self.vertices[low]
        turn = self.angle_in(self.second, edge) - self.angle_in(self.first, edge)
        rounded = np.round(wrap(turn, -np.pi, 2 * np.pi), _DECIMALS)
        rounded = np.where(np.abs(rounded) < _PARALLEL, 0.0, rounded)
        return np.where(rounded <= -np.pi, rounded + 2 * np.pi, rounded)

    @cached_property
    def dihedral(self) -> Floats:
        """Angle between the normals of each pair of faces, in [0, pi], shape (m,)."""
        return _angle_between(self.normals[self.first], self.normals[self.second])

    @cached_property
    def dual_weights(self) -> Floats:
        """Length of each pair's edge over the distances of its middle from both centres, shape (m,)."""
        low, high = self.pair_vertices.T
        edge = self.vertices[high] - self.vertices[low]
        middle = (self.vertices[high] + self.vertices[low]) / 2
        across = [_length(self.centres[face] - middle) for face in (self.first, self.second)]
        return np.asarray(_length(edge) / sum(across))

    @cached_property
    def defect(self) -> Floats:
        """2 pi less the angles of the faces around each vertex, in radians, shape (v,)."""
        sides = self._sides
        angles = np.stack([_angle_between(sides[:, k], -sides[:, k - 1]) for k in range(3)], axis=1)
        around = np.bincount(self.faces.ravel(), angles.ravel(), len(self.vertices))
        return np.asarray(2 * np.pi - around)

    @cached_property
    def on_boundary(self) -> Bools:
        """Whether each vertex lies on the boundary or in no face, shape (v,)."""
        inner = np.zeros(len(self.vertices), dtype=bool)
        inner[self.faces.ravel()] = True
        start, end = self._edges
        inner[start[self.boundary]] = inner[end[self.boundary]] = False
        return ~inner

    @cached_property
    def ring_vertices(self) -> Ints:
        """The vertex of each ring, ascending, shape (r,)."""
        return np.nonzero(~self.on_boundary)[0].astype(np.int32)

    def _walk_around(self, vertices: Ints) -> tuple[Ints, Ints]:
        """The fan of faces around each vertex, counter-clockwise: directed edges that return to the vertex.

        Returns the edges of all vertices, (k,), and the place of each one's vertex in the list, (k,).
        """
        start, _ = self._edges
        first = np.full(len(self.vertices), -1, dtype=np.int32)
        first[start[::-1]] = np.arange(len(start) - 1, -1, -1, dtype=np.int32)
        first[start[self.boundary]] = self.boundary  # where an open fan begins
        place, begin, steps = (
            np.arange(len(vertices), dtype=np.int32),
            first[vertices],
            [np.zeros((2, 0), "i4")],
        )
        at = begin
        while len(place):
            incoming = at - at % 3 + (at + 2) % 3
            steps.append(np.stack([incoming, place]))
            at = self.opposite[incoming]
            open_ = (at >= 0) & (at != begin[place])
            place, at = place[open_], at[open_]
        edges, places = np.concatenate(steps, axis=1)
        order = np.argsort(places, kind="stable")
        return edges[order], places[order]

    @cached_property
    def rings(self) -> Rings:
        """The ring around each vertex of `ring_vertices`."""
        walks = self._pairs_around(self.ring_vertices)
        return Rings(walks.start, walks.pair, walks.sign, self.defect[self.ring_vertices])

    @property
    def fans(self) -> Walks:
        """The walk around each vertex on the boundary, from one boundary edge to the other."""
        return self._pairs_around(np.unique(self._edges[0][self.boundary]))

    def _pairs_around(self, vertices: Ints) -> Walks:
        """The walk around each vertex, counter-clockwise."""
        crossed, place = self._walk_around(vertices)
        inner = self.opposite[crossed] >= 0
        crossed, place = crossed[inner], place[inner]
        pair_of = np.full(3 * self.size, -1, dtype=np.int32)
        pair_of[self.pair_edges] = np.arange(len(self.pair_edges), dtype=np.int32)
        forward = pair_of[crossed] >= 0
        pair = np.where(forward, pair_of[crossed], pair_of[self.opposite[crossed]])
        start = np.searchsorted(place, np.arange(len(vertices) + 1)).astype(np.int32)
        return Walks(start, pair.astype(np.int32), np.where(forward, 1, -1).astype(np.int32))

    @property
    def euler_characteristic(self) -> int:
        """Vertices in use less edges plus faces."""
        vertices = len(np.unique(self.faces))
        return vertices - len(self.pair_edges) - len(self.boundary) + self.size

    @property
    def summary(self) -> str:
        """Faces, vertices, Euler characteristic, and parts if there are more than one."""
        parts = f" in {self.parts} separate parts" if self.parts > 1 else ""
        return (
            f"{self.size} faces{parts}, {len(self.vertices)} vertices, "
            f"Euler characteristic {self.euler_characteristic}"
        )

    @property
    def facts(self) -> dict[str, Any]:
        """Numbers of faces, vertices, pairs, boundary edges and parts, and the Euler characteristic."""
        return {
            "faces": self.size,
            "vertices": len(self.vertices),
            "pairs": len(self.pair_edges),
            "boundary_edges": len(self.boundary),
            "euler_characteristic": self.euler_characteristic,
            "parts": self.parts,
        }

    def places(self, points: Ints) -> Ints:
        """Numbers of faces, shape (k,)."""
        return points

    def content(self) -> tuple[list[int], list[float], list[NDArray[Any]]]:
        """Numbers of vertices and faces, and both arrays."""
        arrays = [self.vertices.astype("<f8"), self.faces.astype("<i4")]
        return [len(self.vertices), self.size], [], arrays


def _angle_between(one: Floats, other: Floats) -> Floats:
    """Angles between vectors (..., 3), in [0, pi]."""
    return arctangent(_length(np.cross(one, other)), _dot(one, other))


def _dot(one: Floats, other: Floats) -> Floats:
    """Scalar products of vectors (..., 3), summed from left to right."""
    return np.asarray(one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1] + one[..., 2] * other[..., 2])


def _length(vectors: Floats) -> Floats:
    return np.sqrt(_dot(vectors, vectors))


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / _length(vectors)[..., None])


def _refuse(wrong: Any, reason: str) -> None:
    """Raise MeshError, with the faces in the braces of the reason, if any of them is wrong, (n,)."""
    if wrong.any():
        raise MeshError(reason.format(list_faces(np.nonzero(wrong)[0])))


def list_faces(numbers: NDArray[Any]) -> str:
    """Numbers of faces for an error, the first ones of many."""
    unique = np.unique(numbers)
    text = ", ".join(map(str, unique[:_SHOWN].tolist()))
    more = f" and {len(unique) - _SHOWN} more" if len(unique) > _SHOWN else ""
    return f"face{'s' * (len(unique) > 1)} {text}{more}"
