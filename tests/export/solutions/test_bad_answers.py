"""Answers that are damaged, cut, hostile or of other kinds: refused with file, place and remedy."""

import bz2
import gzip
import json
import lzma
import os
import re
import struct
import subprocess
import sys
import tracemalloc
from contextlib import suppress
from dataclasses import replace

import numpy as np
import places
import pytest
from answers import BAD, GOOD, problem, problem_of
from crossfield.export.solutions.readers import registry
from crossfield.export.solutions.readers.registry import parse_raw, read_raw
from crossfield.export.solutions.readers.text import values_by_name, values_in_order
from crossfield.export.solutions.solution import read_solution
from crossfield.export.statuses import Status
from crossfield.models.errors import InputError, SolutionError
from crossfield.models.input_limits import MAX_SOLUTION
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each

HERE = places.SOLUTIONS
OTHERS = sorted(HERE.glob("*.sol"))
"""Files of HiGHS and of AMPL's solvers."""

FAULTS = {
    "ampl_binary_cut": r"byte 93: the file is cut off",
    "ampl_binary_length_too_large": r"byte 93: the file is cut off",
    "ampl_code_is_a_word": r"line 17: 'objno 0 solved' is not",
    "ampl_count_too_large": r"line 11: 4000000000 numbers are announced, 5 whole lines follow",
    "ampl_cut_in_the_values": r"line 11: 5 numbers are announced, 2 whole lines follow",
    "ampl_solved_without_values": r"states solved but holds no values",
    "ampl_value_is_a_word": r"line 14: 'one' is not a number",
    "empty": r"the file is empty",
    "highs-1.15.1_optimal_style1": r"style 1 \(pretty\).*write_solution_style = 0",
    "highs-1.15.1_optimal_style3": r"style 3 \(GLPK pretty\).*write_solution_style = 0",
    "highs_count_too_large": r"line 7: 999999999999 columns are announced, 5 whole lines follow",
    "highs_cut_in_a_number": r"line 11: the file is cut off in the middle of this line",
    "highs_nul_byte": r"line 9: there is a byte that is not text",
    "highs_optimal_without_point": r"line 5: the file is Optimal but holds no point",
    "highs_value_is_nan": r"line 9: 'nan' is not a number",
    "junk": r"not a solution file of a known kind; give one of these: .*HiGHS",
    "baron-26.5.27_qp_sum": "summary of BARON, which holds no values; give its results",
    "baron_res_cut": "the end of the search is missing",
    "baron_res_value_missing": "line 180: 3 words stand where 4 should",
    "cbc_cut_in_a_line": "line 84: the file is cut off in the middle",
    "cbc_numbers_start_again_twice": "line 85: the numbers start again for the second time",
    "cplex-22.2.0.1_milp_integers": "writeLevel 2 and holds the integer columns only; use level 1",
    "cplex_cut": "line 39: the XML is damaged or cut off",
    "cplex_entities": "DTD or entities",
    "cplex_no_header": "no header with a status",
    "cplex_value_is_nan": "line 33: a variable has no name, or a value that is not a number",
    "gams_csv_no_columns": "the file holds no values",
    "gams_csv_no_solver_status": "it has no solver_status",
    "glpk_column_missing": "line 57: 35 columns are announced, 34 lines follow",
    "glpk_counts_are_words": "line 8: 's mip many 35 o",
    "glpk_cut": "it has no line `e o f`",
    "gurobi-13.0.3_milp_start": "line 1: this is a MIP start",
    "gurobi_cut_in_a_number": "line 8: the file is cut off in the middle",
    "gurobi_json_cut": "line 1: the JSON is damaged or cut off at column 900",
    "gurobi_json_no_status": "the SolutionInfo has no Status",
    "gurobi_json_optimal_without_vars": "states optimal but holds no values",
    "gurobi_json_value_is_nan": "x has no value",
    "gurobi_no_values": "the file holds no values",
    "miplib_objective_is_a_word": "line 1: 'unknown' is not a number",
    "scip-10.0_milp_partial": "line 1: this is a partial solution",
    "scip_cut_after_the_status": "the file is cut off: it has no objective",
    "scip_no_objective": "line 2: 4 words stand where 3 should",
    "scip_value_is_unknown": "line 5: 'unknown' is not a number",
    "xpress_slx_cut": "it has no line ENDATA",
    "xpress_slx_line_of_a_row": "line 4: this line is of no column",
    "xpress_slx_no_columns": "the file holds no values",
}


