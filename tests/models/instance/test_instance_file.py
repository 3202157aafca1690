"""Instance files: there and back, byte for byte, and one named line for every kind of damage."""

import io
import json
import pickle
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from crossfield.models.array_archive import pack_arrays
from crossfield.models.errors import InputError
from crossfield.models.instance.file import instance_arrays, instance_to_json, read_instance, write_instance
from damage import change, full_instance, refused, same_instance, without
from loops import for_each
from meshes import box, on_edges, torus


@pytest.fixture
def instance():
    return full_instance()


@pytest.mark.parametrize("suffix", ["json", "npz"])
def test_instance_comes_back_and_gives_the_same_bytes(instance, tmp_path, suffix):
    first = write_instance(instance, tmp_path / f"one.{suffix}")
    back = read_instance(first)
    assert same_instance(instance, back)
    for name in ("name", "gauge", "source", "stroke_coefficient", "skew_coefficient", "pixel_size", "origin"):
        assert getattr(back, name) == getattr(instance, name)
    second = write_instance(back, tmp_path / f"two.{suffix}")
    assert first.read_bytes() == second.read_bytes()


def test_json_needs_only_name_mask_and_strokes(tmp_path):
    path = tmp_path / "short.json"
    document = {
        "format": "crossfield-instance",
        "version": 1,
        "name": "a",
        "mask": ["#"],
        "strokes": [[0, 0, 1, 1]],
    }
    path.write_text(json.dumps(document))
    instance = read_instance(path)
    assert (instance.gauge, instance.stroke_coefficient, instance.skew_coefficient, instance.pixel_size) == (
        "strokes",
        1,
        1e-6,
        1,
    )


@for_each(
    "edit,message",
    [
        (change("format", "other"), '"format" must be "crossfield-instance"'),
        (change("version", 2), "has version 2, but this program reads version 1"),
        (change("version", None), "has version None"),
        (change("name", "Big"), "$.name: 'Big' does not match"),
        (change("name", 5), "$.name: 5 is not of type 'string'"),
        (change("gauge", "none"), "$.gauge: 'none' is not one of"),
        (change("source", "a\u2028b\nc"), "source holds a line break"),
        (change("w_strokes", -1), "$.w_strokes: -1 is less than the minimum of 0"),
        (change("w_beta", float("nan")), "skew_coefficient is nan"),
        (change("pixel_size", 0), "$.pixel_size"),
        (change("origin", [0]), "$.origin"),
        (change("mask", ["##", "#x"]), "$.mask[1]: '#x' does not match"),
        (change("mask", ["##", "#"]), "mask row 1 has 1 pixels, the first one 2; make them equal"),
        (change("mask", ["#..."] * 3), "stroke pixel [1, 1]: is outside the mask"),
        (change("strokes", []), "no stroke lies inside the mask"),
        (change("strokes", [[0, 0, 1, 1, 1]]), "$.strokes[0]"),
        (change("strokes", [[0.5, 0, 1, 1]]), "$.strokes[0][0]: 0.5 is not of type 'integer'"),
        (change("strokes", [[0, 0, float("nan"), 1]]), "stroke pixel [0, 0]: theta is not a finite number"),
        (change("strokes", [[0, 0, 10**400, 1]]), "beyond the range of doubles"),
        (change("strokes", [[0, 0, 1, 0]]), "$.strokes[0][3]"),
        (
            change("strokes", [[0, 0, 1, 1], [0, 0, 1, 1]]),
            "stroke pixel [0, 0]: is out of order or listed twice",
        ),
        (change("extra", 1), "$: Additional properties are not allowed ('extra' was unexpected)"),
        (without("name"), "'name' is a required property"),
        (without("version"), "has version None"),
        (lambda _: None, '"format" must be'),
    ],
)
def test_json_that_breaks_the_rules_is_named_with_its_place(instance, tmp_path, edit, message):
    path = tmp_path / "broken.json"
    path.write_text(json.dumps(edit(json.loads(instance_to_json(instance)))))
    refused(read_instance, path, message)


