"""Blocks of records: parts by hand, numbers that survive, and no seam between blocks in any format."""

from __future__ import annotations

import gzip
import math
import struct

import numpy as np
import pytest
from cases import make_field, make_instance, make_problem, points_of
from crossfield.export.formats import nl
from crossfield.export.formats.registry import FORMATS, write
from crossfield.export.writing import records
from crossfield.export.writing.canonical import CanonicalForm
from crossfield.export.writing.nl_order import NlOrder
from crossfield.export.writing.records import (
    Decimals,
    OptionalPieces,
    RawValues,
    TaggedWords,
    Words,
    check_coefficients,
    digits,
    number_text,
    render,
    signed_texts,
    word_table,
    words,
)
from crossfield.models.errors import UnsupportedByFormatError
from crossfield.models.instance.instance import Instance
from folders import contents
from hypothesis import given
from hypothesis import strategies as st
from loops import for_each

NASTY = [
    0.0, -0.0, 1.0, -1.0, 3.0, 0.1, 0.1 + 0.2, 1 / 3, -2 / 3, math.pi, math.pi / 2, 1e-6, 1e-9, -1e-9, 5e-324,
    2.2250738585072014e-308, 1.7976931348623157e308, 1e15, 1e15 - 1, 999999999999999.9, 1e16, 1e22, 1e23,
    -1e22, 2.0**53, 123456789012345680.0, 0.30000000000000004, 1e-5, 0.0001,
]  # fmt: skip
FINITE = st.floats(allow_nan=False, allow_infinity=False)


def text(parts, count, **options) -> bytes:
    return b"".join(render(parts, count, **options))


# numbers


@given(st.sampled_from(NASTY) | FINITE)
def test_any_number_survives_and_none_is_longer_than_needed(value):
    assert float(number_text(value)) == value
    assert not number_text(value).startswith("-0") or value != 0
    assert len(number_text(value)) <= len(repr(value))
    sign, rest = words(value, signed_texts).decode().split(" ")
    assert sign in "+-"
    assert not rest.startswith(("+", "-"))
    assert float(sign + rest) == value


def test_numbers_look_as_people_write_them():
    numbers = [0.0, -0.0, 3.0, -2.0, 0.5, 1e-6, 1e22, 1e14]
    assert [number_text(value) for value in numbers] == [
        "0",
        "0",
        "3",
        "-2",
        "0.5",
        "1e-06",
        "1e+22",
        "100000000000000",
    ]
    assert signed_texts(np.array(numbers[:4])).tolist() == [b"+ 0", b"+ 0", b"+ 3", b"- 2"]
    assert number_text(np.float64(0.1)) == "0.1"
    assert number_text(np.int32(7)) == "7"


@given(st.lists(FINITE, min_size=1, max_size=30))
def test_words_are_the_numbers_of_an_array(values):
    texts = words(np.array(values))
    lines = text([texts, b"\n"], len(values)).decode().splitlines()
    assert [float(line) for line in lines] == values
    assert lines == [number_text(value + 0.0) for value in values]
    assert words(values[0]) == number_text(values[0]).encode()


# parts by hand


def test_decimals_have_no_leading_zeros():
    values = np.array([0, 7, 10, 99, 100, 2147483647])
    assert text([Decimals(values), b"\n"], 6) == b"0\n7\n10\n99\n100\n2147483647\n"
    assert Decimals(values).width == 10
    assert Decimals(np.zeros(0, int)).width == 1
    assert bytes(digits(np.array([7, 123]), 4)) == b"00070123"


def test_raw_values_keep_their_zero_bytes():
    parts = [
        b"x",
        RawValues(np.array([1, 0, 256], dtype="<i4")),
        RawValues(np.array([0.5, -0.0, 1e300], dtype="<f8")),
    ]
    expected = b"".join(b"x" + struct.pack("<id", i, d) for i, d in [(1, 0.5), (0, -0.0), (256, 1e300)])
    assert text(parts, 3, padded=False) == expected


@given(
    st.lists(st.integers(-60, 60), min_size=1, max_size=20), st.sampled_from([0.0, 1e14, 1e16, 2.0**60, 0.25])
)
def test_whole_numbers_close_together_are_words_too(steps, first):
    """They are numbered without sorting, where that is exact."""
    values = first + np.array(steps, dtype=float)
    assert text([words(values), b" "], len(values)).decode().split() == [
        number_text(value) for value in values
    ]


@given(st.lists(st.tuples(*[st.booleans()] * 4), min_size=1, max_size=40), st.booleans())
def test_any_records_lack_any_pieces(present, whole):
    """Neighbours, first and last piece, all of them, words of several lengths between; whole: no more."""
    count = len(present)
    key = Words(word_table([b"%d" % 7**at for at in range(count)]), None)
    first, second, third, last = np.array(present).T
    middle = [] if whole else [b"-", key]
    parts = [
        OptionalPieces(first, [b"(", key]),
        OptionalPieces(second, [TaggedWords(b"t", key), b","]),
        *middle,
        OptionalPieces(third, [b"!"]),
        OptionalPieces(last, [key.at(np.arange(count)[::-1]), b";"]),
    ]
    expected = b"".join(
        b"(%d" % 7**at * a
        + b"t%d," % 7**at * b
        + b"-%d" % 7**at * (not whole)
        + b"!" * c
        + b"%d;" % 7 ** (count - 1 - at) * d
        for at, (a, b, c, d) in enumerate(present)
    )
    assert text(parts, count) == expected


