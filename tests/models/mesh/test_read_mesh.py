"""Mesh files as instances: strokes, weights, frames, formats, and every fault with its faces."""

import gzip
import re

import crossfield as cf
import numpy as np
import pytest
from loops import for_each
from meshes import box, flat_sheet, icosahedron, mesh_of, tetrahedron, write_obj

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
    table.write_text("0,1,0,0,0.5\n0,1,1,0,0.01\n1,0,1,0,0.25\n1,1,2,0,0\n")  # 45 degrees hardly count
    instance = cf.read_mesh(path, boundary=False, directions=table)
    assert strokes_of(instance) == pytest.approx({0: 0, 1: np.pi / 2})
    assert instance.w == pytest.approx([0.5 * 0.49 / 0.51, 0.25])
    table.write_text("0,1,0,0\n0,1,1,0\n")
    instance = cf.read_mesh(path, boundary=False, directions=table)
    assert len(instance.theta) == 0
    assert instance.reading.warnings == ("no stroke on face 0, where directions cancel out",)


def test_polylines_of_an_obj_are_strokes_along_edges(tmp_path):
    path = write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1", "l 1 3")
    instance = cf.read_mesh(path, boundary=False)
    assert strokes_of(instance) == pytest.approx({0: np.pi / 4, 1: np.pi / 4})
    write_square(path, "f -4 -3 -2", "f 3 4 1", "l 1 2 4")
    message = r"a.obj: a polyline goes from vertex 2 to vertex 4 \(from 1\)"
    with pytest.raises(cf.InstanceError, match=message):
        cf.read_mesh(path)


def test_sharp_edges_of_quadwild_are_strokes_on_both_sides(tmp_path):
    """Listed from one face, with spaces as in its README; or from both, with commas, as it writes them."""
    path, sharp = write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1"), tmp_path / "a.sharp"
    for text in ("1\n1 0 2\n", "2\n1,0,2\n1,1,2\n"):
        sharp.write_text(text)
        instance = cf.read_mesh(path, boundary=False, directions=sharp)
        assert strokes_of(instance) == pytest.approx({0: np.pi / 4, 1: np.pi / 4})


@for_each(
    "suffix, text, encoding",
    [
        ("rawfield", "4 2\n1 1 0 -1 1 0 -1 -1 0 1 -1 0\n0 1 0 -1 0 0 0 -1 0 1 0 0\n", "utf-8"),
        ("rosy", "2\n4\n1 1 0\n0 1 0", "utf-8-sig"),
        ("csv", "face,x,y,z\n0,1,1,0\n\n 1, 0,\t1,0", "utf-16"),
        ("txt", "0;1.5;1.5;0\r\n1;0;1;0", "utf-8-sig"),
    ],
)
def test_directions_in_any_notation(suffix, text, encoding, tmp_path):
    path = write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1")
    (tmp_path / f"a.{suffix}").write_text(text, encoding=encoding)
    instance = cf.read_mesh(path, boundary=False, directions=tmp_path / f"a.{suffix}")
    assert strokes_of(instance) == pytest.approx({0: np.pi / 4, 1: np.pi / 2})


@for_each(
    "text,message",
    [
        ("", "is no .sharp, a count and rows of type,face,side"),
        ("1\n1 0\n", "is no .sharp"),
        ("1\n1,0,0.5\n", "a row holds something other than whole numbers"),
        ("2\n1,0,0\n", "has 1 edges, but its first line states 2"),
        ("1\n1,2,0\n", "has the edge [1, 2, 0]; give 0 or 1, a face below 2, and a side 0 to 2"),
    ],
)
def test_sharp_edges_that_do_not_fit_are_named(tmp_path, text, message):
    path = write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1")
    (tmp_path / "d.sharp").write_text(text)
    with pytest.raises(cf.InputError, match=f"d.sharp: {re.escape(message)}"):
        cf.read_mesh(path, directions=tmp_path / "d.sharp")


