"""Directions on triangles for other programs: read by them, and read back."""

import io
from dataclasses import replace

import numpy as np
import pytest
from crossfield.models.errors import InputError, InstanceError, OutputError
from crossfield.models.field.field import CrossField
from crossfield.models.field.file import read_field, write_field
from crossfield.models.field.triangles import mesh_of, vectors_of
from crossfield.models.instance.angles import HALF
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.mesh import Mesh
from crossfield.models.mesh.shapes import MESHES
from exhaustive import random_field, random_instance
from folders import contents

SUFFIXES = ("rawfield", "rosy", "ply", "vtk")


def on_mesh(name, *, orthogonal=True, seed=1):
    rng = np.random.default_rng(seed)
    mesh = MESHES[name][1]()
    instance = Instance.on_faces(name, mesh, [0], [0.3], [1.0], orthogonal=orthogonal)
    beta = np.zeros(mesh.size) if orthogonal else rng.uniform(-0.6, 0.6, mesh.size)
    field = CrossField(instance, rng.uniform(0, HALF, mesh.size), beta, np.zeros(len(mesh.first), int))
    return field.with_best_jumps()


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("orthogonal", [True, False])
def test_a_field_on_a_mesh_comes_back(suffix, orthogonal, tmp_path):
    field = on_mesh("cube", orthogonal=orthogonal)
    back = read_field(write_field(field, tmp_path / f"field.{suffix}"), on=field.instance)
    beta = field.beta if suffix != "rosy" else 0
    error = back.cross_error(field.alpha + beta, field.alpha + HALF - beta)
    assert error == pytest.approx(np.zeros(len(error)), abs=1e-9)
    if orthogonal:
        assert back.energy().total == pytest.approx(field.energy().total)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_field_on_pixels_comes_back(suffix, tmp_path):
    field = random_field(random_instance(3), 3)
    if suffix == "rosy":
        field = CrossField(replace(field.instance, orthogonal=True), field.alpha, 0 * field.beta, field.p)
    back = read_field(write_field(field, tmp_path / f"field.{suffix}"), on=field.instance)
    error = back.cross_error(field.u_angle, field.v_angle)
    assert error == pytest.approx(np.zeros(len(error)), abs=1e-9)


def test_directions_do_not_depend_on_the_first_corner_of_a_face():
    field = on_mesh("pin")
    mesh, instance = field.instance.mesh, field.instance
    turned = replace(mesh, faces=np.roll(mesh.faces, 1, axis=1))
    angles = turned.angle_in(np.arange(mesh.size), vectors_of(field)[:, 0])
    other = CrossField.from_lines(replace(instance, domain=turned), angles, angles + HALF)
    same = np.abs(np.einsum("kc,klc->kl", vectors_of(other)[:, 0], vectors_of(field))).max(axis=1)
    assert same == pytest.approx(np.ones(mesh.size))
    assert other.energy().smooth == pytest.approx(field.energy().smooth)
    assert other.singularities.index.sum() == mesh.euler_characteristic


@pytest.mark.needs("trimesh")
def test_trimesh_reads_the_ply_with_its_directions(tmp_path):
    import trimesh

    field = on_mesh("flange")
    path = write_field(field, tmp_path / "field.ply")
    read = trimesh.load(io.BytesIO(path.read_bytes()), file_type="ply", process=False)
    np.testing.assert_array_equal(read.faces, field.instance.mesh.faces)
    np.testing.assert_allclose(read.vertices, field.instance.mesh.vertices)
    rows = read.metadata["_ply_raw"]["face"]["data"]
    vectors = np.stack([rows[name] for name in ("ux", "uy", "uz", "vx", "vy", "vz")], axis=1)
    np.testing.assert_allclose(vectors.reshape(-1, 2, 3), vectors_of(field))


@pytest.mark.needs("pyvista")
def test_vtk_reads_the_vtk_with_directions_and_indices(tmp_path):
    import pyvista

    for field in (on_mesh("cube", orthogonal=False), random_field(random_instance(3), 3)):
        read = pyvista.read(write_field(field, tmp_path / "field.vtk"))
        mesh = mesh_of(field.instance)
        np.testing.assert_array_equal(read.regular_faces, mesh.faces)
        np.testing.assert_allclose(np.asarray(read.points), mesh.vertices)
        np.testing.assert_allclose(np.asarray(read.cell_data["u"]), vectors_of(field)[:, 0])
        np.testing.assert_allclose(np.asarray(read.cell_data["v"]), vectors_of(field)[:, 1])
        total = field.singularities.index.sum()
        assert np.asarray(read.point_data["index"]).sum() == pytest.approx(total)


@pytest.mark.parametrize(
    "suffix, old, new, message",
    [
        ("rosy", "\n4\n", "\n6\n", "line 2: is not 4"),
        ("rosy", "432\n", "431\n", "its first line states 431"),
        ("ply", "property double ux\n", "", "no properties ux"),
        ("vtk", "VECTORS v", "VECTORS w", "no cell vectors u and v"),
        ("vtk", "VECTORS v", "VECTORS v double\n1 2\nVECTORS x", "has 5 numbers; give 6"),
    ],
)
def test_damaged_files_are_refused_with_the_place(suffix, old, new, message, tmp_path):
    field = on_mesh("cube")
    path = write_field(field, tmp_path / f"field.{suffix}")
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(InstanceError, match=message):
        read_field(path, on=field.instance)
    with pytest.raises(InputError, match="holds no instance"):
        read_field(path)


@pytest.mark.parametrize("suffix", ["ply", "vtk"])
def test_a_field_of_another_mesh_with_as_many_faces_is_refused(suffix, tmp_path):
    mesh = Mesh([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    instance = Instance.on_faces("plate", mesh, [0], [0.3], [1.0])
    field = CrossField(instance, [0.3, 0.4], [0, 0], [0])
    path = write_field(field, tmp_path / f"field.{suffix}")
    others = [
        replace(mesh, faces=mesh.faces[::-1]),
        replace(mesh, vertices=2 * mesh.vertices),
        replace(mesh, vertices=np.append(mesh.vertices, [[5, 5, 5]], axis=0)),
        Mesh(mesh.vertices[[0, 1, 2, 2, 3, 0]], [[0, 1, 2], [3, 4, 5]]),
    ]
    for other in others:
        with pytest.raises(InstanceError, match=r"field\.\w+: holds another mesh"):
            read_field(path, on=replace(instance, domain=other))
    path.write_text(path.read_text().replace("2.0 1.0 0.0", "2.000001 1 0"))  # saved with other digits
    assert read_field(path, on=instance).alpha == pytest.approx(field.alpha)


@pytest.mark.parametrize("suffix", ["rawfield", "rosy"])
def test_the_mesh_of_the_user_is_not_replaced(suffix, tmp_path):
    field = on_mesh("cube")
    theirs = tmp_path / "part.obj"
    theirs.write_text("# Blender\nvt 0 0\n")
    with pytest.raises(OutputError, match=r"part.obj: is not crossfield.s, or has changed"):
        write_field(field, tmp_path / f"part.{suffix}")
    assert theirs.read_text() == "# Blender\nvt 0 0\n"
    assert list(contents(tmp_path)) == ["part.obj"]
    for _ in range(2):  # our own mesh is written again
        write_field(field, tmp_path / f"field.{suffix}")
