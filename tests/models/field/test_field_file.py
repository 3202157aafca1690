"""Field files: there and back, byte for byte, and one named line for every kind of damage."""

import json
from contextlib import suppress

import numpy as np
import pytest
from crossfield.models.array_archive import pack_arrays
from crossfield.models.errors import CrossfieldError, InputError
from crossfield.models.field.field import CrossField
from crossfield.models.field.file import read_field, write_field
from crossfield.models.instance.angles import HALF
from crossfield.models.instance.file import read_instance, write_instance
from crossfield.models.instance.instance import Instance
from crossfield.models.samples.samples import sample
from crossfield.models.smooth.polyvector import power_field
from damage import change, full_instance, refused, same_instance, without
from exhaustive import random_field
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from loops import for_each
from meshes import box, flat_sheet, on_edges

# The file is written anew in every example, so sharing the folder is harmless.
settings.register_profile("files", suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
files = settings.get_profile("files")


@pytest.fixture(params=["pixels", "faces"])
def domain(request):
    return request.param


@pytest.fixture
def instance():
    return full_instance()


@pytest.fixture
def on_either(domain, instance):
    """A field on pixels, or on a mesh with a weight for each pair."""
    if domain == "pixels":
        return random_field(instance, 1)
    return random_field(on_edges(box(), orthogonal=False, pair_weights=np.linspace(0.5, 2, 18)), 1)


@pytest.fixture
def field(instance):
    return random_field(instance, 1)


def same_field(one, other):
    angles = (one.alpha == other.alpha).all() and (one.beta == other.beta).all()
    return angles and (one.p == other.p).all() and same_instance(one.instance, other.instance)


@pytest.mark.parametrize("suffix", ["json", "npz"])
def test_field_comes_back_and_gives_the_same_bytes(on_either, tmp_path, suffix):
    first = write_field(on_either, tmp_path / f"one.{suffix}")
    back = read_field(first)
    assert same_field(on_either, back)
    second = write_field(back, tmp_path / f"two.{suffix}")
    assert first.read_bytes() == second.read_bytes()


def test_json_states_each_jump_beside_its_pixel(tmp_path):
    instance = Instance.on_pixels("small", [[1, 1], [1, 0]], [[0, 0]], [1.0], [1.0])
    field = CrossField(instance, [0.1, 0.2, 0.3], [0, 0.5, 0], [-1, 2])
    document = json.loads(write_field(field, tmp_path / "small.json").read_text())
    assert document["pixels"] == [
        [0, 0, 0.1, 0.0, None, -1],
        [0, 1, 0.2, 0.5, None, None],
        [1, 0, 0.3, 0.0, 2, None],
    ]


def test_json_of_a_mesh_states_each_jump_with_its_faces(tmp_path):
    instance = on_edges(flat_sheet(1, 1), boundary=False)
    field = CrossField(instance, [0.1, 0.2], [0, 0], [-1])
    path = write_field(field, tmp_path / "small.json")
    document = json.loads(path.read_text())
    assert (document["faces"], document["jumps"]) == ([[0.1, 0], [0.2, 0]], [[1, 0, -1]])
    for key, value, message in (
        ("jumps", [[0, 1, -1]], "$.jumps: lists other pairs of faces than the mesh has"),
        ("jumps", [[1, 0, 0.5]], "$.jumps[0][2]: 0.5 is not of type 'integer'"),
        ("faces", [[0.1, 0]], "alpha has shape (1,)"),
        ("faces", [[0.1, 0.1], [0.2, 0]], "beta is not 0 everywhere"),
        ("pixels", [], "$: False schema does not allow []"),
    ):
        path.write_text(json.dumps(document | {key: value}))
        refused(read_field, path, message)


def test_unknown_ending_is_refused_before_anything_is_written(field, tmp_path):
    for name in ("field.txt", "field", "field.obj"):
        with pytest.raises(InputError, match=r"selects no format; choose one of \.npz, \.json, \.rawfield"):
            write_field(field, tmp_path / name)
    refused(
        read_field,
        tmp_path / "a.obj",
        "has the suffix '.obj', which selects no format; choose one of .npz, .json, .rawfield",
        InputError,
    )
    assert list(tmp_path.iterdir()) == []


def pixel(number, column, value):
    def edit(document):
        document["pixels"][number][column] = value
        return document

    return edit


@for_each(
    "edit,message",
    [
        (change("format", "crossfield-instance"), '"format" must be "crossfield-field"'),
        (change("version", 2), "has version 2"),
        (change("extra", 1), "$: Additional properties"),
        (without("pixels"), "'pixels' is a required property"),
        (change("pixels", [[0, 0, 0, 0, None, None]]), "has 1 pixels, but its mask has 7"),
        (
            lambda d: d | {"instance": d["instance"] | {"gauge": "x"}},
            "its instance: $.gauge: 'x' is not one of",
        ),
        (pixel(3, 1, 2), "$.pixels[3]: is [1, 2], but the mask has [1, 0] there"),
        (pixel(0, 2, None), "$.pixels[0][2]"),
        (pixel(0, 2, float("nan")), "alpha holds a value that is not finite"),
        (pixel(0, 3, 10**400), "beyond the range of doubles"),
        (
            pixel(0, 4, 1),
            "$.pixels[0]: a jump belongs where the mask has the upper neighbour, null elsewhere",
        ),
        (pixel(0, 5, None), "$.pixels[0]: a jump belongs where the mask has the right neighbour"),
    ],
)
def test_field_json_that_breaks_the_rules_is_named_with_its_place(field, tmp_path, edit, message):
    path = write_field(field, tmp_path / "broken.json")
    path.write_text(json.dumps(edit(json.loads(path.read_text()))))
    refused(read_field, path, message)


@for_each(
    "name,array,message",
    [
        ("alpha", np.zeros(3), "alpha has shape (3,), but sample needs (7,)"),
        ("beta", np.full(7, np.nan), "beta holds a value that is not finite"),
        ("p", None, "holds no array 'p'"),
        ("instance_w", None, "its instance: holds no array 'w'"),
        ("instance_theta", np.full(3, np.inf), "its instance: stroke pixel [0, 0]: theta"),
        ("head", np.frombuffer(b'{"format": "crossfield-field", "version": 2}', np.uint8), "has version 2"),
    ],
)
def test_field_npz_that_breaks_the_rules_is_named(field, tmp_path, name, array, message):
    path = write_field(field, tmp_path / "broken.npz")
    entries = dict(np.load(path)) | {name: array}
    path.write_bytes(pack_arrays({key: value for key, value in entries.items() if value is not None}))
    refused(read_field, path, message)


def test_instance_is_no_field_and_field_no_instance(instance, field, tmp_path):
    for suffix in ("json", "npz"):
        refused(read_field, write_instance(instance, tmp_path / f"i.{suffix}"), "")
        refused(read_instance, write_field(field, tmp_path / f"f.{suffix}"), "")


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
    vectors, _, triangles = read_rawfield(write_field(field, tmp_path / "field.rawfield"))
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
    _, vertices, triangles = read_rawfield(write_field(field, tmp_path / "field.rawfield"))
    corner = vertices[triangles]
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    area = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    assert area == pytest.approx(np.full(14, 2.5**2 / 2))
    grid, centre = field.instance.grid, corner.reshape(7, 6, 3)
    middle = (centre.min(axis=1) + centre.max(axis=1)) / 2
    assert middle[:, 0] == pytest.approx(-1.25 + 2.5 * (grid.columns + 0.5))
    assert middle[:, 1] == pytest.approx(-(1e-3 + 2.5 * (grid.rows + 0.5)))
    assert set(triangles.ravel()) == set(range(len(vertices)))


@pytest.mark.parametrize("name", ["singular", "ring", "bottle"])
def test_singularities_are_the_vertices_round_which_the_crosses_turn(tmp_path, name):
    field = power_field(sample(name, 16))
    _, vertices, _ = read_rawfield(write_field(field, tmp_path / "field.rawfield"))
    head, *rows = (tmp_path / "field.sings").read_text().splitlines()
    vertex, index = np.array([row.split() for row in rows], dtype=int).reshape(-1, 2).T
    singularities, (x, y), size = field.singularities, field.instance.origin, field.instance.pixel_size
    places = np.column_stack(
        [
            x + size * (singularities.column + 1),
            -(y + size * (singularities.row + 1)),
            4 * singularities.index,
        ]
    )
    assert head == f"4 {len(rows)}"
    stated = np.column_stack([vertices[vertex, :2], index])
    assert sorted(map(tuple, stated.round(6).tolist())) == sorted(map(tuple, places.round(6).tolist()))
    assert rows or name != "singular"


# Whatever the bytes


def only_named_errors(read, path):
    with suppress(CrossfieldError):
        read(path)


@pytest.mark.parametrize("suffix", ["json", "npz"])
@given(data=st.data())
@settings(files, max_examples=120)
def test_mutated_files_give_named_errors(on_either, tmp_path, suffix, data):
    for write, read, thing in (
        (write_instance, read_instance, on_either.instance),
        (write_field, read_field, on_either),
    ):
        content = bytearray(write(thing, tmp_path / f"whole.{suffix}").read_bytes())
        path = tmp_path / f"mutated.{suffix}"
        for _ in range(data.draw(st.integers(1, 4))):
            at = data.draw(st.integers(0, len(content) - 1))
            content[at : at + data.draw(st.integers(0, 8))] = data.draw(st.binary(max_size=8))
        path.write_bytes(
            content[: data.draw(st.integers(0, len(content)))] if data.draw(st.booleans()) else content
        )
        only_named_errors(read, path)


@given(seed=st.integers(0, 2**32 - 1), suffix=st.sampled_from(["json", "npz"]))
@settings(files)
def test_any_field_comes_back(tmp_path, seed, suffix):
    rng = np.random.default_rng(seed)
    mask = rng.random(rng.integers(1, 8, 2)) < 0.7
    mask[0, 0] = True
    at = np.argwhere(mask)
    instance = Instance.on_pixels(
        "random",
        mask,
        at,
        rng.uniform(-HALF, HALF, len(at)),
        1 - rng.random(len(at)),
        origin=tuple(rng.normal(size=2)),
    )
    field = random_field(instance, seed)
    assert same_field(field, read_field(write_field(field, tmp_path / f"f.{suffix}")))