@for_each("path", [*BAD, *sorted((HERE / "bad").iterdir())])
def test_bad_files_are_refused_with_file_place_and_remedy(path):
    with pytest.raises(SolutionError, match=FAULTS[path.stem]) as caught:
        read_solution(path, problem(problem_of(path) or "milp"))
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert re.search(r"write|give|log|run|use|refused", message)
    assert "\n" not in message


@for_each("path", [path for path in (*GOOD, *OTHERS) if "binary" not in path.name])
def test_windows_line_ends_change_nothing(path):
    data = path.read_bytes()
    one, other = parse_raw(data), parse_raw(data.replace(b"\n", b"\r\n"))
    for attribute in ("reader", "status", "message", "rows", "objective", "order"):
        assert getattr(one, attribute) == getattr(other, attribute)
    assert one.values.tolist() == other.values.tolist()


@pytest.mark.parametrize(
    "old, new, fault",
    [
        (struct.pack("<d", 0.1), struct.pack("<d", np.nan), "one of the values is not a number"),
        (
            struct.pack("<2i", 5, 5),
            struct.pack("<2i", 6, 6),
            "2 dual values and 6 values are announced, 2 and 5 follow",
        ),
        (struct.pack("<2i", 5, 5), struct.pack("<2i", -5, -5), "a count is negative"),
        (struct.pack("<2i", 5, 5), struct.pack("<2i", 5, 4), "where all or none should be"),
        (b"Options\x03", b"Options\x04", "the Options record of 39 bytes announces 4 options"),
        (
            struct.pack("<I2dI", 16, -2.5, -2.5, 16),
            struct.pack("<I3iI", 12, 0, 0, 0, 12),
            "12 bytes cannot hold dual values",
        ),
    ],
)
def test_faults_of_binary_files_are_named(old, new, fault):
    data = (HERE / "asl-20190605_binary.sol").read_bytes()
    assert old in data
    with pytest.raises(SolutionError, match=rf"byte \d+: .*{fault}"):
        parse_raw(data.replace(old, new, 1))


def test_files_that_cannot_be_read_are_refused(tmp_path, monkeypatch):
    for path in (tmp_path, tmp_path / "none.sol"):
        with pytest.raises(InputError):
            read_raw(path)
    packed, path = gzip.compress(OTHERS[0].read_bytes()), tmp_path / "x.sol"
    for data, fault in (
        (b"", "the file is empty"),
        (b" \r\n\t\n", "the file is empty"),
        (packed[:-9], "damaged or cut off"),
        (packed[:20] + b"x" + packed[21:], "damaged or cut off"),
        (packed[:2], "damaged or cut off"),
    ):
        path.write_bytes(data)
        with pytest.raises((InputError, SolutionError), match=fault):
            read_raw(path)
    with path.open("wb") as stream:
        stream.truncate(MAX_SOLUTION + 1)
    limit = r"x.sol: has 2147483649 bytes; at most 2147483648 are read, .* without columns at 0"
    with pytest.raises(InputError, match=limit):
        read_raw(path)
    monkeypatch.setattr(registry, "MAX_SOLUTION", 1000)
    path.write_bytes(gzip.compress(bytes(1001)))
    with pytest.raises(InputError, match=r"x.sol: unpacks to more than 1000 bytes, .* at 0"):
        read_raw(path)


TRAP = r"""
import bz2, gzip, lzma, resource, sys
from pathlib import Path
resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
from crossfield.export.solutions.readers.registry import read_raw
from crossfield.models.errors import InputError
packed = {packer}.compress(b"alpha_00_00 0\n" + b"0" * 100_000_000)
assert len(packed) < 200_000
Path("trap.sol").write_bytes(packed)
try:
    read_raw("trap.sol")
except InputError as error:
    assert "unpacks to more than" in str(error), error
else:
    sys.exit("it was read")
"""


