"""Answers that are damaged, cut, hostile or odd: read as they are meant, or refused with place and remedy."""

import bz2
import codecs
import gzip
import json
import lzma
import re
import struct
import tracemalloc
from contextlib import suppress
from dataclasses import replace

import crossfield as cf
import numpy as np
import places
import pytest
from answers import BAD, FILES, GOOD, OTHERS, TINY, WITH_POINT, binary_sol, listed, problem, problem_of
from crossfield.export.solutions.readers import registry
from crossfield.export.solutions.readers.ampl import write_ampl_sol
from crossfield.export.solutions.readers.registry import parse_raw, read_raw
from crossfield.export.solutions.readers.text import values_by_name, values_in_order
from crossfield.export.solutions.solution import TRUSTED
from crossfield.export.statuses import Status
from crossfield.export.writing.nl_order import NlOrder
from crossfield.models.input_limits import MAX_SOLUTION
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each

HERE = places.SOLUTIONS
FAULTS = {
    "ampl_binary_cut": r"byte 93: the file is cut off",
    "ampl_code_is_a_word": r"line 17: 'objno 0 solved' is not",
    "ampl_count_too_large": r"line 11: 4000000000 numbers are announced, 5 whole lines follow",
    "ampl_cut_in_the_values": r"line 11: 5 numbers are announced, 2 whole lines follow",
    "ampl_solved_without_values": r"states solved but holds no values",
    "empty": r"the file is empty",
    "highs-1.15.1_optimal_style1": r"style 1 \(pretty\).*write_solution_style = 0",
    "highs-1.15.1_optimal_style3": r"style 3 \(GLPK pretty\).*write_solution_style = 0",
    "highs_count_too_large": r"line 7: 999999999999 columns are announced, 5 whole lines follow",
    "highs_cut_in_a_number": r"line 11: the file is cut off in the middle of this line",
    "highs_nul_byte": r"line 9: there is a byte that is not text",
    "highs_optimal_without_point": r"line 5: the file is Optimal but holds no point",
    "junk": r"not a solution file of a known kind; give one of these: .*HiGHS",
    "baron-26.5.27_qp_sum": "summary of BARON, which holds no values; give its results",
    "baron_res_cut": "it has no end of the search",
    "baron_res_value_missing": "line 180: 3 words stand where 4 should",
    "cbc_numbers_start_again_twice": "line 85: the numbers start again for the second time",
    "cplex-22.2.0.1_milp_integers": "writeLevel 2 and holds the integer columns only; use level 1",
    "cplex_cut": "line 39: the XML is damaged or cut off",
    "cplex_entities": "DTD or entities",
    "cplex_no_header": "no header with a status",
    "cplex_value_is_nan": "variable 3 has no name, or a value that is not a number",
    "gams_csv_no_solver_status": "it has no solver_status",
    "glpk_column_missing": "line 57: 35 columns are announced, 34 lines follow",
    "glpk_counts_are_words": "line 8: 's mip many 35 o",
    "glpk_cut": "it has no line `e o f`",
    "gurobi-13.0.3_milp_start": "line 1: this is a MIP start",
    "gurobi_json_cut": "line 1: the JSON is damaged or cut off at column 900",
    "gurobi_json_no_status": "the SolutionInfo has no Status",
    "gurobi_json_optimal_without_vars": "states optimal but holds no values",
    "gurobi_json_value_is_nan": "x has no value",
    "gurobi_no_values": "the file holds no values",
    "scip-10.0_milp_partial": "line 1: this is a partial solution",
    "scip_cut_after_the_status": "the file is cut off: it has no objective",
    "scip_no_objective": "line 2: 4 words stand where 3 should",
    "scip_value_is_unknown": "line 5: 'unknown' is not a number",
    "xpress_slx_cut": "it has no line ENDATA",
    "xpress_slx_line_of_a_row": "line 4: this line is of no column",
}


@for_each("path", [*BAD, *sorted((HERE / "bad").iterdir())])
def test_bad_files_are_refused_with_file_place_and_remedy(path):
    with pytest.raises(cf.SolutionError, match=FAULTS[path.stem]) as caught:
        cf.read_solution(path, problem(problem_of(path) or "milp"))
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert re.search(r"write|give|log|run|use|refused", message)
    assert "\n" not in message