@for_each(
    "data,message",
    [
        (b"", "is not valid JSON"),
        (b"{", "is not valid JSON"),
        (b"[" * 100_000, "is not valid JSON"),
        (b'{"version": ' + b"9" * 5000 + b"}", "is not valid JSON"),
        (b"\xff\xfe\x00\x01", "is neither JSON nor .npz"),
        (bytes(range(256)), "is neither JSON nor .npz"),
        (b"PK\x03\x04 this is no archive", "is a damaged or unsafe .npz"),
        (b"PK", "is a damaged or unsafe .npz"),
    ],
)
def test_what_is_no_instance_file_is_refused(tmp_path, data, message):
    path = tmp_path / "junk.json"
    path.write_bytes(data)
    refused(read_instance, path, message)


def test_json_with_a_byte_order_mark_is_read(instance, tmp_path):
    path = tmp_path / "bom.json"
    path.write_bytes(b"\xef\xbb\xbf" + instance_to_json(instance).encode())
    assert same_instance(read_instance(path), instance)


def test_missing_file_and_folder_are_named(tmp_path):
    refused(read_instance, tmp_path / "none.json", "cannot be read: no such file", InputError)
    refused(read_instance, tmp_path, "cannot be read: is a directory", InputError)


class Harmful:
    """Makes a folder when it is unpickled."""

    def __init__(self, folder):
        self.folder = str(folder)

    def __reduce__(self):
        return Path.mkdir, (Path(self.folder),)


def test_pickles_are_neither_read_nor_run(instance, tmp_path):
    folder = tmp_path / "made"
    path = write_instance(instance, tmp_path / "evil.npz")
    entries = dict(np.load(path))
    with zipfile.ZipFile(path, "w") as archive:
        for name, array in entries.items():
            stream = io.BytesIO()
            evil = np.array([Harmful(folder)], dtype=object) if name == "theta" else array
            np.lib.format.write_array(stream, evil, allow_pickle=True)
            archive.writestr(f"{name}.npy", stream.getvalue())
    refused(read_instance, path, "is a damaged or unsafe .npz")
    path.write_bytes(pickle.dumps(Harmful(folder)))
    refused(read_instance, path, "")
    assert not folder.exists()
    pickle.loads(path.read_bytes())
    assert folder.exists()


def test_npz_that_promises_too_much_is_refused(instance, tmp_path):
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (10**7,)})
    path = tmp_path / "bomb.npz"
    others = instance_arrays(instance)
    del others["theta"]
    path.write_bytes(pack_arrays(others))
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("theta.npy", head.getvalue() + b"12345678")
    refused(read_instance, path, "another length than its header states")


def test_a_key_that_is_there_twice_is_named(instance, tmp_path):
    path = tmp_path / "broken.json"
    path.write_text(instance_to_json(instance).replace('"mask"', '"gauge": "box",\n  "mask"', 1))
    refused(read_instance, path, "is not valid JSON: the key 'gauge' appears twice")


@for_each(
    "name,array,message",
    [
        ("theta", np.array(["a", "b", "c"]), "array 'theta' holds <U1, not numbers"),
        ("theta", np.array([0.1, 0.2]), "3 stroke pixels need as many theta and w, but there are 2 and 3"),
        ("theta", np.array([0.1, np.nan, 0.2]), "stroke pixel [1, 1]: theta is not a finite number"),
        (
            "stroke_pixels",
            np.array([[0, 0], [1, 1], [2, 2**40]]),
            "stroke_pixels holds something other than whole",
        ),
        ("mask", np.ones(3, dtype=bool), "array 'mask' has shape (3,); expected 2 dimensions"),
        ("origin", np.array([1.0]), "origin has shape (1,); give two numbers"),
        ("head", np.zeros(4, np.uint8), "its array 'head' is not JSON text"),
        ("head", np.frombuffer(b"[]", np.uint8), '"format" must be'),
        (
            "head",
            np.frombuffer(b'{"format": "crossfield-instance", "version": 7}', np.uint8),
            "has version 7",
        ),
        (
            "head",
            np.frombuffer(b'{"format": "crossfield-instance", "version": 1}', np.uint8),
            "wrong kind: 'name'",
        ),
        ("w", None, "holds no array 'w'"),
        ("crossings", np.zeros(1, np.int32), "array 'crossings' that does not belong in it"),
    ],
)
def test_npz_that_breaks_the_rules_is_named(instance, tmp_path, name, array, message):
    path = write_instance(instance, tmp_path / "broken.npz")
    entries = dict(np.load(path)) | {name: array}
    path.write_bytes(pack_arrays({key: value for key, value in entries.items() if value is not None}))
    refused(read_instance, path, message)


