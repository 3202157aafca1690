"""Directions on triangles for other programs: read by them, and theirs read on our instances."""

import io

import crossfield as cf
import numpy as np
import pytest
from exhaustive import random_field, random_instance
from loops import for_each

FIELD = random_field(random_instance(1), 1)


def on_mesh(name, *, orthogonal=True):
    rng = np.random.default_rng(1)
    mesh = cf.sample(name).mesh
    instance = cf.Instance.on_faces(name, mesh, [0], [0.3], [1.0], orthogonal=orthogonal)
    u, skew = rng.uniform(0, np.pi, mesh.size), rng.uniform(-1.2, 1.2, mesh.size) * (not orthogonal)
    return cf.CrossField.from_lines(instance, u, u + np.pi / 2 - skew)


def vectors_on(field):
    """Directions (faces, 2, 3) of a field on a mesh, by hand: angles from the first edge of each face."""
    mesh = field.instance.mesh
    one, two, three = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    first = (two - one) / np.linalg.norm(two - one, axis=1)[:, None]
    normal = np.cross(two - one, three - one)
    second = np.cross(normal / np.linalg.norm(normal, axis=1)[:, None], first)
    angles = np.stack([field.alpha + field.beta, field.alpha + np.pi / 2 - field.beta])
    cosine, sine = np.cos(angles)[..., None], np.sin(angles)[..., None]
    return (cosine * first + sine * second).transpose(1, 0, 2)


@pytest.mark.needs("trimesh")
def test_trimesh_reads_the_ply_with_its_directions(tmp_path):
    import trimesh

    field = on_mesh("flange")
    path = cf.write_field(field, tmp_path / "field.ply")
    read = trimesh.load(io.BytesIO(path.read_bytes()), file_type="ply", process=False)
    np.testing.assert_array_equal(read.faces, field.instance.mesh.faces)
    np.testing.assert_allclose(read.vertices, field.instance.mesh.vertices)
    rows = read.metadata["_ply_raw"]["face"]["data"]
    vectors = np.stack([rows[name] for name in ("ux", "uy", "uz", "vx", "vy", "vz")], axis=1)
    np.testing.assert_allclose(vectors.reshape(-1, 2, 3), vectors_on(field), atol=1e-7)


@pytest.mark.needs("pyvista")
def test_vtk_reads_the_vtk_with_directions_and_indices(tmp_path):
    import pyvista

    field = on_mesh("cube", orthogonal=False)
    read = pyvista.read(cf.write_field(field, tmp_path / "field.vtk"))
    np.testing.assert_array_equal(read.cells_dict[pyvista.CellType.TRIANGLE], field.instance.mesh.faces)
    np.testing.assert_allclose(np.asarray(read.points), field.instance.mesh.vertices)
    directions = np.stack([np.asarray(read.cell_data[name]) for name in "uv"], axis=1)
    np.testing.assert_allclose(directions, vectors_on(field), atol=1e-7)
    for each in (field, FIELD):
        index = np.asarray(pyvista.read(cf.write_field(each, tmp_path / "f.vtk")).point_data["index"])
        assert index.sum() == pytest.approx(each.singularities.index.sum())


# Raw fields of other programs on our mesh


def raw(vectors):
    rows = "\n".join(" ".join(map(repr, row)) for row in vectors.reshape(len(vectors), 12).tolist())
    return f"4 {len(vectors)}\n{rows}\n"


def our_vectors(tmp_path):
    rows = cf.write_field(FIELD, tmp_path / "ours.rawfield").read_text().splitlines()[1:]
    return np.array([row.split() for row in rows], dtype=float).reshape(-1, 4, 3)


def error_of(text, tmp_path):
    (tmp_path / "theirs.rawfield").write_text(text)
    read = cf.read_field(tmp_path / "theirs.rawfield", on=FIELD.instance)
    return read.cross_error(FIELD.u_angle, FIELD.v_angle)


@for_each("scale", [1e-300, 1.0, 1e300])
def test_length_and_order_of_the_vectors_do_not_matter(scale, tmp_path):
    rng, ours = np.random.default_rng(5), our_vectors(tmp_path)
    for vectors in (ours, ours[::2]):  # two triangles per pixel, or one
        theirs = np.round(np.stack([row[rng.permutation(4)] for row in vectors]), 12)
        theirs = theirs * scale * rng.uniform(0.5, 2, (len(theirs), 4, 1))
        assert error_of(raw(theirs), tmp_path) == pytest.approx(np.zeros(FIELD.instance.grid.size), abs=1e-9)