FIVES = struct.pack("<2i", 5, 5)


@for_each("old, new, fault", [
        (struct.pack("<d", 0.1), struct.pack("<d", np.nan), "one of the values is not a number"),
        (FIVES, struct.pack("<2i", 6, 6), "2 dual values and 6 values are announced, 2 and 5 follow"),
        (FIVES, struct.pack("<2i", -5, -5), "a count is negative"),
        (FIVES, struct.pack("<2i", 5, 4), "where all or none should be"),
        (b"Options\x03", b"Options\x04", "the Options record of 39 bytes announces 4 options"),
        (
            struct.pack("<I2dI", 16, -2.5, -2.5, 16), struct.pack("<I3iI", 12, 0, 0, 0, 12),
            "12 bytes cannot hold dual values",
        ),
    ])  # fmt: skip
def test_faults_of_binary_files_are_named(old, new, fault):
    data = (HERE / "asl-20190605_binary.sol").read_bytes()
    assert old in data
    with pytest.raises(cf.SolutionError, match=rf"byte \d+: .*{fault}"):
        parse_raw(data.replace(old, new, 1))


def test_files_that_cannot_be_read_are_refused(tmp_path, monkeypatch):
    for path in (tmp_path, tmp_path / "none.sol"):
        with pytest.raises(cf.InputError):
            read_raw(path)
    packed, path = gzip.compress(OTHERS[0].read_bytes()), tmp_path / "x.sol"
    for data, fault in (
        (b"", "the file is empty"),
        (b" \r\n\t\n", "the file is empty"),
        (packed[:-9], "damaged or cut off"),
        (packed[:20] + b"x" + packed[21:], "damaged or cut off"),
        (packed[:2], "damaged or cut off"),
        (codecs.BOM_UTF16_LE + b"x", "UTF-16 is damaged or cut off"),
    ):
        path.write_bytes(data)
        with pytest.raises((cf.InputError, cf.SolutionError), match=fault):
            read_raw(path)
    with path.open("wb") as stream:
        stream.truncate(MAX_SOLUTION + 1)
    limit = r"x.sol: has 2147483649 bytes; at most 2147483648 are read, .* without columns at 0"
    with pytest.raises(cf.InputError, match=limit):
        read_raw(path)
    monkeypatch.setattr(registry, "MAX_SOLUTION", 1000)
    path.write_bytes(gzip.compress(bytes(1001)))
    with pytest.raises(cf.InputError, match=r"x.sol: unpacks to more than 1000 bytes, .* at 0"):
        read_raw(path)


@for_each("packer", [gzip, bz2, lzma])
def test_a_small_file_that_holds_megabytes_is_refused_at_once(packer, tmp_path):
    packed = packer.compress(b"alpha_00_00 0\n" + b"0" * 20_000_000)
    assert len(packed) < 50_000
    (tmp_path / "trap.sol").write_bytes(packed)
    tracemalloc.start()
    with pytest.raises(cf.InputError, match="unpacks to more than"):
        read_raw(tmp_path / "trap.sol")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 18 << 20


def test_a_long_list_of_zeros_may_be_packed_well(tmp_path):
    """xz packs honest lists of columns at 0 by a factor of 80."""
    text = "".join(f"p1_{row:04d}_{column:04d}_u 0\n" for row in range(100) for column in range(300)).encode()
    (tmp_path / "x.sol").write_bytes(lzma.compress(text))
    assert len(text) > 10 * (tmp_path / "x.sol").stat().st_size
    assert len(read_raw(tmp_path / "x.sol").values) == 30_000


def test_one_long_name_does_not_widen_all_names():
    names = ["n" * 100_000, *(f"a{at}" for at in range(2000))]
    columns = [{"VarName": name, "X": 1} for name in names]
    document = json.dumps({"SolutionInfo": {"Status": 2}, "Vars": columns})
    rows = "".join(f"<variable name='{name}' index='0' value='1'/>" for name in names)
    xml = f"<CPLEXSolution><header solutionStatusValue='1'/><variables>{rows}</variables></CPLEXSolution>"
    for data in (document.encode(), xml.encode()):
        with suppress(cf.SolutionError):
            parse_raw(data)  # loads modules, which take memory too
        tracemalloc.start()
        with pytest.raises(cf.SolutionError, match="more than 63 characters"):
            parse_raw(data)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 8 << 20