@for_each(
    "text,message",
    [
        ("face,x,y,z\n\n", "has no row of numbers"),
        ("0,1,0\n", "line 1: has 3 numbers; give 4, face,x,y,z"),
        ("a\n0,1,0,up\n", "line 2: holds something other than numbers: '0 1 0 up'"),
        ("0,1,0,0,1,1\n", "line 1: has 6 numbers; give 4, face,x,y,z"),
        ("0,1,0,0\n0,1,0,0,1\n", "line 2: has 5 numbers; give 4, face,x,y,z"),
        ("0,,1,0,0\n", "line 1: holds something other than numbers: '0 nothing 1 0 0'"),
        ("0;1,5;0;0\n", "'0 1,5 0 0'; write decimal points instead of commas"),
        ("-1,1,0,0\n", "face -1: does not exist"),
        ("0,1,0,0,2\n", "face 0: has a weight that is not from 0 to 1"),
        ("0,1,0,0,nan\n", "line 1: holds something other than numbers: '0 1 0 0 nan'"),
        ("0.5,1,0,0\n", "whole numbers"),
        ("2,1,0,0\n", "face 2: does not exist"),
        ("1,1e999,0,0\n", "face 1: has a vector that is not finite"),
        ("1,0,0,3\n", "face 1: has a vector at right angles to it"),
    ],
)
def test_directions_that_do_not_fit_are_named(tmp_path, text, message):
    path = write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1")
    (tmp_path / "d.csv").write_text(text)
    with pytest.raises(cf.InputError, match=f"d.csv: .*{message}"):
        cf.read_mesh(path, directions=tmp_path / "d.csv")


def test_weights_are_one_or_dual(tmp_path):
    """Two right triangles: the centres are sqrt(2) / 6 from the diagonal's middle, which is sqrt(2) long."""
    path = write_square(tmp_path / "a.obj", "f 1 2 3", "f 3 4 1")
    assert cf.read_mesh(path).pair_weights is None
    assert cf.read_mesh(path, weights="dual").pair_weights == pytest.approx([3])


@for_each("factor", [1e-6, 0.5, 4])
def test_pairs_across_sharp_edges_have_a_weight_of_their_own(tmp_path, factor):
    """Two faces that meet at a right angle, one of whose crosses is pulled 10 degrees away from the edge.

    The residual of 10 degrees is shared among three springs in a row: two strokes, and the pair's two lines.
    """
    path, table = tmp_path / "a.obj", tmp_path / "d.csv"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\n")
    table.write_text(f"0,{np.cos(np.radians(20))},{np.sin(np.radians(20))},0\n")
    more = {"sharp": 89, "boundary": False, "directions": table, "sharp_weight": factor}
    for weights, weight in (("unit", factor), ("dual", 3 / 5**0.5 * factor)):
        instance = cf.read_mesh(path, weights=weights, **more)
        assert instance.pair_weights == pytest.approx([weight])
        springs = 0.5 / weight + 1 / 20 + 1 / (20 * np.cos(np.radians(40)))
        assert cf.greedy_field(instance).energy().total == pytest.approx(np.radians(10) ** 2 / springs)
    assert cf.read_mesh(path, **more | {"sharp": None}).pair_weights is None


# formats