def test_a_pixel_gets_the_lines_between_those_of_its_triangles(tmp_path):
    vectors = our_vectors(tmp_path)
    for side, turn in enumerate((0.1, -0.1)):
        matrix = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        vectors[side::2] = vectors[side::2] @ matrix
    vectors[1::2] = np.roll(vectors[1::2], 2, axis=1)
    far = np.pi / 2 - 2 * np.abs(FIELD.beta) > 0.3
    assert far.any()
    assert error_of(raw(vectors), tmp_path)[far] == pytest.approx(np.zeros(far.sum()), abs=1e-9)


@for_each("suffix, digits, encoding", [("rawfield", "%.6g", "utf-8-sig"), ("rosy", "%.6f", "utf-16")])
def test_meshes_and_vectors_of_six_digits_fit(suffix, digits, encoding, tmp_path):
    """Faces of thin triangles turn by more than the digits of their corners."""
    field = on_mesh("flange")
    mesh = field.instance.mesh
    rounded = cf.Mesh(np.round(mesh.vertices, 6), mesh.faces)
    instance = cf.Instance.on_faces("rounded", rounded, [0], [0.3], [1.0])
    lines = cf.write_field(field, tmp_path / f"a.{suffix}").read_text().splitlines()
    rows = [" ".join(digits % float(word) for word in line.split()) for line in lines[2:]]
    (tmp_path / f"a.{suffix}").write_text("\n".join([*lines[:2], *rows]), encoding=encoding)
    read = cf.read_field(tmp_path / f"a.{suffix}", on=instance)
    assert read.cross_error(field.u_angle, field.v_angle).max() < 1e-3


def row(*, number=3, text=None, change=None):
    """A change of one line of a file, counted from 1."""

    def changed(lines):
        words = lines[number - 1].split()
        lines[number - 1] = text if change is None else " ".join(change(words))
        return lines

    return changed


def first(word):
    """Another first number of the third line."""
    return row(change=lambda words: [word, *words[1:]])


@for_each(
    "suffix, damage, message",
    [
        ("rawfield", lambda _: [], "line 1: is '', not the degree 4"),
        ("rawfield", row(number=1, text="hello"), "line 1: is 'hello', not the degree 4"),
        ("rawfield", row(number=1, text="2 50"), "line 1: has 2 vectors per face"),
        ("rawfield", row(number=1, text="4 7"), "line 1: has 7 faces, but"),
        ("rawfield", lambda lines: lines[:-1], "rows of vectors, but its first line states"),
        ("rawfield", lambda lines: [*lines, lines[-1]], "rows of vectors, but its first line states"),
        ("rawfield", row(change=lambda words: words[:11]), "line 3: has 11 numbers; give 12"),
        ("rawfield", first("nan"), "line 3: holds something other than num"),
        ("rawfield", first("1_0"), "line 3: holds something other than num"),
        ("rawfield", first("1e999"), "line 3: holds a number beyond the ran"),
        ("rawfield", row(change=lambda words: ["0"] * 3 + words[3:]), "line 3: holds a vector of length 0"),
        ("rawfield", row(change=lambda words: [*words[:2], "1", *words[3:]]), "line 3: has a vector out of"),
        ("rawfield", row(text="1 0 0 0 1 0 -1 0 0 1 0 0"), "line 3: has no two pairs of opposite vectors"),
        ("rawfield", lambda _: [" " * 1_000_000], "has 1000000 bytes; at most"),
        ("rosy", row(number=1, text="431"), "its first line states 431"),
        ("rosy", row(number=2, text="6"), "line 2: is not 4"),
        ("rosy", lambda lines: [*lines[:2], *lines[:1:-1]], "as fields of another mesh"),
        ("rosy", first("0,5"), "write decimal points instead of commas"),
        ("rosy", first("1.0D+00"), "write exponents with E"),
    ],
)
def test_damage_is_named_with_its_line(suffix, damage, message, tmp_path):
    field = FIELD if suffix == "rawfield" else cf.greedy_field(on_mesh("cube").instance)
    path = cf.write_field(field, tmp_path / f"field.{suffix}")
    path.write_text("\n".join(damage(path.read_text().splitlines())))
    with pytest.raises(cf.InputError if "bytes" in message else cf.InstanceError) as caught:
        cf.read_field(path, on=field.instance)
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)
    with pytest.raises(cf.InputError, match="holds no instance"):
        cf.read_field(path)
