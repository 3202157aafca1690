"""Blocks of records: numbers that survive, no seam between blocks in any format, and extreme coefficients."""

import gzip
import math
import re

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.formats import mps
from crossfield.export.formats.registry import FORMATS
from crossfield.export.programs.casadi import read_nl
from crossfield.export.writing import records
from crossfield.export.writing.records import (
    Decimals,
    check_coefficients,
    number_text,
    render,
    signed_texts,
    words,
)
from folders import contents
from hypothesis import given
from hypothesis import strategies as st
from instance_kinds import grid, kind
from loops import for_each

NASTY = [
    0.0, -0.0, 1.0, -1.0, 3.0, 0.1, 0.1 + 0.2, 1 / 3, -2 / 3, math.pi, math.pi / 2, 1e-6, 1e-9, -1e-9, 5e-324,
    2.2250738585072014e-308, 1.7976931348623157e308, 1e15, 1e15 - 1, 999999999999999.9, 1e16, 1e22, 1e23,
    -1e22, 2.0**53, 123456789012345680.0, 0.30000000000000004, 1e-5, 0.0001,
]  # fmt: skip
FINITE = st.sampled_from(NASTY) | st.floats(allow_nan=False, allow_infinity=False)
NEAR = st.builds(
    lambda first, step: first + step, st.sampled_from([0.0, 1e14, 1e16, 0.25]), st.integers(-60, 60)
)
"""Whole numbers close together, which are numbered without sorting, and where that is not exact."""


@given(st.lists(FINITE, min_size=1, max_size=30) | st.lists(NEAR, min_size=1, max_size=20))
def test_any_number_survives_and_none_is_longer_than_needed(values):
    array = np.array(values)
    for content, count in ((words(array), len(values)), (words(array, signed_texts), len(values))):
        lines = b"".join(render([content, b"\n"], count)).decode().splitlines()
        assert [float(line.replace(" ", "")) for line in lines] == values
    for value in values:
        text = number_text(value)
        assert words(value) == text.encode()
        assert float(text) == value
        assert not text.startswith("-0") or value != 0
        assert len(text) <= len(repr(value))
        assert words(value, signed_texts)[:2] in (b"+ ", b"- ")


@pytest.mark.parametrize("first", [0, 95, 99_999_990, 2_147_483_628])
def test_whole_numbers_grow_a_digit_within_a_block_and_between_blocks(first, monkeypatch):
    values = np.arange(first, first + 20)
    for block in (1, 3, 10, 100):
        monkeypatch.setattr(records, "BLOCK", block)
        chunks = render([b"v", Decimals(values), b" ", Decimals(values[::-1]), b"\n"], 20)
        pairs = zip(values, values[::-1], strict=True)
        assert b"".join(chunks) == b"".join(b"v%d %d\n" % pair for pair in pairs)


def written(problem, path, **options):
    """The bytes of all files of a format, by name."""
    return {name: (path.parent / name).read_bytes() for name in cf.write(problem, path, **options).files}


@for_each("suffix", FORMATS)
@for_each("name", ["miqcp-bilinear", "milp-mccormick"])
def test_blocks_leave_no_seam_in_any_format(name, suffix, tmp_path, monkeypatch):
    """Lines of pixels: families of 4 k - 1, 4 k and 4 k + 1 records."""
    for count in (4, 5):
        field = cf.greedy_field(grid("/" + "#" * (count - 1)))
        start = field if FORMATS[suffix].has_start else None
        options = {"path": tmp_path / f"x.{suffix}", "start": start}
        problem = cf.formulate(field.instance, name)
        expected = written(problem, **options)
        for block in (1, 4):
            with monkeypatch.context() as patch:
                patch.setattr(records, "BLOCK", block)
                patch.setattr(mps, "_COLUMNS", max(block, 2))
                assert written(problem, **options) == expected


@for_each("suffix", FORMATS)
def test_compressed_files_hold_the_same_bytes(suffix, tmp_path):
    problem = cf.formulate(kind("hole"), "milp-mccormick")
    plain = written(problem, tmp_path / f"x.{suffix}")
    for name, data in written(problem, tmp_path / f"x.{suffix}.gz").items():
        assert name.endswith((".gz", ".row", ".col"))
        assert b"kind" not in data[:40] or not name.endswith(".gz")  # neither name nor time in the head
        content = gzip.decompress(data) if name.endswith(".gz") else data
        assert content == plain[name.removesuffix(".gz")]


