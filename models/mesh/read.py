"""Meshes as instances: faces with strokes along features, of files and of the built-in meshes."""

from __future__ import annotations

from pathlib import Path
from typing import Final, Literal, get_args

from ..arguments import check_choice, check_flag
from ..errors import InputError, naming
from ..instance.instance import STROKE_WEIGHT, Gauge, Instance, Reading, name_from_text
from ..instance.mesh import list_faces
from .formats import NO_LINES, read_mesh_file
from .shapes import MESHES
from .strokes import combine_strokes, feature_edges, read_directions

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
    orthogonal: bool = True,
    name: str | None = None,
    gauge: Gauge = "strokes",
) -> Instance:
    """Read a triangle mesh as an instance, one cross per face.

    Strokes lie on the faces at sharp edges, boundaries and polylines (`l` elements) of an OBJ, and on faces
    with given directions. A face with several of them gets their mean, for crosses of right angles.

    Parameters
    ----------
    path
        File: .obj, .ply, .off or .stl. Of an .stl, equal corners are one vertex.
    sharp
        Angle in degrees between the normals of two faces, above 0, from which their edge is a stroke on
        both; None for no such strokes.
    boundary
        Whether boundary edges are strokes.
    directions
        File of directions in space: a table (CSV) with a heading and rows face, x, y, z, faces from 0; or a
        .rawfield, whose first vectors count. Vectors are projected to their faces.
    weights
        Weights of pairs in the smoothness: 1 (`unit`), or the length of the edge over the distance of the
        centres (`dual`).
    orthogonal
        Whether all crosses have right angles.
    name
        Name of the instance; by default made from the file name.
    gauge
        Window of alpha, as in `Instance`.

    Returns
    -------
    Instance
        The instance, with weight 20 of the strokes.

    Raises
    ------
    InputError
        For an unreadable file, trimesh missing, and directions that do not fit.
    MeshError
        For a mesh that is no oriented manifold of triangles; the message names faces and a remedy.

    """
    path = Path(path)
    check_flag("boundary", boundary)
    if sharp is not None and not 0 < sharp <= 180:
        raise InputError(f"sharp is {sharp}; give degrees above 0 and up to 180")
    check_choice("kind of weights", weights, PAIR_WEIGHTS)
    with naming(path):
        mesh, lines = read_mesh_file(path)
        mesh.check()
        edges = feature_edges(mesh, sharp=sharp, boundary=boundary, lines=lines)
    directed = None
    if directions is not None:
        with naming(directions):
            directed = read_directions(Path(directions), mesh)
    *strokes, contradictory = combine_strokes(mesh, edges, directed)
    warnings: tuple[str, ...] = ()
    if len(contradictory):
        warnings = (f"no stroke on {list_faces(contradictory)}, where directions cancel out",)
    return Instance.on_faces(
        name or name_from_text(path.stem, "mesh"),
        mesh,
        *strokes,
        stroke_coefficient=STROKE_WEIGHT,
        orthogonal=orthogonal,
        pair_weights=mesh.dual_weights if weights == "dual" else None,
        gauge=gauge,
        source=path.name,
        reading=Reading(None, warnings),
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
    )
