"""Answers of real programs: reader, status and point of every file of the collection, and their identity."""

import bz2
import codecs
import gzip
import lzma
import re
from dataclasses import replace

import crossfield as cf
import numpy as np
import places
import pytest
from answers import (
    BAD,
    FILES,
    GOOD,
    OPTIMA,
    OTHERS,
    PROVEN,
    RELAXATIONS,
    ROUNDED,
    TINY,
    WITH_POINT,
    problem,
    problem_of,
)
from crossfield.export.solutions.readers.grammar import HEAD
from crossfield.export.solutions.readers.registry import parse_raw, read_raw, recognising_readers
from crossfield.export.solutions.readers.siblings import sibling_of
from loops import for_each

OPTIMUM = [10, -9.7, 1, 0, 1]
QP = [0.3499999875, -0.0499999975]
KEPT = {"optimal-global", "optimal-in-gap", "optimal-local", "infeasible", "unbounded"}


@for_each("file, reader, status, values, rows", [
        ("highs-1.15.1_optimal_style0", "highs", "optimal-in-gap", OPTIMUM, 2),
        ("highs-1.15.1_optimal_style4", "highs", "optimal-in-gap", [10, -9.7, 1, 1], None),
        ("highs-1.15.1_qp_style0", "highs", "optimal-in-gap", QP, 1),
        ("highs-1.15.1_qp_style4", "highs", "optimal-in-gap", QP, None),
        ("highs-1.15.1_infeasible_style0", "highs", "infeasible", [], None),
        ("highs-1.15.1_infeasible_style4", "highs", "infeasible", [], None),
        ("highs-1.15.1_unbounded_style0", "highs", "unbounded", [0, 3], 1),
        ("highs-1.15.1_time_with_point_style0", "highs", "limit-with-point", [0.5, 1.25, 0, 0, 1], 2),
        ("highs-1.15.1_time_with_point_style4", "highs", "limit-with-point", [0.5, 1.25, 1], None),
        ("highs-1.15.1_time_without_point_style0", "highs", "limit-without-point", [], None),
        ("highs-1.16.0_optimal_style0", "highs", "optimal-in-gap", [10, -9.7, 1, 1, 0], 2),
        ("highs-1.16.0_optimal_style4", "highs", "optimal-in-gap", [10, -9.7, 1, 1], None),
        ("scip-10.0_optimal", "ampl-text", "optimal-global", OPTIMUM, 2),
        ("scip-10.0_infeasible", "ampl-text", "infeasible", [], 3),
        ("scip-10.0_unbounded", "ampl-text", "unbounded", [0, -100000, 1, 0, 0], 1),
        ("scip-10.0_limit_with_point", "ampl-text", "limit-with-point", [5, 100000, 1, 0, 0], 2),
        ("scip-10.0_limit_without_point", "ampl-text", "limit-without-point", [], 2),
        ("asl-20190605_text", "ampl-text", "feasible", [0.1] * 5, 2),
        ("asl-20190605_binary", "ampl-binary", "feasible", [0.1] * 5, 2),
    ])  # fmt: skip
def test_files_of_highs_and_of_solvers_of_ampl_are_read(file, reader, status, values, rows):
    raw = read_raw(places.SOLUTIONS / f"{file}.sol")
    assert (raw.reader, raw.status, raw.values.tolist(), raw.rows) == (reader, status, values, rows)
    assert raw.has_point == bool(values)
    assert (raw.names is None) == reader.startswith("ampl")
    assert raw.omits_zeros == (reader == "highs" and "style4" in file and bool(values))


@for_each("path", GOOD)
def test_every_file_has_its_reader_its_status_and_its_point(path):
    reader, status = FILES[path.name]
    raw = read_raw(path)
    assert (raw.reader, raw.status) == (reader, status)
    # GLPK and CPLEX write their last point whatever it is; the point is judged, not the word.
    assert raw.has_point == (status in WITH_POINT or "glpk-5.0_milp_time_without_point" in path.name)
    assert (raw.names is None) == (reader == "glpk" and raw.has_point)
    assert "\n" not in raw.message


