"""Mesh files as instances: strokes, weights, frames, formats, and every fault with its faces."""

import sys
from contextlib import suppress

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.errors import InputError, MeshError
from crossfield.models.formulations.problem import formulate
from crossfield.models.instance.mesh import Mesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from loops import for_each
from meshes import box, flat_sheet, icosahedron, tetrahedron, turn_corners, write_obj

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def write_square(path, *lines):
    path.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in SQUARE) + "\n".join(lines) + "\n")
    return path


def strokes_of(instance):
    return dict(zip(instance.stroke_index.tolist(), instance.theta.tolist(), strict=True))


# strokes


def test_boundaries_are_strokes_in_the_frame_of_their_face(tmp_path):
    """Two sides at right angles agree: the one with the lowest vertices counts."""
    instance = cf.read_mesh(write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1"))
    assert strokes_of(instance) == pytest.approx({0: 0, 1: np.pi / 2})
    assert instance.w.tolist() == [1, 1]
    assert (instance.stroke_coefficient, instance.orthogonal, instance.gauge) == (20, True, "strokes")
    turned = cf.read_mesh(write_square(tmp_path / "b.obj", "f 3 1 2", "f 4 1 3"))
    assert strokes_of(turned) == pytest.approx({0: 3 * np.pi / 4, 1: 0})
    assert len(cf.read_mesh(tmp_path / "a.obj", boundary=False).theta) == 0


def test_sharp_edges_are_strokes_on_both_sides(tmp_path):
    path = write_obj(tmp_path / "box.obj", box(2))
    assert len(cf.read_mesh(path, sharp=90.5).theta) == len(cf.read_mesh(path).theta) == 0
    instance = cf.read_mesh(path, sharp=90)
    mesh = instance.mesh
    for face in instance.stroke_index.tolist():
        corners = mesh.vertices[mesh.faces[face]]
        edges = np.roll(corners, -1, axis=0) - corners
        angles = mesh.angle_in(np.full(3, face, np.int32), edges)
        along_axes = [angle for angle, edge in zip(angles, edges, strict=True) if (edge != 0).sum() == 1]
        off = np.abs(np.array(along_axes) - strokes_of(instance)[face])
        assert np.abs(np.mod(off + 0.1, np.pi / 2) - 0.1).max() < 1e-9
    assert len(instance.theta) == 24  # the other faces touch the cube's edges in corners only


def test_several_directions_have_their_mean_by_the_fourfold_angle(tmp_path):
    """Directions at 0 and 30 degrees: their mean, with a reliability of cos 60. At 45 they cancel out."""
    table = tmp_path / "strokes.csv"
    path = write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1")
    for degrees, theta, w in ((20, 10, np.cos(np.radians(40))), (90, 0, 1), (30, 15, 0.5)):
        across = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        table.write_text(f"face,x,y,z\n0,2,0,0\n0,{across[0]},{across[1]},5\n1,0,0,0\n")
        instance = cf.read_mesh(path, boundary=False, directions=table)
        assert strokes_of(instance) == pytest.approx({0: np.radians(theta)})
        assert instance.w == pytest.approx([w])
        assert instance.reading.warnings == ()
    table.write_text("0,1,0,0\n0,1,1,0\n")
    instance = cf.read_mesh(path, boundary=False, directions=table)
    assert len(instance.theta) == 0
    assert instance.reading.warnings == ("no stroke on face 0, where directions cancel out",)


def test_polylines_of_an_obj_are_strokes_along_edges(tmp_path):
    path = write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1", "l 1 3")
    instance = cf.read_mesh(path, boundary=False)
    assert strokes_of(instance) == pytest.approx({0: np.pi / 4, 1: np.pi / 4})
    write_square(path, "f -4 -3 -2", "f 3 4 1", "l 1 2 4")
    with pytest.raises(MeshError, match=r"a.obj: a polyline goes from vertex 2 to vertex 4 \(from 1\)"):
        cf.read_mesh(path)


def test_the_first_vectors_of_a_rawfield_are_directions(tmp_path):
    path = write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1")
    rows = ["1 1 0 -1 1 0 -1 -1 0 1 -1 0", "0 1 0 -1 0 0 0 -1 0 1 0 0"]
    (tmp_path / "a.rawfield").write_text("\n".join(["4 2", *rows]) + "\n")
    instance = cf.read_mesh(path, boundary=False, directions=tmp_path / "a.rawfield")
    assert strokes_of(instance) == pytest.approx({0: np.pi / 4, 1: np.pi / 2})


@for_each(
    "text,message",
    [
        ("", "has no row of numbers"),
        ("face,x,y,z\n\n", "has no row of numbers"),
        ("0,1,0\n", "is no table of face,x,y,z"),
        ("face,x,y,z\n1;1;0;0\n", "is no table of face,x,y,z"),
        ("0,1,0,up\n", "is no table of face,x,y,z"),
        ("0.5,1,0,0\n", "whole numbers"),
        ("2,1,0,0\n", "face 2: does not exist"),
        ("1,nan,0,0\n", "face 1: has a vector that is not finite"),
        ("1,0,0,3\n", "face 1: has a vector at right angles to it"),
    ],
)
def test_directions_that_do_not_fit_are_named(tmp_path, text, message):
    path = write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1")
    (tmp_path / "d.csv").write_text(text)
    with pytest.raises(InputError, match=f"d.csv: .*{message}"):
        cf.read_mesh(path, directions=tmp_path / "d.csv")


# energies


@pytest.mark.parametrize("orthogonal", [True, False])
def test_frames_change_no_energy(tmp_path, orthogonal):
    """The corners of faces listed from others on: angles turn with the frames, energies stay."""
    mesh = box(2)
    directions = tmp_path / "d.csv"
    directions.write_text("1,1,2,3\n7,-2,0.1,1\n20,1,-1,0.3\n")
    one, other = (
        cf.read_mesh(
            write_obj(tmp_path / f"{name}.obj", turned),
            sharp=35,
            directions=directions,
            weights="dual",
            orthogonal=orthogonal,
        )
        for name, turned in (("a", mesh), ("b", turn_corners(mesh, np.random.default_rng(1))))
    )
    assert one.stroke_index.tolist() == other.stroke_index.tolist()
    assert one.w == pytest.approx(other.w)
    rng = np.random.default_rng(2)
    u = rng.uniform(0, np.pi, mesh.size)
    v = u + (np.pi / 2 if orthogonal else rng.uniform(0.5, 2.5, mesh.size))
    faces = np.arange(mesh.size, dtype=np.int32)
    lines = [other.mesh.angle_in(faces, one.mesh.vectors(faces, angle)) for angle in (u, v)]
    fields = cf.CrossField.from_lines(one, u, v), cf.CrossField.from_lines(other, *lines)
    for norm in (1, 2, "mixed"):
        assert fields[0].energy(norm).total == pytest.approx(fields[1].energy(norm).total, rel=1e-9)
    for field in fields:
        assert field.singularities.index.sum() == pytest.approx(2)


def test_frames_change_no_optimum(tmp_path):
    mesh, optima = tetrahedron(), []
    (tmp_path / "d.csv").write_text("0,1,2,3\n1,1,0,2\n")
    for seed in (None, 1, 2):
        turned = mesh if seed is None else turn_corners(mesh, np.random.default_rng(seed))
        path = write_obj(tmp_path / "a.obj", turned)
        instance = cf.read_mesh(path, directions=tmp_path / "d.csv", orthogonal=False)
        solution = cf.solve(formulate(instance, "milp-mccormick"), "highs", limits=cf.Limits(60))
        assert solution.status == "optimal-global"
        optima.append(solution.objective)
    assert optima == pytest.approx([optima[0]] * 3, rel=1e-6)


def test_weights_are_one_or_dual(tmp_path):
    """Two right triangles: the centres are sqrt(2) / 6 from the diagonal's middle, which is sqrt(2) long."""
    path = write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1")
    assert cf.read_mesh(path).pair_weights is None
    assert cf.read_mesh(path, weights="dual").pair_weights == pytest.approx([3])


# formats


@for_each("suffix", ["obj", "ply", "off", "stl"])
def test_trimesh_writes_what_we_read(tmp_path, suffix):
    trimesh = pytest.importorskip("trimesh")
    mesh = icosahedron()
    path = tmp_path / f"Ico 2.{suffix}"
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(path)
    instance = cf.read_mesh(path, sharp=30)
    assert (instance.name, instance.source) == ("ico_2", f"Ico 2.{suffix}")
    corners = instance.mesh.vertices[instance.mesh.faces]
    assert np.allclose(corners, mesh.vertices[mesh.faces], atol=1e-6)
    assert len(instance.mesh.vertices) == 12
    theirs = trimesh.load_mesh(path)
    assert np.allclose(np.sort(instance.mesh.dihedral), np.sort(theirs.face_adjacency_angles), atol=1e-5)
    assert instance.mesh.euler_characteristic == theirs.euler_number == 2


def test_ascii_and_binary_files_hold_the_same_mesh(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(tetrahedron().vertices, tetrahedron().faces, process=False)
    hashes = set()
    for kind, options in (("ply", {"encoding": "ascii"}), ("ply", {"encoding": "binary"}), ("stl_ascii", {})):
        path = tmp_path / f"t.{kind[:3]}"
        data = mesh.export(file_type=kind, **options)
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        hashes.add(cf.read_mesh(path).mesh.vertices[cf.read_mesh(path).mesh.faces].tobytes())
    assert len(hashes) == 1


def test_without_trimesh_only_obj_is_read(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    assert len(cf.read_mesh(write_obj(tmp_path / "a.obj", tetrahedron())).mesh.faces) == 4
    (tmp_path / "a.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    with pytest.raises(InputError, match=r"a.off: .*run pip install 'crossfield\[mesh\]', or give an .obj"):
        cf.read_mesh(tmp_path / "a.off")


# faults

OFF = "OFF\n4 {count} 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n{faces}\n"
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face {count}\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n{faces}\n"
)


@for_each(
    "name,text,message",
    [
        ("a.off", OFF.format(count=1, faces="4 0 1 2 3"), "has 1 faces, which are 2 triangles; triangulate"),
        ("a.ply", PLY.format(count=1, faces="4 0 1 2 3"), "has 1 faces, which are 2 triangles; triangulate"),
        ("a.off", OFF.format(count=1, faces="3 0 1 7"), ""),  # versions of trimesh differ
        (
            "a.off",
            OFF.format(count=10**8, faces="3 0 1 2"),
            "has more than 6000000 vertices or 2000000 faces",
        ),
        ("a.off", OFF.format(count=0, faces=""), "has no face"),
        ("a.off", "solid", "does not begin as .off"),
        ("a.ply", "ply\nend_header\n", "does not begin as .ply"),
        ("a.ply", "", "does not begin as .ply"),
        ("a.stl", "", ""),
        ("a.stl", "solid a\nfacet\nouter loop\nvertex 1 2\nendloop\nendsolid", ""),
        ("a.obj", "", "has no face"),
        ("a.obj", "v 0 0\n", "line 1: 'v 0 0' is no OBJ"),
        ("a.obj", "v 0 0 x\nf 1 1 1\n", "has a vertex that is no number"),
        ("a.obj", "v 0 0 0\nf 1 1 a\n", "line 2: 'f 1 1 a' is no OBJ"),
        ("a.obj", "v 0 0 0\nf 0 1 1\n", "line 2: 'f 0 1 1' is no OBJ"),
        ("a.step", "ISO-10303-21;", "has the suffix '.step', which selects no format; choose one of .obj"),
    ],
)
def test_files_that_are_no_triangle_meshes_are_named(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError if "line" in message else cf.CrossfieldError) as caught:
        cf.read_mesh(tmp_path / name)
    assert str(caught.value).startswith(f"{tmp_path / name}: ")
    assert message in str(caught.value)


@for_each(
    "faces,message",
    [
        (["f 1 2 3 4"], "line 5: has a face of 4 corners; triangulate it"),
        (["f 1 2 3", "f 3 4 9"], "a vertex does not exist in face 1"),
        (["f 1 2 3", "f 3 4 4"], "no area in face 1: two corners are one"),
        (["f 1 2 3", "f 1 3 4", "f 1 3 2"], "faces 1, 2 go along the same edge"),
        (["f 1 2 3", "f 3 1 4"], "faces 0, 1 go along the same edge in the same direction"),
        (["v nan 0 0", "f 1 2 3"], "has a coordinate that is not a number"),
        (["v 2 1 0", "v 2 2 0", "f 1 2 3", "f 3 5 6"], "faces 0, 1 touch others at vertex 2 alone"),
    ],
)
def test_meshes_that_are_no_manifolds_are_named_with_their_faces(tmp_path, faces, message):
    write_square(tmp_path / "a.obj", *faces)
    with pytest.raises(MeshError) as caught:
        cf.read_mesh(tmp_path / "a.obj")
    assert message in str(caught.value)


def test_a_closed_fan_that_touches_an_open_one_is_refused():
    """The three faces of a tetrahedron's corner close around it; a triangle touches the same vertex."""
    closed = tetrahedron()
    vertices = np.concatenate([closed.vertices, [[5, 5, 5], [5, 5, 6]]])
    mesh = Mesh(vertices, np.concatenate([closed.faces, [[0, 4, 5]]]).astype(np.int32))
    with pytest.raises(MeshError, match="faces 0, 1, 2, 4 touch others at vertex 0 alone"):
        mesh.check()


def test_parts_are_counted_and_solved_together(tmp_path):
    one, other = tetrahedron(), flat_sheet(2, 1)
    mesh = Mesh(
        np.concatenate([one.vertices, other.vertices + 9]),
        np.concatenate([one.faces, other.faces + 4]).astype(np.int32),
    )
    instance = cf.read_mesh(write_obj(tmp_path / "a.obj", mesh))
    assert "8 faces in 2 separate parts" in instance.summary


@pytest.mark.parametrize("suffix", ["obj", "ply", "off", "stl", "csv"])
@given(data=st.data())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=50)
def test_mutated_files_give_named_errors(tmp_path, suffix, data):
    trimesh = pytest.importorskip("trimesh")
    path, mesh = tmp_path / f"mutated.{suffix}", tetrahedron()
    if suffix == "csv":
        path.write_text("face,x,y,z\n0,1,0,0\n1,2,2,3\n")
    else:
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(path)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 8))] = data.draw(
            st.one_of(st.binary(max_size=8), st.sampled_from([b"-1", b"9" * 30, b"nan", b"\n", b" "]))
        )
    path.write_bytes(content)
    with suppress(cf.CrossfieldError):
        if suffix == "csv":
            cf.read_mesh(write_obj(tmp_path / "a.obj", mesh), directions=path)
        else:
            cf.read_mesh(path, sharp=35)


@for_each("options", [{"sharp": 0}, {"weights": "cotan"}, {"boundary": 3}, {"gauge": "x"}])
def test_wrong_options_are_refused(tmp_path, options):
    with pytest.raises(cf.CrossfieldError, match=next(iter(options))):
        cf.read_mesh(write_obj(tmp_path / "a.obj", tetrahedron()), **options)


def test_numbers_that_programs_take_as_zero_are_zero(tmp_path):
    """A flat sheet whose corners are off by 1e-9: diagonals are at 45 degrees, and parallel frames equal."""
    sheet = flat_sheet(3, 3)
    noise = 1e-9 * np.random.default_rng(0).normal(size=sheet.vertices.shape)
    instance = cf.read_mesh(write_obj(tmp_path / "a.obj", Mesh(sheet.vertices + noise, sheet.faces)))
    for numbers in (instance.mesh.kappa, instance.alpha_lower, instance.theta):
        assert not ((numbers != 0) & (np.abs(numbers) < 1e-7)).any()
    assert (instance.theta == np.pi / 4).any()
