"""Vertices at one place: joined in an STL, which has none in common, and elsewhere on demand."""

from __future__ import annotations

from typing import Final

import numpy as np

from ..errors import MeshError
from ..instance.domain import Floats, Ints
from ..instance.mesh import Mesh

_NEAR: Final = 0.01  # distance of vertices that should be one, in median edges of the boundary
NO_LINES: Final = np.zeros((0, 2), dtype=np.int32)


def first_at_places(points: Floats, distance: float = 0.0) -> Ints:
    """The first point (k,) at the place of each point (k, 3): equal ones, or chains of points this near."""
    places, first, place = np.unique(points + 0.0, axis=0, return_index=True, return_inverse=True)
    if distance > 0:
        from scipy.sparse import coo_array  # not needed by programs that only read and write files
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import KDTree

        one, other = KDTree(places).query_pairs(distance, output_type="ndarray").T
        graph = coo_array((np.ones(len(one)), (one, other)), shape=(len(places), len(places)))
        chain = connected_components(graph, directed=False)[1]
        least = np.full(len(places), len(points))
        np.minimum.at(least, chain, first)
        first = least[chain]
    return np.asarray(first[place.ravel()], dtype=np.int32)


def join_vertices(mesh: Mesh, lines: Ints, first: Ints) -> tuple[Mesh, Ints]:
    """The mesh and its polylines with another vertex (v,) in place of each; the order of faces stays."""
    kept = first == np.arange(len(first))
    number = (np.cumsum(kept) - 1)[first]
    return Mesh(mesh.vertices[kept], number[mesh.faces]), np.asarray(number[lines], dtype=np.int32)


def merge_vertices(mesh: Mesh, lines: Ints, distance: float) -> tuple[Mesh, Ints]:
    """The mesh and its polylines with vertices of the boundary joined that share a place.

    Raises MeshError for a distance at which edges of the boundary vanish.
    """
    mesh.check_arrays()
    shortest = _boundary_lengths(mesh).min(initial=np.inf)
    if distance >= shortest > 0:
        raise MeshError(f"has an edge of length {shortest:g} at its boundary; merge at a smaller distance")
    rim = np.nonzero(mesh.on_boundary)[0]
    first = np.arange(len(mesh.vertices), dtype=np.int32)
    first[rim] = rim[first_at_places(mesh.vertices[rim], distance)]
    merged, lines = join_vertices(mesh, lines, first)
    return merged, lines[lines[:, 0] != lines[:, 1]]


def _boundary_lengths(mesh: Mesh) -> Floats:
    ends = mesh.vertices[mesh.edge_vertices(mesh.boundary)]
    return np.asarray(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))


def note_shared_places(mesh: Mesh) -> tuple[str, ...]:
    """A note on vertices of the boundary that share a place or nearly do, if there are some."""
    from scipy.spatial import KDTree  # as above

    lengths, points = _boundary_lengths(mesh), mesh.vertices[np.unique(mesh.edge_vertices(mesh.boundary))]
    if not len(points):
        return ()
    places = np.unique(points + 0.0, axis=0)
    apart = KDTree(places).query(places, k=2)[0][:, 1]
    limit = min(_NEAR * np.median(lengths), lengths.min() / 2)
    largest = apart[apart <= limit].max(initial=0.0)
    distance = float(f"{1.1 * largest:.1e}")  # two digits, rounded upwards
    count = np.bincount(first_at_places(points, distance))
    if not (count > 1).any():
        return ()
    words = f"{count[count > 1].sum()} vertices share {(count > 1).sum()} places"
    words += f", up to {distance:g} apart" if distance else ""
    try:
        merge_vertices(mesh, NO_LINES, distance)[0].check()
    except MeshError as error:
        return (f"{words}, but joined they would make no mesh: {error}",)
    return (f"{words}; `crossfield instance --merge {distance:g}` joins them",)