@for_each(
    "suffix, options",
    [
        *((suffix, {}) for suffix in ("obj", "ply", "off", "stl")),
        ("ply", {"encoding": "ascii"}),
        ("stl", {"file_type": "stl_ascii"}),
    ],
)
def test_trimesh_writes_what_we_read(suffix, options, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    mesh = icosahedron()
    path = tmp_path / f"Ico 2.{suffix}"
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(path, **options)
    instance = cf.read_mesh(path, sharp=30)
    assert (instance.name, instance.source) == ("ico_2", f"Ico 2.{suffix}")
    corners = instance.mesh.vertices[instance.mesh.faces]
    assert np.allclose(corners, mesh.vertices[mesh.faces], atol=1e-6)
    assert len(instance.mesh.vertices) == 12
    theirs = trimesh.load_mesh(path)
    assert np.allclose(np.sort(instance.mesh.dihedral), np.sort(theirs.face_adjacency_angles), atol=1e-5)
    assert instance.mesh.euler_characteristic == theirs.euler_number == 2


CORNERS = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
FACET = "facet normal 0 0 1\nouter loop\n{}\nendloop\nendfacet\n"
SOLIDS = (
    f"solid {FACET.format('vertex 0 0 0 vertex 1 0 0 vertex 1 1 0')}endsolid a facet\n"
    f"solid second facet normal\n{FACET.format('vertex 1 1 0 vertex 0 1 0 vertex -0 0 0')}"
)
TWO = ("3 0 1 2", "3 2 3 0")


def off(*faces, count=2):
    return "\n".join([f"OFF\n4 {count} 0\n{CORNERS}", *faces])


def ply(*faces, z="z"):
    head = (
        f"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float {z}\n"
    )
    lists = "element face 2\nproperty list uchar int vertex_indices\n"
    return "\n".join([f"{head}{lists}end_header\n{CORNERS}", *faces])


def binary_ply(order, *faces):
    """The square with texture and quality of faces, and colours behind."""
    head = (
        ply()
        .partition("end_header")[0]
        .replace("\nel", "\ncomment a\n\nel")
        .replace("ascii", f"binary_{order}_endian")
    )
    more = "property list short float texcoord\nproperty uchar quality\nelement tint 1\nproperty char red\n"
    mark = {"little": "<", "big": ">"}[order]
    kinds = ["u1", f"3{mark}i4", f"{mark}i2", f"6{mark}f4", "u1"]
    rows = np.array([(size, corners, 6, np.zeros(6), 9) for size, *corners in faces], ",".join(kinds))
    positions = np.array(SQUARE, f"{mark}f4")
    return f"{head}{more}end_header\n".encode() + positions.tobytes() + rows.tobytes() + b"!"


def binary_stl(stated, *, rest=b"", head=b"solid, but no text"):
    corners = np.array(SQUARE, "<f4")[[[0, 1, 2], [2, 3, 0]]]
    triangles = b"".join(bytes(12) + three.tobytes() + bytes(2) for three in corners)
    return head.ljust(80) + stated.to_bytes(4, "little") + triangles + rest


@for_each(
    "name,data,note",
    [
        (
            "a.obj",
            b"\xef\xbb\xbf# C:\\\nv 0 0 0\nv \\\r\n 1 0 0 1 1 1\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 3 4 1",
            "",
        ),
        ("a.OBJ.gz", gzip.compress(b"v 0 0 0\rv 1 0 0\rv 1 1 0\rv 0 1 0\rf 1 2 3\rf 3 4 1"), ""),
        (
            "a.obj",
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng a\ns 1\nf 1 2 3\nf 3 4 1\nF 1 2 3\ncurv 0 1 1",
            "line 9: 'F 1 2 3' is of no kind that is read, left out (2 such lines)",
        ),
        ("a.off", off(*TWO).encode("utf-16"), ""),
        ("a.off", off(*TWO).replace("OFF", "# 3\nCOFF # 5").replace("\n3 2", " 9 9\n#\n3 2"), ""),
        ("a.off", off(*TWO, "3 3 2 1"), "the last 1 line, behind all faces"),
        ("a.ply", ply(*TWO).encode("utf-8-sig"), ""),
        ("a.ply", ply(" ".join(TWO)), ""),
        ("a.ply", ply(*TWO, "7 8"), "the last 2 numbers, behind all faces"),
        ("a.ply", binary_ply("little", (3, 0, 1, 2), (3, 2, 3, 0)), ""),
        ("a.ply", binary_ply("big", (3, 0, 1, 2), (3, 2, 3, 0)), ""),
        ("a.stl", SOLIDS + "endsolid", ""),
        ("a.stl", (SOLIDS + "end solid second\n").upper().encode("utf-16"), ""),
        ("a.stl", SOLIDS, "it ends without endsolid, so that faces may be missing"),
        ("a.stl", binary_stl(2), ""),
        ("a.stl", binary_stl(2, head=b"solid a\r\n" * 5), ""),
        ("a.stl", binary_stl(0), "it states 0 triangles; all 2 that it holds are read"),
        ("a.stl", binary_stl(2, rest=bytes(60)), "the last 60 bytes, behind all faces, are left out"),
    ],
)
def test_a_square_in_any_notation(name, data, note, tmp_path):
    (tmp_path / name).write_bytes(data if isinstance(data, bytes) else data.encode())
    instance = cf.read_mesh(tmp_path / name)
    assert instance.name == "a"
    assert instance.mesh.vertices.tolist() == SQUARE
    assert instance.mesh.faces.tolist() == [[0, 1, 2], [2, 3, 0]]
    assert [text[: len(note)] for text in instance.reading.warnings] == [note] * bool(note)


# faults


@for_each(
    "name,data,message",
    [
        ("a.off", off("2 0 1", "4 0 1 2 3"), "line 8: has a face of 2 corners"),
        ("a.off", off("3 0 1 2", "-13 2 3 0"), "line 9: has a face of -13 corners"),
        ("a.off", off("3 0 1 2", "3 0 1 7"), "a vertex does not exist in face 1"),
        ("a.off", off("3 0 1 2", "3 0 1 1.5"), "faces holds something other than whole numbers"),
        ("a.off", off("3 0 1 2"), "states 6 lines of vertices and faces and holds 5: it is cut off"),
        ("a.off", off(count=10**8), "has more than 6000000 vertices or 2000000 faces"),
        ("a.off", off(count=0), "has no face"),
        ("a.off", "solid", "does not begin as .off"),
        ("a.ply", ply("4 0 1 2 3", "2 0 1"), "face 0: has 4 corners; triangulate it"),
        ("a.ply", binary_ply("big", (3, 0, 1, 2), (2, 2, 3, 0)), "face 1: has 2 corners; triangulate it"),
        ("a.ply", binary_ply("little", (3, 0, 1, 2)), "states 2 rows of the element face and holds 1"),
        ("a.ply", ply("3 0 1 2"), "states 2 rows of the element face and holds 1: it is cut off"),
        ("a.ply", ply("3 0 1 2", "3 2 3,5 0"), "line 16: holds something other than numbers: '3 2 3,5 0'"),
        ("a.ply", ply(*TWO, z="w"), "does not begin as .ply"),
        ("a.ply", ply(*TWO).replace("element f", "element a 1\nelement f"), "states 1 rows of the element a"),
        ("a.ply", "ply\nend_header\n", "does not begin as .ply"),
        ("a.stl", "", "has no face"),
        ("a.stl", SOLIDS[:-20], "line 8: 'facet normal 0 0 1' begins no whole facet of an .stl"),
        ("a.stl", SOLIDS.replace("0 vertex -0", "0,5 vertex -0"), "line 8: holds something other than num"),
        ("a.stl", f"{SOLIDS}\0", "line 13: "),
        ("a.stl", binary_stl(3), "states 3 triangles and holds 2: it is cut off"),
        ("a.stl", binary_stl(2)[:83], "states 84 bytes"),
        ("a.obj", "", "has no face"),
        ("a.obj", "v 0 0\n", "line 1: has 2 numbers; give 3, x y z of a vertex"),
        ("a.obj", "v 0 0 x\nf 1 1 1\n", "line 1: holds something other than numbers: '0 0 x'"),
        ("a.obj", "\nv 0,000 0 1,5\n", "'0,000 0 1,5'; write decimal points instead of commas"),
        ("a.obj", "v 0 1.5D-03 0\n", "write exponents with E instead of Fortran's D"),
        ("a.obj", "v nan 0 0\n", "line 1: holds something other than numbers: 'nan 0 0'"),
        ("a.obj", "v 1e31 0 0\nf 1 1 1\n", "has a coordinate that is not a number up to 1e+30"),
        ("a.obj", "v 0 0 0\nl 1 2\n", "a polyline has a vertex that is none of the 1 in the file"),
        ("a.obj", "v 0 0 0\nf 1 1 a\n", "line 2: 'f 1 1 a' is no OBJ"),
        ("a.obj.gz", b"\x1f\x8bx", "the packed file is damaged"),
        ("a.step", "ISO-10303-21;", "is a CAD model, which is not read; save its surface as .stl"),
        ("a.3MF", b"PK", "is a print job, which is not read; save its parts as .stl in the slicer"),
        ("a.glb", b"glTF", "is a scene, which is not read; save its triangles as .obj in Blender"),
        ("a.msh", "$MeshFormat", "is a mesh for simulations, which is not read; save its surface as .stl"),
        ("a.blub", "x", "has the suffix '.blub', which selects no format; choose one of .obj"),
    ],
)
def test_files_that_are_no_triangle_meshes_are_named(tmp_path, name, data, message):
    (tmp_path / name).write_bytes(data if isinstance(data, bytes) else data.encode())
    of_mesh = re.search("corners|none of|has no face|has more than|exist|coordinate|whole numbers", message)
    with pytest.raises(cf.InstanceError if of_mesh else cf.InputError) as caught:
        cf.read_mesh(tmp_path / name)
    assert str(caught.value).startswith(f"{tmp_path / name}: ")
    assert message in str(caught.value)


def band(count):
    """A closed band of triangles, all turned alike or not: of an odd number, a Moebius strip."""
    return [f"f {k + 1} {(k + 1) % count + 1} {(k + 2) % count + 1}" for k in range(count)]


FAN = [f"f {k} {k % 4 + 1} 5" for k in range(1, 5)]


@for_each(
    "faces,message",
    [
        (["f 1 2 3 4"], "line 5: has a face of 4 corners; triangulate it"),
        (["f 1 2 3", "f 3 4 9"], "a vertex does not exist in face 1"),
        (["f 1 2 3", "f 3 4 4"], "no area in face 1: two corners are one"),
        (["f 1 2 3", "f 1 3 4", "f 1 3 2"], "faces 1, 2 go along the same edge"),
        (["f 1 2 3", "f 3 1 4"], "faces 0, 1 go along the same edge in the same direction"),
        (["v 2 1 0", "v 2 2 0", "f 1 2 3", "f 3 5 6"], "faces 0, 1 touch others at vertex 2 alone"),
        (
            ["v .5 .5 1", *FAN, "v 5 5 5", "v 5 5 6", "f 5 6 7"],
            "faces 0, 1, 2, 3, 4 touch others at vertex 4",
        ),
        (["v .5 .5 1", *band(5)], "is one-sided, as a Moebius strip is: it cannot be oriented; cut it open"),
        (["v .5 .5 1", "v .5 .5 2", *band(6)], "faces 0, 1, 2, 3, 4, 5 go along the same edge"),
        (["v .5 .5 1", "v 0 0 9", *band(5), "f 1 2 6"], "faces 0, 1, 2, 3, 4, 5 go along the same edge"),
    ],
)
def test_meshes_that_are_no_manifolds_are_named_with_their_faces(tmp_path, faces, message):
    write_square(tmp_path / "a.obj", *faces)
    with pytest.raises(cf.InstanceError) as caught:
        cf.read_mesh(tmp_path / "a.obj")
    assert message in str(caught.value)


def soup(mesh, noise=0.0):
    """The mesh with vertices of its own for each face, which differ by the noise."""
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    corners = corners + noise * np.random.default_rng(0).uniform(-1, 1, corners.shape)
    return cf.Mesh(corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3))