@pytest.mark.parametrize("pieces", [15, 17, 70])
def test_records_lack_any_of_many_pieces(pieces):
    """Columns on long cycles are in rows of many kinds: patterns of presence are no small numbers."""
    present = np.random.default_rng(1).random((pieces, 300)) < 0.3
    present[:, 0], present[-1, 1] = False, True
    parts = [OptionalPieces(where, [b"%d," % number]) for number, where in enumerate(present)]
    expected = "".join(f"{number}," for row in present.T for number in np.flatnonzero(row))
    assert text(parts, 300).decode() == expected


@pytest.mark.parametrize("first", [0, 7, 95, 9_990, 99_999_990])
def test_numbers_grow_a_digit_within_a_block_and_between_blocks(first, monkeypatch):
    values = np.arange(first, first + 20, dtype=np.int32)
    for block in (1, 3, 10, 100):
        monkeypatch.setattr(records, "BLOCK", block)
        chunks = list(render([b"v", Decimals(values), b" ", Decimals(values[::-1]), b"\n"], 20))
        assert b"".join(chunks) == b"".join(
            b"v%d %d\n" % pair for pair in zip(values, values[::-1], strict=True)
        )


# blocks


LAYOUTS = [(name, dialect) for name, entry in FORMATS.items() for dialect in entry.dialects]


def written(problem, path, **options):
    """The bytes of all files of a format, by name."""
    return {name: (path.parent / name).read_bytes() for name in write(problem, path, **options).files}


@for_each("suffix, dialect", LAYOUTS)
@for_each("name", ["miqcp-bilinear", "milp-mccormick", "minlp-cubic"])
def test_blocks_leave_no_seam_in_any_format(name, suffix, dialect, tmp_path, monkeypatch):
    """Lines of pixels: families of 4 k - 1, 4 k and 4 k + 1 records; and one pixel."""
    for count in (1, 4, 5):
        instance = Instance.on_pixels("line", np.ones((1, count), bool), [[0, 0]], [2.5], [0.5])
        problem, field = make_problem(name, instance), make_field(instance)
        start = field if FORMATS[suffix].has_start else None
        options = {"path": tmp_path / f"x.{suffix}", "dialect": dialect, "start": start}
        expected = written(problem, **options)
        for block in (1, 4):
            with monkeypatch.context() as patch:
                patch.setattr(records, "BLOCK", block)
                assert written(problem, **options) == expected


@for_each("suffix, dialect", LAYOUTS)
def test_compressed_files_hold_the_same_bytes(suffix, dialect, tmp_path):
    problem = make_problem("milp-mccormick", make_instance())
    plain = written(problem, tmp_path / f"x.{suffix}", dialect=dialect)
    for name, data in written(problem, tmp_path / f"x.{suffix}.gz", dialect=dialect).items():
        assert name.endswith((".gz", ".row", ".col"))
        assert b"tiny" not in data[:40] or not name.endswith(".gz")  # neither name nor time in the head
        content = gzip.decompress(data) if name.endswith(".gz") else data
        assert content == plain[name.removesuffix(".gz")]


# coefficients that readers drop


@pytest.mark.parametrize("value", [9.9e-10, -1e-12, 5e-324, 1e15, -1e20, math.inf, math.nan])
def test_extreme_coefficients_are_refused(value):
    with pytest.raises(
        UnsupportedByFormatError,
        match=r"row family c14 has the coefficient .*: make .*stroke weight or the skew weight",
    ):
        check_coefficients(np.array([1.0, value]), "row family c14")
    with pytest.raises(UnsupportedByFormatError, match=r"coefficient (\d|inf|nan)"):
        check_coefficients(np.float64(value), "the objective")


@for_each("suffix, dialect", LAYOUTS)
@for_each(
    "name, weights",
    [
        ("milp-mccormick", {"skew_coefficient": 1e-10}),
        ("milp-mccormick", {"skew_coefficient": 1e-14}),  # below the noise of what cancels
        ("milp-mccormick", {"stroke_coefficient": 1e-11}),
        ("qp-fixed", {"stroke_coefficient": 1e-11}),
    ],
)
def test_extreme_weights_are_refused_and_what_was_there_stays(name, weights, suffix, dialect, tmp_path):
    if (suffix, name) == ("nl", "qp-fixed"):  # readers keep all numbers of a nonlinear objective
        return
    before = written(make_problem(name, make_instance()), tmp_path / f"x.{suffix}", dialect=dialect)
    problem = make_problem(name, make_instance(**weights))
    with pytest.raises(UnsupportedByFormatError, match=r"has the coefficient \d.*(stroke|skew) weight"):
        write(problem, tmp_path / f"x.{suffix}", dialect=dialect)
    assert contents(tmp_path) == before


def test_a_small_weight_that_is_added_to_others_is_no_coefficient(tmp_path):
    write(make_problem("qp-fixed", make_instance(skew_coefficient=5e-10)), tmp_path / "x.lp")
    assert " + 8.000000001 beta_00_01 ^2\n" in (tmp_path / "x.lp").read_text()


def test_points_of_any_size_are_starting_points():
    """Starting values are not coefficients: none is refused, each survives."""
    problem = make_problem("qp-fixed", make_instance("row"))
    point = points_of(problem)[0] * 10.0 ** np.arange(-150, 150, 30)
    lines = b"".join(nl.generate(CanonicalForm(problem), start=point)).decode().splitlines()
    at = lines.index(f"x{problem.n_columns}")
    levels = [float(line.split()[1]) for line in lines[at + 1 : at + 1 + problem.n_columns]]
    np.testing.assert_array_equal(levels, point[NlOrder(problem).order])