@for_each("path", [*GOOD, *BAD, *OTHERS, *(places.SOLUTIONS / "bad").iterdir()])
def test_no_file_is_claimed_by_two_readers_and_no_answer_taken_for_another_file(path):
    data = path.read_bytes()
    sibling = sibling_of(data[:HEAD])
    assert not (sibling and (path in GOOD or path in OTHERS))
    assert len(recognising_readers(data)) == (0 if sibling or path.stem in {"empty", "junk"} else 1)


@for_each("path", [path for path in GOOD if FILES[path.name][1] in WITH_POINT and problem_of(path)])
def test_the_point_is_the_one_that_the_solver_had(path):
    status, name = FILES[path.name][1], problem_of(path)
    solution = cf.read_solution(path, problem(name), identified=True)
    assert (solution.unknown, solution.claimed) == (path.stem.endswith("_prints"), status)  # Total, of PuLP
    if solution.reported is not None:
        assert solution.objective == pytest.approx(solution.reported, abs=1e-6)
    worst = solution.violation.worst
    if any(part in path.name for part in RELAXATIONS):
        assert worst > 0.1
        assert solution.status == "unknown"
        return
    assert solution.status == ("optimal-global" if path.name in PROVEN else status)
    digits = 1e-4 if path.stem in ROUNDED else 1e-6
    assert worst < digits
    assert solution.objective > OPTIMA[name] - 2 * digits
    if re.search("optimal|pool|two_solutions", path.name):
        assert solution.objective == pytest.approx(OPTIMA[name], abs=2 * digits)


MARKS = {
    "Windows": lambda data: data.replace(b"\n", b"\r\n"),
    "a byte order mark": lambda data: codecs.BOM_UTF8 + data,
    "UTF-16": lambda data: data.decode().encode("utf-16"),
    "gzip": gzip.compress,
    "bzip2": bz2.compress,
    "xz": lzma.compress,
}


@for_each("mark", MARKS)
def test_marks_and_packing_change_nothing(mark, tmp_path):
    of_reader = {FILES[path.name][0]: path for path in GOOD}
    for path in (*of_reader.values(), *OTHERS[::3]):
        data, plain = path.read_bytes(), read_raw(path)
        if plain.reader == "ampl-binary" and mark not in {"gzip", "bzip2", "xz"}:
            continue
        (tmp_path / "x").write_bytes(MARKS[mark](data))
        raw = read_raw(tmp_path / "x")
        for attribute in ("reader", "status", "message", "rows", "objective", "order"):
            assert getattr(raw, attribute) == getattr(plain, attribute), path
        assert raw.values.tolist() == plain.values.tolist()


# which problem a file is of


def test_only_files_that_state_their_problem_keep_their_claims():
    """Of the right problem, and of another one, which differs by 1e-7 in a weight."""
    for path in GOOD:
        name, stated = problem_of(path), read_raw(path).stamps
        of = problem(name or "milp")
        heavier = replace(of.instance, stroke_coefficient=of.instance.stroke_coefficient + 1e-7)
        other = cf.formulate(heavier, of.name, p=of.jumps)
        if stated:
            assert cf.read_solution(path, of).identified
            with pytest.raises(cf.SolutionError, match="is of another problem: it states"):
                cf.read_solution(path, other)
            continue
        for right in (of, other):
            try:
                solution = cf.read_solution(path, right)
            except cf.SolutionError:
                assert name is None
                continue
            assert solution.claimed == FILES[path.name][1]
            assert solution.status not in KEPT
            assert (solution.bound, solution.gap) == (None, None)


# pools