def test_variables_of_a_solution_within_another_are_read_once():
    one = "<CPLEXSolution><header solutionStatusValue='101'/><variables>"
    one += "<variable name='x{}' value='1'/></variables>"
    data = (one.format(1) + one.format(2) + "</CPLEXSolution>" * 2).encode()
    assert [parse_raw(data, number).names.tolist() for number in (1, 2)] == [[b"x1"], [b"x2"]]


# one grammar of lines


BASES = {
    "list": "gurobi-13.0.3_milp_optimal.sol",
    "scip": "scip-10.0_milp_optimal.sol",
    "miplib": "miplib-by-layout_milp_optimal.sol",
    "cbc with rows": "cbc-2.10.8_milp_optimal_all.sol",
    "xpress": "xpress-9.9.1_milp_optimal.slx",
    "gams": "gams-54.6.1_cplex_milp_optimal.csv",
    "highs": "highs-1.15.1_milp_optimal_log.txt",
    "name = value": rb"\1 = \2",
    "name;value": rb"\1;\2",
}
"""Answers to one problem: files of real programs, and the list with a sign between name and value."""


def answer(base):
    if isinstance(BASES[base], bytes):
        return re.sub(rb"(?m)^([a-zA-Z]\S*) (\S+)$", BASES[base], answer("list"))
    data = (TINY / BASES[base]).read_bytes()
    return data[data.index(b"Model status\n") : data.index(b"# Dual")] if base == "highs" else data


def inserted(data, place, line):
    lines = data.splitlines(keepends=True)
    return b"".join([*lines[:place], line, *lines[place:]])


def valued(text):
    """A change of the value of one column."""
    return lambda data: re.sub(rb"(alpha_00_01[ ,:;=]+)[^\s,;]+", rb"\g<1>" + text, data)


OWN_NAME = rb"(?m)\b[a-z]+\d?_\d\d_\d\d(?:_[ur])?\b"
ODD = {
    "as it is": lambda data: data,
    "blank lines everywhere": lambda data: b"\n \t\n" + data.replace(b"\n", b"\n\n") + b"\n\n\f\n",
    "comments": lambda data: b"# first\n" + inserted(data, 12, b"# a remark\n") + b"# last\n",
    "a comment after an entry": lambda data: re.sub(rb"(?m)^(.*alpha_00_01.*)$", rb"\1 # checked", data),
    "old Macs": lambda data: data.replace(b"\n", b"\r"),
    "no last newline": lambda data: data.rstrip(b"\n"),
    "tabs": lambda data: re.sub(rb"(?m)^ *([a-z]+\d?_\S+) +", b"\t\\1\t", data),
    "form feeds": lambda data: re.sub(rb"(?m)^(?= *[a-z]+\d?_)", b"\f", data),
    "trailing blanks": lambda data: data.replace(b"\n", b"  \t\n"),
    "the objective again": lambda data: inserted(data, 12, b"# Objective value: 0.556536082845935\n"),
    "upper case": lambda data: re.sub(OWN_NAME, lambda name: name[0].upper(), data),
}
FAULTY = {
    "a word for a value": valued(b"about"),
    "a value missing": lambda data: re.sub(rb"(?m)(alpha_00_01).*$", rb"\1", data),
    "a line too long": lambda data: re.sub(rb"(?m)(alpha_00_01.*)$", rb"\1 7 7", data),
    "not a number": valued(b"nan"),
    "infinite": valued(b"inf"),
    "two values": lambda data: data.replace(b"alpha_01_01", b"alpha_00_00"),
    "foreign names": lambda data: data.replace(b"alpha_", b"angle_"),
    "a byte that is not text": lambda data: data.replace(b"alpha_00_01", b"alpha_00\x0001"),
    "another claim in a comment": lambda data: inserted(data, 12, b"# Objective value: 99\n"),
}


