"""Raw fields read back: our own, and those of other programs on our mesh."""

import numpy as np
import pytest
from crossfield.models.errors import InputError, InstanceError
from crossfield.models.field.file import read_field, write_field
from crossfield.models.instance.angles import HALF
from exhaustive import random_field, random_instance
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from loops import for_each

pytestmark = pytest.mark.numeric


def assert_same_crosses(one, other):
    error = one.cross_error(other.alpha + other.beta, other.alpha + HALF - other.beta)
    assert error == pytest.approx(np.zeros(len(error)), abs=1e-9)


@given(seed=st.integers(0, 2**32 - 1), gauge=st.sampled_from(["strokes", "box"]))
@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
def test_a_written_field_comes_back(tmp_path, seed, gauge):
    field = random_field(random_instance(seed, gauge=gauge), seed)
    back = read_field(write_field(field, tmp_path / "field.rawfield", force=True), on=field.instance)
    assert_same_crosses(field, back)
    assert back.energy().total == pytest.approx(field.energy().total, rel=1e-9, abs=1e-9)


def raw(vectors):
    rows = "\n".join(" ".join(map(repr, row)) for row in vectors.reshape(len(vectors), 12).tolist())
    return f"4 {len(vectors)}\n{rows}\n"


def written(field, tmp_path):
    rows = write_field(field, tmp_path / "ours.rawfield").read_text().splitlines()[1:]
    return np.array([row.split() for row in rows], dtype=float).reshape(-1, 4, 3)


@for_each("scale", [1e-300, 1e-3, 1.0, 1e300])
def test_length_and_order_of_the_vectors_do_not_matter(scale, tmp_path):
    field = random_field(random_instance(1), 1)
    rng = np.random.default_rng(5)
    for vectors in (ours := written(field, tmp_path), ours[::2]):
        theirs = np.stack([row[rng.permutation(4)] for row in vectors]) * scale
        theirs = np.round(theirs / scale, 12) * scale * rng.uniform(0.5, 2, (len(theirs), 4, 1))
        path = tmp_path / "theirs.rawfield"
        path.write_text(raw(theirs))
        assert_same_crosses(field, read_field(path, on=field.instance))


def test_a_pixel_gets_the_lines_between_those_of_its_triangles(tmp_path):
    field = random_field(random_instance(1), 1)
    vectors = written(field, tmp_path)
    for side, turn in enumerate((0.1, -0.1)):
        matrix = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        vectors[side::2] = vectors[side::2] @ matrix
    vectors[1::2] = np.roll(vectors[1::2], 2, axis=1)
    path = tmp_path / "theirs.rawfield"
    path.write_text(raw(vectors))
    far = np.pi / 2 - 2 * np.abs(field.beta) > 0.3
    error = read_field(path, on=field.instance).cross_error(
        *(field.alpha + field.beta, field.alpha + HALF - field.beta)
    )
    assert far.any()
    assert error[far] == pytest.approx(np.zeros(far.sum()), abs=1e-9)


def row(*, number=3, text=None, change=None):
    """A change of one line of a file, counted from 1."""

    def changed(lines):
        words = lines[number - 1].split()
        lines[number - 1] = text if change is None else " ".join(change(words))
        return lines

    return changed


@for_each(
    "damage, message",
    [
        (lambda _: [], "line 1: is '', not the degree 4"),
        (row(number=1, text="hello"), "line 1: is 'hello', not the degree 4"),
        (row(number=1, text="2 50"), "line 1: has 2 vectors per face"),
        (row(number=1, text="4 7"), "line 1: has 7 faces, but"),
        (lambda lines: lines[:-1], "rows of vectors, but its first line states"),
        (lambda lines: [*lines, lines[-1]], "rows of vectors, but its first line states"),
        (row(change=lambda words: words[:11]), "line 3: has 11 numbers; give 12"),
        (row(change=lambda words: ["nan", *words[1:]]), "line 3: holds something other than numbers"),
        (row(change=lambda words: ["1_0", *words[1:]]), "line 3: holds something other than numbers"),
        (row(change=lambda words: ["1e1e1", *words[1:]]), "line 3: holds something other than numbers"),
        (row(change=lambda words: ["1e999", *words[1:]]), "line 3: holds a number beyond the range"),
        (row(change=lambda words: ["0", "0", "0", *words[3:]]), "line 3: holds a vector of length 0"),
        (row(change=lambda words: [*words[:2], "0.1", *words[3:]]), "line 3: has a vector out of the plane"),
        (row(text="1 0 0 0 1 0 -1 0 0 1 0 0"), "line 3: has no two pairs of opposite vectors"),
        (row(text="1 0 0 0 1 0 -1 0.1 0 0 -1 0"), "line 3: has no two pairs of opposite vectors"),
    ],
)
def test_damage_is_named_with_its_line(damage, message, tmp_path):
    field = random_field(random_instance(1), 1)
    path = write_field(field, tmp_path / "field.rawfield", force=True)
    path.write_text("\n".join(damage(path.read_text().splitlines())))
    with pytest.raises(InstanceError) as caught:
        read_field(path, on=field.instance)
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)


def test_no_more_is_read_than_the_instance_has_rows_for(tmp_path):
    field = random_field(random_instance(1), 1)
    path = tmp_path / "field.rawfield"
    path.write_bytes(b" " * 1_000_000)
    with pytest.raises(InputError, match=r"has 1000000 bytes; at most \d+ are read"):
        read_field(path, on=field.instance)


@given(
    data=st.binary(max_size=300), lines=st.lists(st.text("0123456789.eE+-_na \t", max_size=60), max_size=5)
)
@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_the_bytes_the_error_is_ours(data, lines, tmp_path):
    instance = random_field(random_instance(1), 1).instance
    path = tmp_path / "any.rawfield"
    text = "\n".join([f"4 {instance.grid.size}", *lines]).encode()
    for content in (data, text, f"4 {instance.grid.size}\n".encode() + data):
        path.write_bytes(content)
        with pytest.raises(InstanceError, match=r"any\.rawfield: "):
            read_field(path, on=instance)
