"""One grammar of lines: odd and faulty files are accepted or refused alike by `read` and by the checker."""

import bz2
import codecs
import gzip
import lzma
import re
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import highspy
import pytest
from answers import TINY, problem
from crossfield.export.formats.registry import write
from crossfield.export.solutions.readers.registry import parse_raw
from crossfield.export.solutions.solution import read_solution
from crossfield.models.errors import SolutionError
from loops import for_each

BASES = {
    "list": "gurobi-13.0.3_milp_optimal.sol",
    "scip": "scip-10.0_milp_optimal.sol",
    "miplib": "miplib-by-layout_milp_optimal.sol",
    "cbc": "cbc-2.10.8_milp_optimal.sol",
    "cbc with rows": "cbc-2.10.8_milp_optimal_all.sol",
    "xpress": "xpress-9.9.1_milp_optimal.slx",
    "gams": "gams-54.6.1_cplex_milp_optimal.csv",
}
"""Answers of real programs to one problem, in every layout of lines that both read."""

SIGNS = {
    "name = value": rb"\1 = \2",
    "name: value": rb"\1: \2",
    "name,value": rb"\1,\2",
    "name;value": rb"\1;\2",
}
"""The same in lists with a sign between name and value."""

STYLES = {"highs raw": 0, "highs sparse": 4}
"""HiGHS's styles of the same, which it writes here."""


@cache
def answer(base):
    """The answer of a real program, in its layout."""
    if base in BASES:
        return (TINY / BASES[base]).read_bytes()
    if base in SIGNS:
        return re.sub(rb"(?m)^([a-zA-Z]\S*) (\S+)$", SIGNS[base], answer("list"))
    with TemporaryDirectory() as folder:
        write(problem("milp"), Path(folder) / "m.mps")
        solver = highspy.Highs()
        solver.setOptionValue("output_flag", False)
        solver.readModel(str(Path(folder) / "m.mps"))
        solver.run()
        solver.writeSolution(str(Path(folder) / "x.sol"), STYLES[base])
        return (Path(folder) / "x.sol").read_bytes()


def lines_of(data):
    return data.splitlines(keepends=True)


def inserted(data, place, line):
    lines = lines_of(data)
    return b"".join([*lines[:place], line, *lines[place:]])


def with_blank_lines(data):
    return b"\n \t\n" + data.replace(b"\n", b"\n\n") + b"\n\n\f\n"


ODD = {
    "as it is": lambda data: data,
    "blank lines everywhere": with_blank_lines,
    "a blank line first": lambda data: b"\n" + data,
    "a comment inside": lambda data: inserted(data, 12, b"# a remark\n"),
    "comments at both ends": lambda data: b"# first\n" + data + b"# last\n",
    "a comment after an entry": lambda data: re.sub(rb"(?m)^(.*alpha_00_01.*)$", rb"\1 # checked", data),
    "Windows": lambda data: data.replace(b"\n", b"\r\n"),
    "old Macs": lambda data: data.replace(b"\n", b"\r"),
    "a byte order mark": lambda data: codecs.BOM_UTF8 + data,
    "UTF-16": lambda data: data.decode().encode("utf-16"),
    "no last newline": lambda data: data.rstrip(b"\n"),
    "tabs": lambda data: re.sub(rb"(?m)^ *([a-z]+\d?_\S+) +", b"\t\\1\t", data),
    "form feeds": lambda data: re.sub(rb"(?m)^(?= *[a-z]+\d?_)", b"\f", data),
    "trailing blanks": lambda data: data.replace(b"\n", b"  \t\n"),
    "gzip": gzip.compress,
    "bzip2": bz2.compress,
    "xz": lzma.compress,
    "the objective again": lambda data: inserted(data, 12, b"# Objective value: 0.556536082845935\n"),
    "upper case": lambda data: re.sub(
        rb"(?m)\b[a-z]+\d?_\d\d_\d\d(?:_[ur])?\b", lambda name: name[0].upper(), data
    ),
}