@for_each("base", BASES)
def test_odd_files_are_read_alike_and_faulty_ones_refused_or_contradicted(base, tmp_path):
    path, data = tmp_path / "x.sol", answer(base)
    for name, change in (ODD | FAULTY).items():
        path.write_bytes(change(data))
        try:
            solution = cf.read_solution(path, problem("milp"), tolerance=1e-5)
        except cf.SolutionError:
            assert name in FAULTY
            continue
        if name in FAULTY:
            assert change(data) == data or solution.contradictions, name
        else:
            assert solution.contradictions == (), name
            assert solution.objective == pytest.approx(0.556536082845935, abs=1e-6), name


@for_each("text, objective", [
        ("# Objective value: 99", 99), ("# Objective value = 99", 99), ("# Objective value 99", 99),
        ("#Objective value:99", 99), ("# objective: 99", 99), ("=obj= 99", 99), ("Objective value: 99", 99),
        ("* Objective value: 9.9D+01", 99), ("# obj = 99", 99), ("# Objective sense: minimize", None),
        ("# the objective value is 99", None),
    ])  # fmt: skip
def test_objectives_in_comments_and_later_lines_are_claims(text, objective):
    for lines in ([text, "x 1", "y 2"], ["x 1", "y 2", text], ["x 1", text, "y 2"]):
        raw = parse_raw("\n".join(lines).encode() + b"\n")
        assert (raw.objective, raw.values.tolist()) == (objective, [1, 2])


def test_two_objectives_in_one_file_are_refused_unless_they_agree():
    assert parse_raw(b"=obj= 3\n# Objective value: 3.0e0\nx 1\n").objective == 3
    with pytest.raises(cf.SolutionError, match="line 2: this is not the objective of line 1"):
        parse_raw(b"=obj= 3\n# Objective value: 4\nx 1\n")


def test_a_fault_in_the_first_lines_is_reported_with_its_line():
    for line in range(1, 7):
        entries = [f"alpha_00_{at:02d} {at}" for at in range(8)]
        entries[line - 1] = "alpha_00_99 about"
        with pytest.raises(cf.SolutionError, match=f"line {line}: 'about' is not a number"):
            parse_raw("\n".join(entries).encode())


def test_a_last_value_without_an_end_is_read_and_noted():
    raw = parse_raw(b"x 1\ny 2.5")
    assert raw.values.tolist() == [1, 2.5]
    assert raw.message == "the last line has no end, so the value of y may be cut off"
    assert parse_raw(b"objective value: 3\nx 1 (obj:3)").message == ""


def test_a_repeated_line_of_cbc_drops_no_columns(tmp_path):
    lines = (TINY / "cbc-2.10.8_milp_optimal.sol").read_bytes().splitlines(keepends=True)
    for at in range(1, len(lines), 5):
        (tmp_path / "x.sol").write_bytes(b"".join([*lines[: at + 1], *lines[at:]]))
        words = r"x\.sol: the column \w+ stands before the numbers start again"
        with pytest.raises(cf.SolutionError, match=words):
            cf.read_solution(tmp_path / "x.sol", problem("milp"))


# cut anywhere, damaged anywhere


CUT = "the last line has no end, so the value of"


def cuts(path, data):
    """Places to cut: after some lines and within some."""
    ends = [at + 1 for at, byte in enumerate(data) if byte == ord("\n")]
    if path in OTHERS:
        return range(0, len(data), 17)
    return [*ends[:-1:9], *range(7, len(data), 1997 if len(ends) > 3 else 101), len(data) - 2]


@for_each("path", [*GOOD, *OTHERS])
def test_a_file_cut_anywhere_never_gives_other_values_or_a_stronger_claim(path):
    data = path.read_bytes()
    whole = sized(parse_raw(data))
    for end in cuts(path, data):
        try:
            raw = sized(parse_raw(data[:end]))
        except cf.SolutionError:
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


def attempt(data):
    """Read the data, or refuse them by an error of the package."""
    try:
        raw = parse_raw(data)
    except cf.SolutionError:
        return
    assert not np.isnan(raw.values).any()
    assert raw.names is None or len(raw.names) == len(raw.values)
    assert raw.status in set(Status)
    assert raw.has_point or not raw.values.size


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
TAILS = st.binary(max_size=300) | st.text(LETTERS, max_size=300).map(str.encode)
PARTS = [
    b"", b"\n", b" ", b"-", b"9" * 30, b"nan", b"\n\n", b"Options\n", b"# Rows 1\n", b"e o f", b"</", b'"',
    b"}", b"ENDATA\n", b"\xff", b"&a;",
]  # fmt: skip
DAMAGE = st.tuples(
    st.integers(0, 20_000), st.integers(0, 12), st.one_of(st.binary(max_size=6), st.sampled_from(PARTS))
)


