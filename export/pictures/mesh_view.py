"""A mesh with its strokes, crosses and singularities, seen from where most of them show."""

from __future__ import annotations

from base64 import b64encode
from itertools import product
from typing import Any, Final

import numpy as np

from ...models.field.field import CrossField
from ...models.field.triangles import vectors_of
from ...models.instance.domain import Bools, Floats, Ints
from ...models.instance.instance import Instance
from ...models.instance.mesh import Mesh
from .marks import FAMILIES, NEGATIVE, PAPER, POSITIVE, STROKE, Polygons

SHARP: Final = np.radians(30)  # angle between two faces from which their edge is drawn dark
MOST_CROSSES: Final = 3000  # faces in view with a cross; of more, and of small ones, some stand for others
MOST_TURNED: Final = 6000  # faces of a model that a page turns: more would exceed 200 kB
_LIGHT: Final = np.array([0.35, 0.45, 0.82])  # towards the lamp, in the viewer's frame
_PAPER: Final = 0.97  # brightness of a face towards the lamp
_SHADE: Final = 0.30  # of which a face away from it loses this much
_RIM: Final = 0.25  # width of the edges of faces, in units of the picture
_MARGIN: Final = 0.03  # of the side of the picture
_DARK: Final = "#404040"
_ARM: Final = 0.40  # half the length of a line of a cross, in roots of its share of the area
_WIDTH: Final = 0.055  # of a line of a cross, in the same unit
_DOT: Final = 0.016  # radius of a dot, in sides of the picture


AXES: Final = ("z", "x", "y")  # after so many turns of the axes, each is the third one


def find_view(mesh: Mesh, marked: Floats, up: str = "z") -> Floats:
    """Unit vectors (3, 3) to the right, upwards and to the viewer, on one of 26 sides of a mesh.

    From there most marked normals (k, 3) and most of the area show. up: the axis that points upwards.
    """
    turns = -AXES.index(up)
    vertices, normals, marked = (np.roll(array, turns, 1) for array in (mesh.vertices, mesh.normals, marked))
    tilted = np.array([1.0, 0.8, 0.7])  # no face of a box is seen from its edge
    sides = [tilted * side for side in product((1, -1, 0.2), repeat=3) if side != (0.2, 0.2, 0.2)]

    def score(side: Floats) -> float:
        direction = side / np.linalg.norm(side)
        front = np.clip(normals @ direction, 0, None)
        seen = (marked @ direction > 0.25).mean() if len(marked) else 0.0
        area = np.minimum(front, 0.6) @ mesh.areas / mesh.areas.sum()
        return round(float(0.5 * seen + area + 0.05 * direction[2]), 9)

    z, is_flat = np.array([0.0, 0.0, 1.0]), np.ptp(vertices[:, 2]) == 0
    side = z if is_flat else max(sides, key=score)
    forward = side / np.linalg.norm(side)
    right = np.cross(np.array([0.0, 1.0, 0.0]) if is_flat else z, forward)
    right /= np.linalg.norm(right)
    return np.roll(np.stack([right, np.cross(forward, right), forward]), -turns, axis=1)


def draw_mesh(subject: CrossField | Instance, side: float, up: str = "z") -> Polygons:
    """A field or an instance on a mesh, from far to near, on a square page of that side.

    up: the axis that points upwards.
    """
    field = subject if isinstance(subject, CrossField) else None
    instance = subject if isinstance(subject, Instance) else subject.instance
    mesh = instance.mesh
    vertex, turns = np.zeros(0, dtype=np.int32), np.zeros(0)
    if field is not None:
        vertex, turns = field.singularities.vertex, field.singularities.index
    to_viewer = find_view(mesh, _vertex_normals(mesh)[vertex], up).T
    points, towards = mesh.vertices @ to_viewer, mesh.normals @ to_viewer
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    reach, corners = float((high - low).max()), points[mesh.faces]
    shown = np.ones(mesh.size, dtype=bool) if len(mesh.boundary) else towards[:, 2] > 0
    shapes = [*corners[shown][:, :, :2]]
    colours, depth = _shades(towards[shown]), [corners[shown][:, :, 2].mean(axis=1)]

    def add(polygons: Floats, depths: Floats, colour: str) -> None:
        shapes.extend(polygons)
        depth.append(depths)
        colours.extend([(colour, "none")] * len(polygons))

    for ends, colour, width, above in _line_marks(mesh, field, instance, shown):
        flat = ends @ to_viewer
        add(_strips(flat[:, :, :2], width), flat[:, :, 2].mean(axis=1) + above * reach, colour)
    radius = _DOT * reach * np.where(np.abs(turns) < 0.5, 1.0, 1.4)
    for colour, some in ((POSITIVE, turns > 0), (NEGATIVE, turns < 0)):
        place, height = points[vertex[some], :2], points[vertex[some], 2] + 2 * _DOT * reach
        for paint, part, above in ((PAPER, 1.25, 0.0), (colour, 1.0, 1e-6 * reach)):
            circle = part * radius[some, None, None] * _CIRCLE
            add(place[:, None] + circle, height + above, paint)
    nearest = np.argsort(np.concatenate(depth), kind="stable").tolist()
    scale, middle = (1 - 2 * _MARGIN) * side / reach, (low + high) / 2
    placed = [side / 2 + scale * (shapes[number] - middle) * (1, -1) for number in nearest]
    return Polygons(placed, [colours[number] for number in nearest], _RIM)