def sphere_with_a_seam():
    """A sphere of 6 by 12 squares whose meridian of longitude 0 is there twice."""
    down, around = np.meshgrid(np.arange(1, 6) * np.pi / 6, np.arange(13) % 12 * np.pi / 6, indexing="ij")
    ring = np.stack([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)], axis=-1)
    one = [[13 * i + j, 13 * i + j + 13, 13 * i + j + 14] for i in range(4) for j in range(12)]
    other = [[13 * i + j, 13 * i + j + 14, 13 * i + j + 1] for i in range(4) for j in range(12)]
    caps = [[65, j, j + 1] for j in range(12)] + [[66, 53 + j, 52 + j] for j in range(12)]
    return mesh_of([*ring.reshape(-1, 3), [0, 0, 1], [0, 0, -1]], one + other + caps)


@for_each(
    "mesh, message, vertices",
    [
        (soup(box(2)), "144 vertices share 26 places; `crossfield instance --merge 0` joins them", 26),
        (
            soup(box(2), 1e-8),
            "144 vertices share 26 places, up to ?e-08 apart; `crossfield instance --merge ?e-08` joins them",
            26,
        ),
        (sphere_with_a_seam(), "10 vertices share 5 places; `crossfield instance --merge 0` joins them", 62),
    ],
)
def test_vertices_at_one_place_are_reported_and_merged_on_demand(mesh, message, vertices, tmp_path):
    path = write_obj(tmp_path / "a.obj", mesh)
    (warning,) = cf.read_mesh(path, boundary=False).reading.warnings
    assert re.sub(r"\d\.?\d*e", "?e", warning) == message
    merge = float(re.search(r"--merge (\S+)`", warning)[1])
    instance = cf.read_mesh(path, merge=merge)
    assert instance.reading.warnings == ()
    assert (len(instance.mesh.vertices), instance.mesh.euler_characteristic) == (vertices, 2)
    assert np.abs(instance.mesh.vertices[instance.mesh.faces] - mesh.vertices[mesh.faces]).max() <= 4 * merge