@pytest.mark.parametrize("packer", ["gzip", "bz2", "lzma"])
def test_a_small_file_that_holds_100_megabytes_is_refused_at_once(packer, tmp_path):
    command = [sys.executable, "-c", TRAP.replace("{packer}", packer)]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_long_list_of_zeros_may_be_packed_well(tmp_path):
    """xz packs honest lists of columns at 0 by a factor of 80."""
    names = [f"p1_{row:04d}_{column:04d}_u" for row in range(100) for column in range(300)]
    text = "".join(f"{name} 0\n" for name in names).encode()
    path = tmp_path / "x.sol"
    for packer in (gzip, bz2, lzma):
        path.write_bytes(packer.compress(text))
        assert len(text) > 10 * path.stat().st_size or packer is gzip
        assert len(read_raw(path).values) == len(names)


CUT = "the last line has no end, so the value of"


def listed(raw):
    """Entries of a file: pairs of name and value, or of place and value."""
    names = range(len(raw.values)) if raw.names is None else raw.names.tolist()
    return dict(zip(names, raw.values.tolist(), strict=True))


def cuts(data):
    """Places to cut: after every line, within some, and all along when there are few lines."""
    ends = [at + 1 for at, byte in enumerate(data) if byte == ord("\n")]
    return [*ends[:-1], *range(7, len(data), 997 if len(ends) > 3 else 53), len(data) - 2]


@for_each("path", [*GOOD, *OTHERS])
def test_a_file_cut_anywhere_never_gives_other_values_or_a_stronger_claim(path):
    data = path.read_bytes()
    whole = sized(parse_raw(data))
    for end in cuts(data) if path in GOOD else range(len(data)):
        try:
            raw = sized(parse_raw(data[:end]))
        except SolutionError:
            continue
        assert raw.status in {whole.status, Status.FEASIBLE, Status.NO_POINT}
        kept = {name: value for name, value in listed(raw).items() if name in listed(whole)}
        if CUT in raw.message:  # the last number may be cut off, and the message says so
            kept.pop(raw.message.partition(CUT)[2].split()[0].encode(), None)
        assert kept.items() <= listed(whole).items()
        if path in OTHERS:
            assert raw.values.tolist() == whole.values.tolist()
        if CUT not in raw.message and whole.has_point and not raw.omits_zeros and raw.names is not None:
            assert (values_by_name(whole.names, raw).missing == 0) == (len(kept) == len(whole.values))


def sized(raw):
    """The file as read; without counts and names only the problem's size shows that values are missing."""
    if raw.rows is not None or raw.names is not None:
        return raw
    return replace(raw, values=values_in_order(5, 2, raw))


def test_one_long_name_does_not_widen_all_names():
    variables = [{"VarName": "n" * 100_000, "X": 1}, *({"VarName": f"a{at}", "X": 1} for at in range(2000))]
    document = json.dumps({"SolutionInfo": {"Status": 2}, "Vars": variables}).encode()
    rows = b"".join(
        f"<variable name='{entry['VarName']}' index='0' value='1'/>".encode() for entry in variables
    )
    xml = (
        b"<CPLEXSolution><header solutionStatusValue='1'/><variables>"
        + rows
        + b"</variables></CPLEXSolution>"
    )
    for data in (document, xml):
        with suppress(SolutionError):
            parse_raw(data)  # loads modules, which take memory too
        tracemalloc.start()
        with pytest.raises(SolutionError, match="more than 63 characters"):
            parse_raw(data)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 8 << 20


@pytest.mark.parametrize(
    "document", [b"[" * 100_000, b'{ "SolutionInfo": {"Status": ' + b"9" * 100_000 + b"}}"]
)
def test_hostile_json_is_refused_or_read(document):
    start = b"" if document.startswith(b"{") else b'{ "SolutionInfo": '
    attempt(start + document)


LONG = 600_000
"""Bytes of a hostile file: comparing each with each would take ten minutes."""