_CIRCLE: Final = np.stack([np.cos(np.arange(24) * np.pi / 12), np.sin(np.arange(24) * np.pi / 12)], axis=1)


def _line_marks(
    mesh: Mesh, field: CrossField | None, instance: Instance, shown: Bools
) -> list[tuple[Floats, str, float, float]]:
    """Segments (k, 2, 3) of lines, their colour, width, and by how much they lie above the faces."""
    size = np.sqrt(mesh.areas)
    typical = float(np.median(size))
    marks = [(mesh.vertices[_dark_edges(mesh)], _DARK, 0.6 * _WIDTH * typical, 2e-3)]
    if field is not None:
        inside = np.nonzero(shown)[0].astype(np.int32)
        share = mesh.areas[inside].sum() / MOST_CROSSES  # of the area, which has one cross at most
        faces = inside[np.diff(np.cumsum(mesh.areas[inside]) // share, prepend=-1) > 0]
        size, width = np.maximum(size, np.sqrt(share)), _WIDTH * max(typical, np.sqrt(share))
        lines = list(zip(vectors_of(field)[faces].swapaxes(0, 1), _colours_of_lines(instance), strict=True))
    else:
        seen = shown[instance.stroke_index]
        faces, width = instance.stroke_index[seen], 1.5 * _WIDTH * typical
        lines = [(mesh.vectors(faces, instance.theta[seen]), STROKE)]
    for vectors, colour in lines:
        reach = _ARM * size[faces, None] * vectors
        ends = np.stack([mesh.centres[faces] - reach, mesh.centres[faces] + reach], axis=1)
        marks.append((ends, colour, width, 1e-3))
    return marks


def _colours_of_lines(instance: Instance) -> tuple[str, str]:
    """The colours of u and v: one where crosses are orthogonal, for then their lines are alike."""
    return (FAMILIES[0], FAMILIES[0]) if instance.orthogonal else FAMILIES


def _dark_edges(mesh: Mesh) -> Ints:
    """Both vertices of each sharp edge and of each edge of the boundary, (k, 2)."""
    sharp = mesh.dihedral > SHARP
    return np.concatenate([mesh.pair_vertices[sharp], mesh.edge_vertices(mesh.boundary)])


def _vertex_normals(mesh: Mesh) -> Floats:
    """Normal of each vertex: the mean of those of its faces, by area, (v, 3)."""
    weighted = mesh.normals * mesh.areas[:, None]
    total = np.zeros_like(mesh.vertices)
    for corner in range(3):
        np.add.at(total, mesh.faces[:, corner], weighted)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1), 1e-300)[:, None])


def _shades(normals: Floats) -> list[tuple[str, str]]:
    """Greys of faces with normals in the viewer's frame and of their edges; back sides are lit, too."""
    light = np.abs(normals @ (_LIGHT / np.linalg.norm(_LIGHT)))
    grey = 255 * (_PAPER - _SHADE * (1 - light))
    return [("#" + 3 * f"{inside:02x}", "#" + 3 * f"{int(0.91 * inside):02x}") for inside in grey.astype(int)]


def _strips(segments: Floats, width: float) -> Floats:
    """Segments (k, 2, 2) as rectangles (k, 4, 2)."""
    along = segments[:, 1] - segments[:, 0]
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    across = width / 2 * np.stack([-along[:, 1], along[:, 0]], axis=1) / length
    start, end = segments[:, 0], segments[:, 1]
    return np.stack([start - across, end - across, end + across, start + across], axis=1)


def model_data(field: CrossField) -> dict[str, Any] | None:
    """A field on a mesh for the page that turns it (templates/run/model.html.j2); None if it is too large.

    Arrays are base64 of little-endian numbers: positions of vertices as 16 bits, directions as 8 bits.
    """
    mesh, singular = field.instance.mesh, field.singularities
    if mesh.size > MOST_TURNED:
        return None
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    reach = np.linalg.norm(mesh.vertices - (low + high) / 2, axis=1).max()
    wide, (u, v) = len(mesh.vertices) > 2**16, _colours_of_lines(field.instance)
    number = "<u4" if wide else "<u2"
    arrays = {
        "vertices": np.round((mesh.vertices - (low + high) / 2) / reach * 32767).astype("<i2"),
        "faces": mesh.faces.astype(number),
        "lines": np.round(127 * vectors_of(field)).astype("i1"),
        "edges": _dark_edges(mesh).astype(number),
        "dots": singular.vertex.astype(number),
        "turns": np.round(4 * singular.index).astype("i1"),
    }
    axes = find_view(mesh, _vertex_normals(mesh)[singular.vertex])
    return {name: b64encode(array.tobytes()).decode() for name, array in arrays.items()} | {
        "wide": wide,
        "closed": not len(mesh.boundary),
        "axes": np.round(axes, 6).tolist(),
        "u": u,
        "v": v,
        "positive": POSITIVE,
        "negative": NEGATIVE,
    }