def test_the_solution_of_a_pool_is_chosen_by_number():
    pool = TINY / "cplex-22.2.0.1_milp_pool.sol"
    objectives = [0.5565360828459345, 0.5565360828459345, 6.2831853071795862]
    raws = [read_raw(pool, number) for number in (1, 2, 3)]
    assert [raw.objective for raw in raws] == objectives
    assert [raw.message.rpartition("; ")[2] for raw in raws] == [f"solution {at} of 3" for at in (1, 2, 3)]
    assert raws[0].message.startswith("populate solution limit exceeded; incumbent; ")
    assert read_raw(TINY / "xpress-by-layout_milp_two_solutions.slx").message == "solution 1 of 2"
    assert [raw.status for raw in raws] == ["limit-with-point", "feasible", "feasible"]
    solution = cf.read_solution(pool, problem("milp"), solution=3)
    assert solution.objective == pytest.approx(objectives[2])
    for number in (0, 4, -1):
        with pytest.raises(
            cf.SolutionError, match=f"there is no solution {number} in it; choose one of 1 to 3"
        ):
            read_raw(pool, number)
    with pytest.raises(cf.SolutionError, match="no solution 2 in it; choose one of 1 to 1"):
        read_raw(TINY / "gurobi-13.0.3_milp_optimal.json", 2)


def test_the_best_of_a_pool_is_the_default_and_without_objectives_the_first():
    data = (TINY / "cplex-22.2.0.1_milp_pool.sol").read_bytes()
    worse = data.replace(b'objectiveValue="0.55653608284593448"', b'objectiveValue="7"', 1)
    assert parse_raw(worse).message.endswith("p3; solution 2 of 3")
    unknown = worse.replace(b'objectiveValue="6.2831853071795862"', b"")
    assert parse_raw(unknown).message.endswith("incumbent; solution 1 of 3")
    twice = b"Value of objective function: 9\n\nActual values of the variables:\nx 1\n\n"
    raw = parse_raw(twice + twice.replace(b"9", b"8").replace(b"x 1", b"x 2"))
    assert (raw.message, raw.values.tolist()) == ("solution 2 of 2", [2])


def test_a_solution_of_the_pool_of_gurobi_is_chosen_by_number():
    path = TINY / "gurobi-13.0.3_milp_pool.json"
    one, two = read_raw(path), read_raw(path, 2)
    assert (two.status, two.objective, two.bound) == ("feasible", 0.728214059788993, None)
    for number, raw in ((1, one), (2, two)):
        solution = cf.read_solution(path, problem("milp"), solution=number)
        assert solution.objective == pytest.approx(raw.objective)
        assert solution.violation.worst < 1e-6
    data = re.sub(rb'"PoolNX": \[ \S+ 0\]', b'"PoolNX": [ 1]', path.read_bytes(), count=1)
    with pytest.raises(cf.SolutionError, match="not every column has 2 values"):
        parse_raw(data)


# what is particular about a program


def test_cbc_with_rows_and_marks_gives_the_same_columns():
    names = problem("milp").to_arrays().column_names.tolist()
    plain, with_rows = (read_raw(TINY / f"cbc-2.10.8_milp_optimal{end}.sol") for end in ("", "_all"))
    assert plain.names.tolist() == with_rows.names.tolist() == [name.encode() for name in names]
    assert plain.values.tolist() == with_rows.values.tolist()
    data = (TINY / "cbc-2.10.8_milp_optimal_all.sol").read_bytes()
    marked = re.sub(rb"\n(?= +\d+ (?:alpha|p1|c14))", rb"\n**", data)
    assert marked.count(b"\n**") == 12
    assert parse_raw(marked).values.tolist() == plain.values.tolist()


def test_the_point_of_cbc_is_judged_and_not_its_words(tmp_path):
    data = (TINY / "cbc-2.10.8_milp_optimal.sol").read_bytes()
    for words, status in (
        ("Status unknown", "feasible"),
        ("Words of a later version", "feasible"),
        ("Infeasible", "infeasible"),
        ("Stopped on time (no integer solution - continuous used)", "no-point"),
    ):
        (tmp_path / "x.sol").write_bytes(words.encode() + data.removeprefix(b"Optimal"))
        solution = cf.read_solution(tmp_path / "x.sol", problem("milp"), identified=status == "infeasible")
        assert (solution.status, bool(solution.doubt)) == (status, False)
        if status == "feasible":
            assert solution.message == words
            assert solution.objective == pytest.approx(OPTIMA["milp"], abs=2e-6)


