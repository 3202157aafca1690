"""The built-in meshes: parts with sharp edges, sheets with holes, smooth surfaces, computed exactly."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..instance.angles import cosine, sine
from ..instance.domain import Bools, Floats
from ..instance.mesh import Mesh

_DECIMALS: Final = 9  # of coordinates
_ROUNDS: Final = 40  # of smoothing after round holes are cut


def disc(rings: int) -> Mesh:
    """A flat disc of 6 rings^2 faces."""
    return _sheet(6, rings, lambda sector, step: _on_circle((sector + step) / 6))


def star(rings: int) -> Mesh:
    """A flat star with five points, of 10 rings^2 faces."""
    corners = _on_circle(np.arange(10) / 10) * np.where(np.arange(10) % 2, 0.5, 1.0)[:, None]

    def between(sector: Floats, step: Floats) -> Floats:
        first, part = corners[sector.astype(int)], step[:, None]
        return np.asarray((1 - part) * first + part * corners[(sector.astype(int) + 1) % 10])

    return _sheet(10, rings, between)


def plate(across: int, up: int, holes: list[tuple[float, float, float]]) -> Mesh:
    """A flat plate of squares with round holes. holes: centre and radius of each, in squares."""
    x, y = np.meshgrid(np.arange(across + 1.0), np.arange(up + 1.0), indexing="ij")
    points, inside = np.stack([x.ravel(), y.ravel()], axis=1), np.ones((across, up), dtype=bool)
    for cx, cy, radius in holes:
        inside &= (x[:-1, :-1] + 0.5 - cx) ** 2 + (y[:-1, :-1] + 0.5 - cy) ** 2 > radius**2
    shape = (across + 1, up + 1)
    faces = _split_squares(shape, (False, False), inside)
    flat = Mesh(np.zeros((len(points), 3)), faces.astype(np.int32))
    fixed = flat.on_boundary & np.isin(np.arange(len(points)), faces)
    for cx, cy, radius in holes:
        away = points - (cx, cy)
        distance = np.sqrt((away * away).sum(axis=1))
        rim = fixed & (distance < radius + 1.5)
        points[rim] = (cx, cy) + away[rim] * (radius / distance[rim])[:, None]
    # A square with three corners on a hole is split at the middle one, so that no face lies in the hole.
    corner = fixed.reshape(shape)
    even = np.add.outer(np.arange(across), np.arange(up)) % 2 == 1
    full = corner[:-1, :-1].astype(int) + corner[1:, :-1] + corner[1:, 1:] + corner[:-1, 1:] == 3
    even = np.where(full, ~(corner[:-1, :-1] & corner[1:, 1:]), even)
    faces = _split_squares(shape, (False, False), inside, even[inside])
    return _mesh(_smooth(points, faces, fixed), faces)


def annulus(around: int, across: int) -> Mesh:
    """A flat ring with radii 1 and 2."""
    turn, part = np.meshgrid(np.arange(around) / around, np.arange(across + 1) / across, indexing="ij")
    points = _on_circle(turn.ravel()) * (2 - part.ravel())[:, None]
    return _mesh(points, _split_squares((around, across + 1), (True, False)))


def bumpy_cylinder(around: int, up: int) -> Mesh:
    """An open cylinder with a bump on one side."""
    turn, height = np.meshgrid(np.arange(around) / around, np.linspace(0, 2, up + 1), indexing="ij")
    from_bump = (2 * np.pi * (turn - 0.5)) ** 2 + (height - 1) ** 2
    points = _on_circle(turn.ravel()) * (1 + 0.5 / (1 + 2 * from_bump.ravel()) ** 2)[:, None]
    points = np.column_stack([points, height.ravel()])
    return _mesh(points, _split_squares((around, up + 1), (True, False)))


def torus(around: int, through: int, *, half: bool = False) -> Mesh:
    """A torus with radii 1 and 0.4, or half of it."""
    turns = np.linspace(0, 0.5, around + 1) if half else np.arange(around) / around
    turn, tube = np.meshgrid(turns, np.arange(through) / through, indexing="ij")
    section = 0.4 * _on_circle(tube.ravel())
    points = np.column_stack([_on_circle(turn.ravel()) * (1 + section[:, :1]), section[:, 1]])
    return _mesh(points, _split_squares(turn.shape, (not half, True)))


def blocks(filled: Bools) -> Mesh:
    """The surface of a body of unit cubes, filled (x, y, z), with two faces for each side of a cube."""
    padded = np.pad(filled, 1)
    corners: list[NDArray[np.int64]] = []
    faces: list[NDArray[np.int64]] = []
    for axis in range(3):
        for sign in (1, -1):
            cell = np.argwhere(padded & ~np.roll(padded, -sign, axis))
            one, other = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]][::sign]
            base = cell + (np.eye(3, dtype=int)[axis] if sign > 0 else 0)
            square = np.stack([base, base + one, base + one + other, base + other], axis=1)
            start = 4 * sum(len(part) for part in corners)
            number = start + 4 * np.arange(len(square))[:, None]
            even = (cell.sum(axis=1) - cell[:, axis]) % 2 == 0
            halves = np.where(even[:, None], [[0, 1, 2, 0, 2, 3]], [[0, 1, 3, 1, 2, 3]])
            corners.append(square)
            faces.append((number + halves).reshape(-1, 3))
    vertices, place = np.unique(np.concatenate(corners).reshape(-1, 3), axis=0, return_inverse=True)
    return _mesh(vertices.astype(np.float64), place.ravel()[np.concatenate(faces)])


def extrude(flat: Mesh, height: float, layers: int) -> Mesh:
    """The body over a flat mesh, with as many layers of squares on its walls."""
    size = len(flat.vertices)
    rim = flat.edge_vertices(flat.boundary)
    level = size * np.arange(layers)[:, None, None] + rim
    walls = np.concatenate(
        [
            np.concatenate([level, level[..., 1:] + size], axis=-1),
            np.concatenate([level[..., :1], level[..., ::-1] + size], axis=-1),
        ]
    ).reshape(-1, 3)
    points = np.tile(flat.vertices, (layers + 1, 1))
    points[:, 2] = np.repeat(height * np.arange(layers + 1) / layers, size)
    faces = np.concatenate([flat.faces[:, ::-1], flat.faces + layers * size, walls])
    used, place = np.unique(faces, return_inverse=True)
    return _mesh(points[used], place.reshape(-1, 3))


def warp(mesh: Mesh, *, turn: float = 0.0, narrowing: float = 0.0) -> Mesh:
    """The mesh turned about the z axis, and narrowed towards its top.

    turn: radians per unit of height. narrowing: by which share of its width.
    """
    low, high, z = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0), mesh.vertices[:, 2]
    x, y = (mesh.vertices - (low + high) / 2)[:, :2].T * (1 - narrowing * (z - low[2]) / (high[2] - low[2]))
    along, across = cosine(turn * z), sine(turn * z)
    points = np.stack([x * along - y * across, x * across + y * along, z], axis=1)
    return _mesh(points, mesh.faces.astype(np.int64))


def side_by_side(meshes: list[Mesh]) -> Mesh:
    """Meshes next to each other along x, as parts of one."""
    points, faces, right, count = [], [], 0.0, 0
    for mesh in meshes:
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        points.append(mesh.vertices + np.array([right - low[0], 0.0, 0.0]))
        faces.append(mesh.faces + count)
        right, count = right + high[0] - low[0] + 0.5, count + len(mesh.vertices)
    return _mesh(np.concatenate(points), np.concatenate(faces))


def _bracket() -> Mesh:
    """Two plates at a right angle, one with a rectangular window."""
    filled = np.zeros((10, 8, 9), dtype=bool)
    filled[:, :, :2] = filled[:2] = True
    filled[5:8, 3:5] = False
    return blocks(filled)


def _stairs() -> Mesh:
    step = np.arange(12) // 3
    return blocks(np.repeat(step[:, None, None] >= step, 7, axis=1))


MESHES: Final[dict[str, tuple[str, Callable[[], Mesh]]]] = {
    "disc": ("a flat disc", lambda: disc(3)),
    "star": ("a flat star with five points", lambda: star(8)),
    "plate": ("a flat plate with two round holes", lambda: plate(30, 20, [(9, 11, 3.5), (21, 8, 3)])),
    "cube": ("a cube", lambda: blocks(np.ones((6, 6, 6), dtype=bool))),
    "bracket": ("two plates at an angle, one with a window, twisted", lambda: warp(_bracket(), turn=0.03)),
    "stairs": ("four steps, narrower at the top", lambda: warp(_stairs(), narrowing=0.5)),
    "pin": ("a cylinder with two caps", lambda: extrude(disc(5), 2.0, 8)),
    "flange": ("a thick ring with sharp edges", lambda: extrude(annulus(32, 5), 0.8, 4)),
    "gear": ("a thick star with sharp edges", lambda: extrude(star(10), 0.5, 5)),
    "bump": ("an open cylinder with a bump on one side", lambda: bumpy_cylinder(24, 11)),
    "half_torus": ("half a torus, open at both ends", lambda: torus(24, 12, half=True)),
    "doughnut": ("a torus without strokes", lambda: torus(8, 4)),
    "three_parts": (
        "a cube, a torus and a disc apart",
        lambda: side_by_side([blocks(np.ones((3, 3, 3), dtype=bool)), torus(8, 4), disc(3)]),
    ),
}
"""One line about each built-in mesh, and the function that makes it."""


def _on_circle(turns: Floats) -> Floats:
    """Points (k, 2) of the unit circle at turns (k,)."""
    return np.stack([cosine(2 * np.pi * turns), sine(2 * np.pi * turns)], axis=-1)


def _sheet(sectors: int, rings: int, outline: Callable[[Floats, Floats], Floats]) -> Mesh:
    """A flat sheet round the origin: ring k of `rings` is the outline scaled to k / rings.

    outline: points (m, 2) for numbers of sectors (m,) and parts of them in [0, 1) (m,).
    """
    points, faces = [np.zeros((1, 2))], []
    for ring in range(1, rings + 1):
        sector, step = np.divmod(np.arange(sectors * ring), ring)
        points.append(outline(sector.astype(np.float64), step / ring) * (ring / rings))
        inner, outer = 1 + sectors * (ring - 1) * (ring - 2) // 2, 1 + sectors * ring * (ring - 1) // 2
        at = outer + np.arange(sectors * ring)
        after = outer + (np.arange(sectors * ring) + 1) % (sectors * ring)
        below = _inner_vertices(sector * (ring - 1) + step, sectors * (ring - 1), inner)
        faces.append(np.stack([below, at, after], axis=1))
        straight = step < ring - 1
        beside = _inner_vertices(sector * (ring - 1) + step + 1, sectors * (ring - 1), inner)
        faces.append(np.stack([below, after, beside], axis=1)[straight])
    return _mesh(np.concatenate(points), np.concatenate(faces))


def _inner_vertices(place: NDArray[np.int64], count: int, start: int) -> NDArray[np.int64]:
    """Vertices at places of a ring of `count` that begins at `start`; the centre for the first ring."""
    return start + place % count if count else np.zeros_like(place)


def _split_squares(
    shape: tuple[int, ...],
    closed: tuple[bool, bool],
    inside: Bools | None = None,
    even: Bools | None = None,
) -> NDArray[np.int64]:
    """Two triangles for each square of a table of vertices, with alternating diagonals.

    closed: whether the last row and the last column continue with the first. inside: squares to keep. even:
    which of these have the diagonal from their first corner.
    """
    rows, columns = (count - (not close) for count, close in zip(shape, closed, strict=True))
    i, j = np.nonzero(np.ones((rows, columns), dtype=bool) if inside is None else inside)
    down, right = (i + 1) % shape[0], (j + 1) % shape[1]
    a, b, c, d = (r * shape[1] + q for r, q in ((i, j), (down, j), (down, right), (i, right)))
    even = (i + j) % 2 == 1 if even is None else even
    one = np.where(even, [a, b, c], [a, b, d])
    other = np.where(even, [a, c, d], [b, c, d])
    return np.concatenate([one.T, other.T])


def _smooth(points: Floats, faces: NDArray[np.int64], fixed: Bools) -> Floats:
    """The points after rounds that move each one to the mean of its neighbours; fixed ones stay."""
    start = np.concatenate([faces.ravel(), np.roll(faces, -1, axis=1).ravel()])
    end = np.concatenate([np.roll(faces, -1, axis=1).ravel(), faces.ravel()])
    count = np.maximum(np.bincount(start, minlength=len(points)), 1)
    for _ in range(_ROUNDS):
        mean = np.stack([np.bincount(start, points[end, k], len(points)) / count for k in range(2)], axis=1)
        points = np.where(fixed[:, None], points, mean)
    return points


def _mesh(points: Floats, faces: NDArray[np.int64]) -> Mesh:
    """The mesh of rounded points (k, 2 or 3), without points in no face."""
    used, place = np.unique(faces, return_inverse=True)
    spatial = np.zeros((len(used), 3))
    spatial[:, : points.shape[1]] = np.round(points[used], _DECIMALS) + 0.0
    return Mesh(spatial, place.reshape(-1, 3).astype(np.int32))