@settings(max_examples=60)
@given(
    st.sampled_from(HEADS), TAILS, st.sampled_from([*GOOD, *OTHERS]), st.lists(DAMAGE, min_size=1, max_size=4)
)
def test_random_bytes_and_damaged_files_are_refused_or_read(head, tail, path, damages):
    attempt(head + tail)
    data = path.read_bytes()
    for start, length, part in damages:
        at = start % (len(data) + 1)  # the end too: a part may be added to a file that is already empty
        data = data[:at] + part + data[at + length :]
    attempt(data)


def test_hostile_json_is_refused_or_read():
    attempt(b'{ "SolutionInfo": ' + b"[" * 100_000)
    attempt(b'{ "SolutionInfo": {"Status": ' + b"9" * 100_000 + b"}}")


@pytest.mark.parametrize("head", HEADS)
@pytest.mark.slow
def test_long_repetitions_take_linear_time(head):
    """Milliseconds; looking back from every character would exceed the time of a test."""
    for part in (b"\n", b" ", b"1 ", b"a\n", b"*** ", b'"', b"[", b"<a ", b"# \n", b"-", b"objno "):
        attempt(head + part * (LONG // len(part)))


LONG = 400_000
"""Bytes of a hostile file: comparing each with each would take five minutes."""


# damaged points


def damages(data):
    """Kinds of damage to a file: lines repeated, left out, moved or longer; values replaced."""
    lines = data.splitlines(keepends=True)
    for at in range(0, len(lines), max(1, len(lines) // 2)):
        yield b"".join([*lines[: at + 1], *lines[at:]])
        yield b"".join([*lines[:at], *lines[at + 1 :]])
        yield b"".join([*lines[at:], *lines[:at]])
        yield b"".join([*lines[:at], lines[at].rstrip() + b" 7\n", *lines[at + 1 :]])
        yield b"".join([*lines[:at], lines[at].replace(b".", b","), *lines[at + 1 :]])
    matches = list(re.finditer(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?", data))
    values = [b"1e300", b"-0", b"0x1p3", b"4294967296", b"1e999", b"", b"\xff\xfe"]
    for value, place in zip(values, matches[3 :: max(1, len(matches) // 10)], strict=False):
        yield data[: place.start()] + value + data[place.end() :]


def test_damaged_answers_are_refused_or_told_as_they_are(tmp_path):
    """One answer of a real solver for each reader, and what is written here: the claim suits the point."""
    answers = {}
    for path in GOOD:
        if FILES[path.name][1] in WITH_POINT and problem_of(path) in {"milp", "qp", "quartic"}:
            answers.setdefault(FILES[path.name][0], (path.read_bytes(), problem(problem_of(path))))
    milp = problem("milp")
    point = cf.read_solution(TINY / BASES["list"], milp).point[NlOrder(milp).order]
    path = write_ampl_sol(tmp_path / "a.sol", "optimal solution found", point, milp.n_rows, 0)
    answers["ampl text"] = path.read_bytes(), milp
    answers["ampl binary"] = binary_sol(b"optimal solution found", milp, point), milp
    for name, (data, of) in answers.items():
        for number, damaged in enumerate(damages(data)):
            (tmp_path / "x").write_bytes(damaged)
            try:
                solution = cf.read_solution(tmp_path / "x", of)
            except cf.SolutionError:
                continue
            assert bears_out(solution), (name, number)


def bears_out(solution):
    """Whether a point agrees with its status, by independent numbers."""
    if not solution.status.needs_point or solution.point is None:
        return True
    off, objective = solution.violation, solution.objective
    if off.rows > 2 * np.pi * TRUSTED or max(off.bounds, off.integrality) > TRUSTED:
        return False
    reported = objective if solution.reported is None else solution.reported
    return abs(reported - objective) <= 1.1 * TRUSTED * max(1, objective)