def test_glpk_has_no_names_and_tells_lp_from_mps(tmp_path):
    """The QP has no rows: GLPK lists nine columns, one of them fixed to 1, and the row c_ONE."""
    for order in ("lp", "mps"):
        raw = read_raw(TINY / f"glpk-5.0_milp_optimal_{order}.sol")
        assert (raw.order, raw.rows, len(raw.values)) == (order, 48, 36)
        values = (0.01 * np.arange(1, 9)).tolist()
        listed = [1, *values] if order == "lp" else [*values, 1]
        head = f"c Problem:    {'' if order == 'lp' else 'tiny'}\ns ipt 1 9 o 0\ni 1 1 0\n"
        lines = "".join(f"j {at} {value} 0\n" for at, value in enumerate(listed, 1))
        (tmp_path / "a.sol").write_text(f"{head}{lines}e o f\n")
        assert cf.read_solution(tmp_path / "a.sol", problem("qp")).point.tolist() == values
        parity = cf.formulate(problem("qp").instance, "minlp-parity")
        for other, words in (
            (problem("milp"), "of 9 columns and 1 rows, the problem has 36 .* HiGHS in style 0"),
            (parity, f"is of an .{order} file, and .*; it is of another problem"),
        ):
            with pytest.raises(cf.SolutionError, match=words):
                cf.read_solution(tmp_path / "a.sol", other)


def test_a_missing_column_is_zero_only_where_zeros_are_omitted(tmp_path):
    for file, fatal in (
        ("gurobi-13.0.3_milp_optimal.sol", True),
        ("gurobi-13.0.3_milp_optimal.json", False),
        ("cbc-2.10.8_milp_optimal_all.sol", True),
    ):
        column = rb'\{ "VarName": "p1_00_00_r", "X": 1\}, | *(?:\d+ +)?p1_00_00_r +1.*\n'
        data = re.sub(column, b"", (TINY / file).read_bytes())
        assert b"p1_00_00_r" not in data
        (tmp_path / "a").write_bytes(data)
        if fatal:
            with pytest.raises(cf.SolutionError, match="1 of 35 columns of milp-mccormick are missing"):
                cf.read_solution(tmp_path / "a", problem("milp"))
        else:
            assert cf.read_solution(tmp_path / "a", problem("milp")).violation.worst > 0.1


def test_special_values_of_gams_are_numbers():
    data = (TINY / "gams-54.6.1_conopt_qp_optimal.csv").read_bytes()
    for word, value in (
        (b"EPS", 0),
        (b"  EPS", 0),
        (b"+INF", np.inf),
        (b"-INF", -np.inf),
        (b"-1.5E+00", -1.5),
    ):
        changed = re.sub(rb"(alpha_00_01,).*", rb"\g<1>" + word, data)
        assert parse_raw(changed).values[1] == value


def test_columns_at_0_are_omitted_only_where_the_end_of_the_list_is_there():
    for file, end in (
        ("qsopt_ex-2.5.10.3_milp_optimal_fixed.sol", b"REDUCED COST:"),
        ("cplex-by-layout_milp_display.txt", b"All other variables"),
        ("pyomo-6.10.1_milp_optimal.yml", b"  Constraint:"),
    ):
        data = (TINY / file).read_bytes()
        assert parse_raw(data).omits_zeros
        with pytest.raises(cf.SolutionError, match="the file is cut off: it has no line"):
            parse_raw(data[: data.index(end)])


def test_python_mip_states_no_objective():
    """It writes 0.0 for every model."""
    raw = read_raw(TINY / "mip-2.0.0_milp_optimal.sol")
    assert (raw.objective, raw.omits_zeros) == (None, True)


def test_a_rounded_file_names_the_way_to_all_digits(tmp_path):
    """Three decimals, as in listings of older versions."""
    data = (TINY / "gams-by-layout_milp_optimal.lst").read_bytes()
    rounded = re.sub(rb"\d+\.\d{4}\b", lambda number: b"%.3f" % float(number[0]), data)
    (tmp_path / "old.lst").write_bytes(rounded)
    solution = cf.read_solution(tmp_path / "old.lst", problem("milp"))
    assert solution.status == "unknown"
    assert 1e-5 < solution.violation.worst < 1e-3
    assert "`gams MODEL --RESULTS=FILE.csv` writes all" in solution.remedy
