"""Meshes as instances: faces with strokes along features, of files and of the built-in meshes."""

from __future__ import annotations

from pathlib import Path
from typing import Final, Literal, get_args

import numpy as np

from ..arguments import check_choice, check_flag
from ..errors import InputError, naming
from ..instance.instance import MOST_WEIGHT, STROKE_WEIGHT, Gauge, Instance, Reading, name_from_text
from ..instance.mesh import list_faces
from .formats import read_mesh_file, unpacked_name
from .shapes import MESHES
from .sharp_edges import read_sharp_edges
from .strokes import combine_strokes, feature_edges, read_directions
from .vertices import NO_LINES, merge_vertices, note_shared_places

PairWeights = Literal["unit", "dual"]
PAIR_WEIGHTS: Final[tuple[PairWeights, ...]] = get_args(PairWeights)
_SHARP: Final = 35.0  # degrees between two faces of a built-in mesh from which their edge is a stroke on both
_SMOOTH: Final = frozenset({"bump", "half_torus", "doughnut"})  # their edges bend a coarse smooth surface


def read_mesh(
    path: str | Path,
    *,
    sharp: float | None = None,
    boundary: bool = True,
    directions: str | Path | None = None,
    weights: PairWeights = "unit",
    sharp_weight: float = 1.0,
    merge: float | None = None,
    orthogonal: bool = True,
    name: str | None = None,
    gauge: Gauge = "strokes",
) -> Instance:
    """Read a triangle mesh as an instance, one cross per face.

    Strokes lie on the faces at sharp edges, boundaries and polylines (`l` elements) of an OBJ, and on faces
    with given directions. A face with several of them gets their mean, for crosses of right angles. Strokes
    have the weight 20.

    Parameters
    ----------
    path
        File: .obj, .ply, .off or .stl, plain or packed (.gz). Of an .stl, equal corners are one vertex.
    sharp
        Angle in degrees between the normals of two faces from which their edge is a stroke on both, 0 for
        all edges; None for no such strokes.
    boundary
        Whether boundary edges are strokes.
    directions
        File of directions in space: a table (CSV) with a heading and rows face, x, y, z, faces from 0, and
        optionally a weight from 0 to 1; or a .rawfield or .rosy, whose first vectors count. Vectors are
        projected to their faces. Or a .sharp of QuadWild: its edges are strokes on both sides.
    weights
        Weights of pairs in the smoothness: 1 (`unit`), or the length of the edge over the distance of the
        centres (`dual`).
    sharp_weight
        Factor of these weights where an edge with strokes separates the two faces, above 0, at most 1e6. A
        small one, such as 1e-6, lets the crosses on both sides turn apart.
    merge
        Distance up to which vertices of the boundary become one, 0 for those at the same place; None for no
        merging. Vertices get other numbers; faces keep theirs, so that files about faces stay valid.
    orthogonal
        Whether all crosses have right angles.
    name
        Name of the instance; by default made from the file name.
    gauge
        Window of alpha, as in `Instance`.

    Raises
    ------
    InputError
        For an unreadable file, and directions that do not fit.
    MeshError
        For a mesh that is no oriented manifold of triangles; the message names faces and a remedy.

    """
    path = Path(path)
    check_flag("boundary", boundary)
    if sharp is not None and not 0 <= sharp <= 180:
        raise InputError(f"sharp is {sharp}; give degrees from 0 to 180")
    if merge is not None and not 0 <= merge < np.inf:
        raise InputError(f"merge is {merge}; give a distance, 0 for equal places")
    check_choice("kind of weights", weights, PAIR_WEIGHTS)
    if not 0 < sharp_weight <= MOST_WEIGHT:
        raise InputError(
            f"sharp_weight is {sharp_weight}; give a number above 0, at most {MOST_WEIGHT:g}; 1e-6 nearly "
            "separates both sides"
        )
    with naming(path):
        mesh, lines, warnings = read_mesh_file(path)
        if merge is not None:
            mesh, lines = merge_vertices(mesh, lines, merge)
        mesh.check()
        warnings += note_shared_places(mesh)
    directed = None
    if directions is not None:
        with naming(directions):
            if Path(directions).suffix.lower() == ".sharp":
                lines = np.append(lines, read_sharp_edges(Path(directions), mesh), axis=0)
            else:
                directed = read_directions(Path(directions), mesh)
    with naming(path):
        edges = feature_edges(mesh, sharp=sharp, boundary=boundary, lines=lines)
    pair_weights = mesh.dual_weights if weights == "dual" else None
    across = np.isin(mesh.pair_edges, edges)
    if sharp_weight != 1 and across.any():
        pair_weights = np.where(across, sharp_weight, 1.0) * (1.0 if pair_weights is None else pair_weights)
    *strokes, contradictory = combine_strokes(mesh, edges, directed)
    if len(contradictory):
        warnings += (f"no stroke on {list_faces(contradictory)}, where directions cancel out",)
    return Instance.on_faces(
        name or name_from_text(unpacked_name(path).stem, "mesh"),
        mesh,
        *strokes,
        stroke_coefficient=STROKE_WEIGHT,
        orthogonal=orthogonal,
        pair_weights=pair_weights,
        gauge=gauge,
        source=path.name,
        reading=Reading(None, warnings, edges),
    )


def mesh_sample(name: str, gauge: Gauge, stroke_weight: float) -> Instance:
    """Instance of a built-in mesh. Raises InstanceError for a weight that is out of range."""
    mesh = MESHES[name][1]()
    edges = feature_edges(mesh, sharp=None if name in _SMOOTH else _SHARP, boundary=True, lines=NO_LINES)
    return Instance.on_faces(
        name,
        mesh,
        *combine_strokes(mesh, edges, None)[:3],
        stroke_coefficient=stroke_weight,
        gauge=gauge,
        source=f"the built-in mesh {name}",
        reading=Reading(None, edges=edges),
    )