# coefficients that readers drop


@pytest.mark.parametrize("value", [9.9e-10, -1e-12, 5e-324, 1e15, -1e20, math.inf, math.nan])
def test_extreme_coefficients_are_refused(value):
    words = r"row family c14 has the coefficient .*: make .*stroke weight or the skew weight"
    with pytest.raises(cf.UnsupportedByFormatError, match=words):
        check_coefficients(np.array([1.0, value]), "row family c14")
    check_coefficients(np.array([0.0, 1e-9, -9.9e14]), "row family c14")


@for_each("suffix", FORMATS)
@for_each("name, weights", [
        ("milp-mccormick", {"skew_coefficient": 1e-10}),
        ("milp-mccormick", {"skew_coefficient": 1e-14}),  # below the noise of what cancels
        ("milp-mccormick", {"stroke_coefficient": 1e-11}),
        ("qp-fixed", {"stroke_coefficient": 1e-11}),
    ])  # fmt: skip
def test_extreme_weights_are_refused_and_what_was_there_stays(name, weights, suffix, tmp_path):
    if (suffix, name) == ("nl", "qp-fixed"):  # readers keep all numbers of a nonlinear objective
        return
    instance, light = grid("/## #/#"), grid("/## #/#", **weights)
    jumps = {"p": cf.greedy_field(instance).p} if name == "qp-fixed" else {}
    before = written(cf.formulate(instance, name, **jumps), tmp_path / f"x.{suffix}")
    problem = cf.formulate(light, name, **jumps)
    with pytest.raises(cf.UnsupportedByFormatError, match=r"has the coefficient \d.*(stroke|skew) weight"):
        cf.write(problem, tmp_path / f"x.{suffix}")
    assert contents(tmp_path) == before


def test_a_small_weight_that_is_added_to_others_is_no_coefficient(tmp_path):
    instance = grid("/#", skew_coefficient=5e-10, stroke_coefficient=0)
    cf.write(cf.formulate(instance, "qp-fixed", p=[0]), tmp_path / "x.lp")
    assert " + 4.000000001 beta_00_01 ^2\n" in (tmp_path / "x.lp").read_text()


def test_starting_values_are_no_coefficients(tmp_path):
    """None is refused, each survives."""
    field = cf.greedy_field(grid("//"))
    field = cf.CrossField(field.instance, field.alpha, [1e-150, -3e-17], field.p)
    cf.write(cf.formulate(field.instance, "milp-mccormick"), tmp_path / "x.nl", start=field)
    assert {1e-150, -3e-17} < set(read_nl(tmp_path / "x.nl").start.tolist())


def refusals(instance, folder):
    """Reasons of writers to refuse an instance, except polynomials beyond a format's degree."""
    chosen = {"formulations": ["milp-mccormick", "miqp-exact"], "formats": [*FORMATS]}
    manifests = cf.write_all(instance, folder, **chosen)
    return [reason for manifest in manifests for reason in manifest.document["refused"].values()]


@pytest.mark.parametrize(
    "refused, better",
    [
        ({"theta": 2e-8, "w": 1e-3}, {"theta": 0.0, "w": 1e-3}),
        ({"skew_coefficient": 1e-11}, {"skew_coefficient": 1e-8}),
        ({"skew_coefficient": 1e-11}, {"skew_coefficient": 0.0}),
    ],
)
def test_the_advice_of_a_writer_helps(refused, better, tmp_path):
    """A stroke that is nearly horizontal has a tiny cost at all weights; its direction can be changed."""
    reasons = refusals(grid("/#", **{"theta": 1.0} | refused), tmp_path / "refused")
    assert reasons
    for reason in reasons:
        assert "nearly horizontal exactly 0" in reason
        assert "larger (0 removes a term)" in reason
        assert not re.search(r"np\.|\barray\(|dtype", reason)  # numbers of NumPy
    assert refusals(grid("/#", **{"theta": 1.0} | better), tmp_path / "written") == []
