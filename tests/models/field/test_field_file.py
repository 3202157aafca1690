"""Field files: their content by hand, and one named line for every kind of damage."""

import json

import crossfield as cf
import numpy as np
import pytest
from archives import pack_arrays
from damage import change, full_instance, refused, without
from exhaustive import random_field
from loops import for_each
from meshes import flat_sheet, on_edges


@pytest.fixture(scope="module")
def field():
    return random_field(full_instance(), 1)


@pytest.fixture(scope="module")
def on_faces():
    return cf.CrossField(on_edges(flat_sheet(1, 1), boundary=False), [0.1, 0.2], [0, 0], [-1])


def test_json_states_each_jump_beside_its_pixel(tmp_path):
    instance = cf.Instance.on_pixels("small", [[1, 1], [1, 0]], [[0, 0]], [1.0], [1.0])
    field = cf.CrossField(instance, [0.1, 0.2, 0.3], [0, 0.5, 0], [-1, 2])
    document = json.loads(cf.write_field(field, tmp_path / "small.json").read_text())
    assert document["pixels"] == [
        [0, 0, 0.1, 0.0, None, -1],
        [0, 1, 0.2, 0.5, None, None],
        [1, 0, 0.3, 0.0, 2, None],
    ]


def test_json_of_a_mesh_states_each_jump_with_its_faces(on_faces, tmp_path):
    document = json.loads(cf.write_field(on_faces, tmp_path / "small.json").read_text())
    assert (document["faces"], document["jumps"]) == ([[0.1, 0], [0.2, 0]], [[1, 0, -1]])


def pixel(number, column, value):
    def edit(document):
        document["pixels"][number][column] = value
        return document

    return edit


@for_each(
    "name,edit,message",
    [
        ("field", change("format", "crossfield-instance"), '"format" must be "crossfield-field"'),
        ("field", change("extra", 1), "$: Additional properties"),
        ("field", without("pixels"), "'pixels' is a required property"),
        ("field", change("pixels", [[0, 0, 0, 0, None, None]]), "has 1 pixels, but its mask has 7"),
        ("field", lambda d: d | {"instance": d["instance"] | {"gauge": "x"}}, "its instance: $.gauge: 'x' "),
        ("field", pixel(3, 1, 2), "$.pixels[3]: is [1, 2], but the mask has [1, 0] there"),
        ("field", pixel(0, 3, 10**400), "beyond the range of doubles"),
        ("field", pixel(1, 2, 1e308), "alpha holds something other than angles"),
        ("field", pixel(0, 4, 1), "$.pixels[0]: a jump belongs where the mask has the upper neighbour, null"),
        ("field", pixel(0, 5, None), "$.pixels[0]: a jump belongs where the mask has the right neighbour"),
        ("on_faces", change("jumps", [[0, 1, -1]]), "$.jumps: lists other pairs of faces than the mesh has"),
        ("on_faces", change("faces", [[0.1, 0.1], [0.2, 0]]), "beta is not 0 everywhere"),
        ("on_faces", change("pixels", []), "$: False schema does not allow []"),
    ],
)
def test_json_that_breaks_the_rules_is_named_with_its_place(field, on_faces, tmp_path, name, edit, message):
    path = cf.write_field({"field": field, "on_faces": on_faces}[name], tmp_path / "broken.json")
    path.write_text(json.dumps(edit(json.loads(path.read_text()))))
    refused(cf.read_field, path, message)


@for_each(
    "name,array,message",
    [
        ("alpha", np.zeros(3), "alpha has shape (3,), but sample needs (7,)"),
        ("beta", np.full(7, np.nan), "beta holds something other than angles"),
        ("p", None, "holds no array 'p'"),
        ("more", np.zeros(1), "holds an array 'more' that does not belong in it"),
        ("instance_w", None, "its instance: holds no array 'w'"),
        ("instance_theta", np.full(3, np.inf), "its instance: stroke pixel [0, 0]: theta"),
        ("head", np.frombuffer(b'{"format": "crossfield-field", "version": 2}', np.uint8), "has version 2"),
    ],
)
def test_npz_that_breaks_the_rules_is_named(field, tmp_path, name, array, message):
    path = cf.write_field(field, tmp_path / "broken.npz")
    entries = dict(np.load(path)) | {name: array}
    path.write_bytes(pack_arrays({key: value for key, value in entries.items() if value is not None}))
    refused(cf.read_field, path, message)


# The mesh field, read back by a little parser of its own


def numbers(lines, lead=""):
    return np.array([line.removeprefix(lead).split() for line in lines if line.startswith(lead)], dtype=float)


def read_rawfield(path):
    head, *rows = path.read_text().splitlines()
    degree, faces = map(int, head.split())
    vectors = numbers(rows).reshape(faces, degree, 3)
    lines = path.with_suffix(".obj").read_text().splitlines()
    return vectors, numbers(lines, "v "), numbers(lines, "f ").astype(int) - 1


def test_rawfield_lists_u_v_and_their_opposites_counter_clockwise(field, tmp_path):
    vectors, _, triangles = read_rawfield(cf.write_field(field, tmp_path / "field.rawfield"))
    assert vectors.shape == (2 * 7, 4, 3)
    assert len(triangles) == 2 * 7
    assert (vectors[..., 2] == 0).all()
    assert (vectors[::2] == vectors[1::2]).all()
    assert (vectors[::2, 0, :2] == field.u).all()
    assert (vectors[::2, 1, :2] == field.v).all()
    assert (vectors[:, 2:] == -vectors[:, :2]).all()
    following = np.roll(vectors, -1, axis=1)
    turn = vectors[..., 0] * following[..., 1] - vectors[..., 1] * following[..., 0]
    assert (turn > 0).all()


def test_mesh_covers_the_mask_in_sketch_coordinates_with_y_up(field, tmp_path):
    _, vertices, triangles = read_rawfield(cf.write_field(field, tmp_path / "field.rawfield"))
    corner = vertices[triangles]
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    area = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    assert area == pytest.approx(np.full(14, 2.5**2 / 2))
    grid, centre = field.instance.grid, corner.reshape(7, 6, 3)
    middle = (centre.min(axis=1) + centre.max(axis=1)) / 2
    assert middle[:, 0] == pytest.approx(-1.25 + 2.5 * (grid.columns + 0.5))
    assert middle[:, 1] == pytest.approx(-(1e-3 + 2.5 * (grid.rows + 0.5)))
    assert set(triangles.ravel()) == set(range(len(vertices)))


@pytest.mark.parametrize("name", ["singular", "ring"])
def test_singularities_are_the_vertices_round_which_the_crosses_turn(tmp_path, name):
    field = cf.power_field(cf.sample(name, 12))
    _, vertices, _ = read_rawfield(cf.write_field(field, tmp_path / "field.rawfield"))
    head, *rows = (tmp_path / "field.sings").read_text().splitlines()
    vertex, index = np.array([row.split() for row in rows], dtype=int).reshape(-1, 2).T
    singularities, (x, y), size = field.singularities, field.instance.origin, field.instance.pixel_size
    across, down = x + size * (singularities.column + 1), -(y + size * (singularities.row + 1))
    places = np.column_stack([across, down, 4 * singularities.index])
    assert head == f"4 {len(rows)}"
    stated = np.column_stack([vertices[vertex, :2], index])
    assert sorted(map(tuple, stated.round(6).tolist())) == sorted(map(tuple, places.round(6).tolist()))
    assert rows or name != "singular"