HEADS = [
    b"", b"Model status\n", b"\nOptions\n", b"m\n\n", b"\x06\0\0\0binary\x06\0\0\0",
    b"# Solution for model obj\n", b"x 1\ny 2\n",
    b'{ "SolutionInfo": { "Status": 2}, "Vars": [ ', b'{"SolutionInfo":',
    b"<?xml version='1.0'?><CPLEXSolution>", b"<CPLEXSolution><header solutionStatusValue='1'/><variables>",
    b"<!DOCTYPE a><CPLEXSolution>", b"solution status: infeasible\n", b"objective value: 3\n",
    b"NAME a\n  C x 1\n", b"ENDATA\n", b"Optimal - objective value 3\n",
    b"c Problem: a\n", b"s mip 1 1 o 3\n", b"model_status,1\n",
    b"model_status,1\nsolver_status,1\nobjective,3\n", b"===\n BARON version 1\n",
    b"===\n BARON version 1\n *** Normal completion ***\n\nThe best solution found is:\n\n  variable\n",
    b"=obj= 3\n", b"=infeas=\n",
    b"# Status: Optimal\n", b"Feasible solution - objective 0.0\n",
    b"# Attribute file for model a\nSECTION SOLUTION\n",
    b'1,"a ","C","SB",', b"Value of objective function: 3\n\nActual values of the variables:\n",
    b"* Optimal Solution Found  *\n* Now\nColumn names and values of nonzeros in the solution\n",
    b"status = OPTIMAL\nVARS:\n", b"PROBLEM STATUS : A\nVARIABLES\nINDEX NAME\n",
    b"MIP - Integer optimal solution:  Objective = 3\nVariable Name   Solution Value\n",
    b"**** SOLVER STATUS     1 \n**** MODEL STATUS      1\n---- VAR ", b"----    1 VARIABLE a.L  =  3\n",
    b":  _varname  _var  :=\n", b"# = Solver Results =\n  Variable:\n", b"a = 1\n", b"a;1,5\n",
    b"Dear X\na_00_00 1\n",
    b"name,value\na,1\n",
    b'{"parameters": {"sol_status": 1}, "variables": [', b'{"a": 1, ', b"c Problem:\ns mip 1 1 o 1\n",
]  # fmt: skip


LETTERS = '0123456789.-+eE# \n"<>/,{}[]:abCj*Rows'


def attempt(data):
    """Read the data, or refuse them by an error of the package."""
    try:
        raw = parse_raw(data)
    except SolutionError:
        return
    assert not np.isnan(raw.values).any()
    assert raw.names is None or len(raw.names) == len(raw.values)
    assert raw.status in set(Status)
    assert raw.has_point or not raw.values.size


@settings(deadline=None, max_examples=800)
@given(
    st.sampled_from(HEADS),
    st.one_of(st.binary(max_size=300), st.text(LETTERS, max_size=300).map(str.encode)),
)
def test_random_bytes_after_a_valid_head_are_refused_or_read(head, tail):
    attempt(head + tail)


PARTS = [
    b"", b"\n", b" ", b"-", b"9" * 30, b"nan", b"\n\n", b"Options\n", b"# Rows 1\n", b"e o f", b"</", b'"',
    b"}", b"ENDATA\n", b"\xff", b"&a;",
]  # fmt: skip
DAMAGE = st.tuples(
    st.integers(0, 20_000), st.integers(0, 12), st.one_of(st.binary(max_size=6), st.sampled_from(PARTS))
)


@settings(deadline=None, max_examples=600)
@given(st.sampled_from([*GOOD, *OTHERS]), st.lists(DAMAGE, min_size=1, max_size=4))
def test_damaged_files_are_refused_or_read(path, damages):
    data = path.read_bytes()
    for start, length, part in damages:
        at = start % (len(data) + 1)  # the end too: a part may be added to a file that is already empty
        data = data[:at] + part + data[at + length :]
    attempt(data)


@for_each("part", [
        b"\n", b" ", b"1", b"1 ", b"a\n", b"*** ", b'"', b"[", b"<a>", b"<a ", b",", b"c\n", b"# \n", b"\0",
        b"-", b"Options", b"Options\n", b"objno ", b"1.#INF",
    ])  # fmt: skip
@for_each("head", HEADS)
@pytest.mark.slow
def test_long_repetitions_take_linear_time(head, part):
    """Milliseconds; looking back from every character would exceed the time of a test."""
    attempt(head + part * (LONG // len(part)))