FAULTY = {
    "a word for a value": lambda data: re.sub(rb"(alpha_00_01[ ,:;=]+)\S+", rb"\1about", data),
    "a value missing": lambda data: re.sub(rb"(?m)(alpha_00_01).*$", rb"\1", data),
    "a line too long": lambda data: re.sub(rb"(?m)(alpha_00_01.*)$", rb"\1 7 7", data),
    "not a number": lambda data: re.sub(rb"(alpha_00_01[ ,:;=]+)\S+", rb"\1nan", data),
    "infinite": lambda data: re.sub(rb"(alpha_00_01[ ,:;=]+)\S+", rb"\1inf", data),
    "two values": lambda data: data.replace(b"alpha_01_01", b"alpha_00_00"),
    "foreign names": lambda data: data.replace(b"alpha_", b"angle_"),
    "a byte that is not text": lambda data: data.replace(b"alpha_00_01", b"alpha_00\x0001"),
    "damaged UTF-16": lambda data: codecs.BOM_UTF16_LE + b"x",
    "nothing": lambda data: b"\n\n",
    "another claim in a comment": lambda data: inserted(data, 12, b"# Objective value: 99\n"),
}


@pytest.fixture(scope="module")
def judged(tmp_path_factory):
    """The objective that `read` finds in a file; empty where it is contradicted, None where it is refused."""
    path = tmp_path_factory.mktemp("grammar") / "x.sol"

    def run(data):
        path.write_bytes(data)
        try:
            solution = read_solution(path, problem("milp"), tolerance=1e-5)
        except SolutionError:
            return None
        return None if solution.point is None else ("" if solution.contradictions else solution.objective)

    return run


@for_each("change", ODD)
@for_each("base", [*BASES, *SIGNS, *STYLES])
def test_odd_files_are_read_alike(base, change, judged):
    assert judged(ODD[change](answer(base))) == pytest.approx(0.556536082845935, abs=1e-6)


@for_each("change", FAULTY)
@for_each("base", [*BASES, *SIGNS, *STYLES])
def test_faulty_files_are_refused_or_contradicted(base, change, judged):
    assert judged(FAULTY[change](answer(base))) in {None, ""}


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


@for_each("words, status", [
        ("Optimal", "optimal-local"), ("optimal solution", "optimal-local"), ("Infeasible", "infeasible"),
        ("locally optimal", "optimal-local"), ("Time limit reached", "limit-with-point"),
        ("unbounded", "unbounded"), ("whatever", "feasible"),
    ])  # fmt: skip
def test_statuses_in_comments_are_claims(words, status):
    for mark in ("# Status: ", "# Solution status = ", "# status "):
        raw = parse_raw(f"{mark}{words}\n# Objective value: 3\nx 1\n".encode())
        assert (raw.status, raw.message) == (status, words)
        assert raw.objective == 3 or not raw.has_point  # cuOpt's values of an infeasible problem are none


def test_two_objectives_in_one_file_are_refused_unless_they_agree():
    assert parse_raw(b"=obj= 3\n# Objective value: 3.0e0\nx 1\n").objective == 3
    with pytest.raises(SolutionError, match="line 2: this is not the objective of line 1"):
        parse_raw(b"=obj= 3\n# Objective value: 4\nx 1\n")


@for_each("line", range(1, 7))
def test_a_fault_in_the_first_lines_is_reported_with_its_line(line):
    entries = [f"alpha_00_{at:02d} {at}" for at in range(8)]
    entries[line - 1] = "alpha_00_99 about"
    with pytest.raises(SolutionError, match=f"line {line}: 'about' is not a number"):
        parse_raw("\n".join(entries).encode())


def test_a_last_value_without_an_end_is_read_and_noted():
    raw = parse_raw(b"x 1\ny 2.5")
    assert raw.values.tolist() == [1, 2.5]
    assert raw.message == "the last line has no end, so the value of y may be cut off"
    assert parse_raw(b"objective value: 3\nx 1 (obj:3)").message == ""


def test_a_list_of_lines_and_comments_in_turn_is_read_in_linear_time():
    lines = "".join(f"# a remark\nalpha_{at:06d} {at}\n" for at in range(20_000))
    assert len(parse_raw(lines.encode()).values) == 20_000