def test_merging_stays_within_what_is_a_mesh(tmp_path):
    """Three sheets at one edge, two bodies at one corner, a distance of edges, and a polyline."""
    triangle = np.array([[0, 0, 0], [1, 0, 0]])
    sheets = np.concatenate([[*triangle, [0.5, np.cos(a), np.sin(a)]] for a in (0, 2, 4)])
    path = write_obj(tmp_path / "a.obj", cf.Mesh(sheets, np.arange(9, dtype=np.int32).reshape(3, 3)))
    (warning,) = cf.read_mesh(path, boundary=False).reading.warnings
    assert warning.startswith("6 vertices share 2 places, but joined they would make no mesh: faces 0, 1, 2")
    one = tetrahedron()
    both = mesh_of([*one.vertices, *np.add(one.vertices, (2, 2, 0))], [*one.faces, *(one.faces + 4)])
    for merge in (None, 0, 1e-6):
        instance = cf.read_mesh(write_obj(path, both), merge=merge)
        assert (instance.mesh.parts, instance.reading.warnings) == (2, ())
    message = r"a.obj: has an edge of length 1 at its boundary; merge at a smaller"
    with pytest.raises(cf.InstanceError, match=message):
        cf.read_mesh(write_obj(path, flat_sheet(3, 3)), merge=1.5)
    write_square(path, "v 0 0 0", "v 1 1 0", "f 1 2 3", "f 6 4 5", "l 5 3", "l 1 5")
    assert strokes_of(cf.read_mesh(path, merge=0, boundary=False)) == pytest.approx(
        {0: np.pi / 4, 1: np.pi / 4}
    )


def test_numbers_that_programs_take_as_zero_are_zero(tmp_path):
    """A flat sheet whose corners are off by 1e-9: diagonals are at 45 degrees, and parallel frames equal."""
    sheet = flat_sheet(3, 3)
    noise = 1e-9 * np.random.default_rng(0).normal(size=sheet.vertices.shape)
    instance = cf.read_mesh(write_obj(tmp_path / "a.obj", cf.Mesh(sheet.vertices + noise, sheet.faces)))
    for numbers in (instance.mesh.kappa, instance.alpha_lower, instance.theta):
        assert not ((numbers != 0) & (np.abs(numbers) < 1e-7)).any()
    assert (instance.theta == np.pi / 4).any()
