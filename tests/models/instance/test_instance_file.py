"""Instance files: what may be left out, and one named line for every kind of damage."""

import json

import crossfield as cf
import numpy as np
import pytest
from archives import pack_arrays
from damage import change, full_instance, refused, without
from loops import for_each
from meshes import box, on_edges


@pytest.fixture(scope="module")
def instance():
    return full_instance()


@pytest.fixture(scope="module")
def on_mesh():
    weights = np.linspace(0.5, 2, 18)
    return on_edges(box(), orthogonal=False, gauge="box", source="a box.obj", pair_weights=weights)


BEGIN = {"format": "crossfield-instance", "version": 1, "name": "a"}


def test_json_needs_only_name_mask_and_strokes_and_may_have_a_byte_order_mark(tmp_path):
    path = tmp_path / "short.json"
    path.write_text("\ufeff" + json.dumps(BEGIN | {"mask": ["#"], "strokes": [[0, 0, 1, 1]]}), "utf-8")
    instance = cf.read_instance(path)
    assert (instance.gauge, instance.pixel_size) == ("strokes", 1)
    assert (instance.stroke_coefficient, instance.skew_coefficient) == (1, 1e-6)


@for_each(
    "edit,message",
    [
        (change("format", "other"), '"format" must be "crossfield-instance"'),
        (change("version", 2), "has version 2, but this program reads version 1"),
        (change("name", "Big"), "$.name: 'Big' does not match"),
        (change("gauge", "none"), "$.gauge: 'none' is not one of"),
        (change("source", "a\u2028b\nc"), "source holds a line break"),
        (change("w_strokes", -1), "$.w_strokes: -1 is less than the minimum of 0"),
        (change("mask", ["##", "#x"]), "$.mask[1]: '#x' does not match"),
        (change("mask", ["##", "#"]), "mask row 1 has 1 pixels, the first one 2; make them equal"),
        (change("mask", ["#..."] * 3), "stroke pixel [1, 1]: is outside the mask"),
        (change("strokes", [[0.5, 0, 1, 1]]), "$.strokes[0][0]: 0.5 is not of type 'integer'"),
        (change("strokes", [[0, 0, float("nan"), 1]]), "stroke pixel [0, 0]: theta is not a finite number"),
        (change("extra", 1), "$: Additional properties are not allowed ('extra' was unexpected)"),
        (without("name"), "'name' is a required property"),
        (lambda _: None, '"format" must be'),
    ],
)
def test_json_that_breaks_the_rules_is_named_with_its_place(instance, tmp_path, edit, message):
    path = cf.write_instance(instance, tmp_path / "broken.json")
    path.write_text(json.dumps(edit(json.loads(path.read_text()))))
    refused(cf.read_instance, path, message)


@for_each("column", range(4))
@for_each("entry", [True, None, "1", [1], {}, -1, 0.5, 10**400])
def test_one_wrong_entry_of_many_rows_is_found(column, entry, tmp_path):
    strokes = [[row, column, 0.3, 0.5] for row in range(20) for column in range(20)]
    strokes[217][column] = entry
    (tmp_path / "many.json").write_text(json.dumps(BEGIN | {"mask": ["#" * 20] * 20, "strokes": strokes}))
    if (column, entry) in [(2, -1), (2, 0.5), (3, 0.5)]:  # an angle, and a weight
        cf.read_instance(tmp_path / "many.json")
        return
    with pytest.raises(cf.InstanceError, match=r"many\.json: .*(strokes\[217\]|beyond the range)"):
        cf.read_instance(tmp_path / "many.json")


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
    ],
)
def test_meshes_that_break_the_rules_are_named_with_their_place(on_mesh, tmp_path, edit, message):
    path = cf.write_instance(on_mesh, tmp_path / "broken.json")
    path.write_text(json.dumps(edit(json.loads(path.read_text()))))
    refused(cf.read_instance, path, message)


@for_each(
    "data,message",
    [
        (b"[" * 100_000, "is not valid JSON"),
        (b'{"version": ' + b"9" * 5000 + b"}", "is not valid JSON"),
        (b'{"version": 1, "gauge": 1, "gauge": 2}', "is not valid JSON: the key 'gauge' appears twice"),
        (b"\xff\xfe\x00\x01", "is neither JSON nor .npz"),
        (b"PK\x03\x04 this is no archive", "is a damaged or unsafe .npz"),
    ],
)
def test_what_is_no_instance_file_is_refused(tmp_path, data, message):
    path = tmp_path / "junk.json"
    path.write_bytes(data)
    refused(cf.read_instance, path, message)


def header(text):
    return np.frombuffer(text, np.uint8)


HEAD = b'{"format": "crossfield-instance", "version": %d}'


@for_each(
    "kind,name,array,message",
    [
        ("grid", "theta", np.array([0.1, np.nan, 0.2]), "stroke pixel [1, 1]: theta is not a finite number"),
        ("grid", "stroke_pixels", np.array([[0, 0], [1, 1], [2, 2**40]]), "something other than whole"),
        ("grid", "mask", np.ones(3, dtype=bool), "array 'mask' has shape (3,); expected 2 dimensions"),
        ("grid", "head", np.zeros(4, np.uint8), "its array 'head' is not JSON text"),
        ("grid", "head", header(b"[]"), '"format" must be'),
        ("grid", "head", header(HEAD % 7), "has version 7"),
        ("grid", "head", header(HEAD % 1), "wrong kind: 'name'"),
        ("grid", "w", None, "holds no array 'w'"),
        ("mesh", "faces", np.zeros((12, 3)), "not numbers of the kind that belongs there"),
        ("mesh", "faces", np.full((12, 3), 99, np.int32), "a vertex does not exist in face"),
        ("mesh", "vertices", np.zeros((8, 2)), "give vertices as (v, 3)"),
        ("mesh", "mask", np.ones((1, 1), bool), "holds an array 'mask' that does not belong in it"),
    ],
)
def test_npz_that_breaks_the_rules_is_named(instance, on_mesh, tmp_path, kind, name, array, message):
    path = cf.write_instance({"grid": instance, "mesh": on_mesh}[kind], tmp_path / "broken.npz")
    entries = dict(np.load(path)) | {name: array}
    path.write_bytes(pack_arrays({key: value for key, value in entries.items() if value is not None}))
    refused(cf.read_instance, path, message)