@pytest.fixture
def on_mesh():
    weights = np.linspace(0.5, 2, 18)
    return on_edges(box(), orthogonal=False, gauge="box", source="a box.obj", pair_weights=weights)


@pytest.mark.parametrize("suffix", ["json", "npz"])
def test_instances_on_meshes_and_of_right_angles_come_back(on_mesh, instance, tmp_path, suffix):
    for number, whole in enumerate((on_mesh, on_edges(torus(3, 3)), replace(instance, orthogonal=True))):
        first = write_instance(whole, tmp_path / f"{number}.{suffix}")
        back = read_instance(first)
        assert back.sha256 == whole.sha256
        assert back.orthogonal == whole.orthogonal
        assert write_instance(back, tmp_path / f"again.{suffix}").read_bytes() == first.read_bytes()
        assert (b"orthogonal" in first.read_bytes()) == whole.orthogonal or suffix == "npz"


@for_each(
    "edit,message",
    [
        (without("faces"), "'faces' is a required property"),
        (without("vertices"), "$: 'mask' is a required property"),
        (change("mask", ["#"]), "False schema does not allow ['#']"),
        (change("faces", [[0, 1, 99]]), "a vertex does not exist in face 0"),
        (change("faces", [[0, 1]]), "$.faces[0]: [0, 1] is too short"),
        (change("faces", [[0, 1, 1.5]]), "$.faces[0][2]: 1.5 is not of type 'integer'"),
        (change("vertices", [[0, 0, float("nan")]]), "has a coordinate that is not a number"),
        (change("strokes", [[0, 1, 0]]), "$.strokes[0][2]: 0 is less than or equal to the minimum of 0"),
        (change("strokes", [[99, 1, 1]]), "there is no face 99 for a stroke"),
        (change("pair_weights", [1]), "pair_weights has shape (1,); give one for each of 18 pairs"),
        (change("pair_weights", [0] * 18), "$.pair_weights[0]: 0 is less than or equal to the minimum of 0"),
        (change("orthogonal", 1), "$.orthogonal: 1 is not of type 'boolean'"),
    ],
)
def test_meshes_that_break_the_rules_are_named_with_their_place(on_mesh, tmp_path, edit, message):
    path = tmp_path / "broken.json"
    path.write_text(json.dumps(edit(json.loads(instance_to_json(on_mesh)))))
    refused(read_instance, path, message)


def test_arrays_of_a_mesh_are_checked(on_mesh, tmp_path):
    path = tmp_path / "broken.npz"
    arrays = instance_arrays(on_mesh)
    for name, other, message in (
        ("faces", arrays["faces"].astype(float), "not numbers of the kind that belongs there"),
        ("faces", arrays["faces"] + 7, "a vertex does not exist in face"),
        ("vertices", arrays["vertices"][:, :2].copy(), "give vertices as (v, 3)"),
        ("stroke_faces", arrays["stroke_faces"][:2], "need as many theta and w"),
        ("mask", np.ones((1, 1), bool), "holds an array 'mask' that does not belong in it"),
    ):
        path.write_bytes(pack_arrays(arrays | {name: other}))
        refused(read_instance, path, message)
