"""Solution files of other solvers than HiGHS and AMPL's, as the real ones wrote them for our files."""

import json
import re

import numpy as np
import pytest
from answers import (
    BAD,
    ERROR,
    FEASIBLE,
    FILES,
    GLOBAL,
    GOOD,
    HERE,
    IN_GAP,
    INFEASIBLE,
    LIMIT,
    LOCAL,
    NOTHING,
    OPTIMA,
    PROVEN,
    RELAXATIONS,
    ROUNDED,
    SILENT,
    TINY,
    UNBOUNDED,
    WITH_POINT,
    A,
    B,
    C,
    G,
    K,
    X,
    problem,
    problem_of,
)
from crossfield.export.solutions.readers.grammar import HEAD
from crossfield.export.solutions.readers.registry import parse_raw, read_raw, recognising_readers
from crossfield.export.solutions.readers.siblings import sibling_of
from crossfield.export.solutions.readers.text import values_by_name, values_in_order
from crossfield.export.solutions.solution import read_solution
from crossfield.models.errors import SolutionError
from crossfield.models.formulations.names import column_names
from loops import for_each


def names_of(name):
    matrix = np.ascontiguousarray(column_names(problem(name).instance, problem(name).blocks))
    return matrix.view(f"S{matrix.shape[1]}").ravel()


def text(file):
    return (TINY / file).read_bytes()


def swapped(file, old, new):
    """A file with one replacement, whose old text must exist."""
    data = text(file)
    assert old in data
    return data.replace(old, new, 1)


# what real solvers write


@for_each("path", GOOD)
def test_every_file_has_its_reader_its_status_and_its_point(path):
    reader, status = FILES[path.name]
    raw = read_raw(path)
    assert (raw.reader, raw.status) == (reader, status)
    # GLPK and CPLEX write their last point whatever it is; the point is judged, not the word.
    assert raw.has_point == (status in WITH_POINT or "glpk-5.0_milp_time_without_point" in path.name)
    assert (raw.names is None) == (reader == "glpk" and raw.has_point)
    assert "\n" not in raw.message


@for_each("path", [*GOOD, *BAD, *(path for path in HERE.rglob("*.sol") if TINY not in path.parents)])
def test_no_file_is_claimed_by_two_readers(path):
    text = path.read_bytes()
    assert len(recognising_readers(text)) == (
        0 if path.stem in {"empty", "junk"} or sibling_of(text[:HEAD]) else 1
    )


@for_each("path", [path for path in GOOD if FILES[path.name][1] in WITH_POINT and problem_of(path)])
def test_the_point_is_the_one_that_the_solver_had(path):
    status, name = FILES[path.name][1], problem_of(path)
    solution = read_solution(path, problem(name), identified=True)
    assert (solution.unknown, solution.claimed) == (path.stem.endswith("_prints"), status)  # Total, of PuLP
    if solution.reported is not None:
        assert solution.objective == pytest.approx(solution.reported, abs=1e-6)
    worst = solution.violation.worst
    if any(part in path.name for part in RELAXATIONS):
        assert worst > 0.1
        assert solution.status == "unknown"
        return
    assert solution.status == (GLOBAL if path.name in PROVEN else status)
    digits = 1e-4 if path.stem in ROUNDED else 1e-6
    assert worst < digits
    assert solution.objective > OPTIMA[name] - 2 * digits
    if "optimal" in path.name or "pool" in path.name:
        assert solution.objective == pytest.approx(OPTIMA[name], abs=2 * digits)


# what is particular about each


def test_gurobi_lists_have_comments_or_none():
    lines = text(f"{G}_milp_optimal.sol").splitlines(keepends=True)
    whole = parse_raw(b"".join(lines))
    assert whole.objective == 0.55653608284593448
    for head in ([], lines[1:2], [b"# written by hand\n"], [b"# Objective value 0.5\n"]):
        raw = parse_raw(b"".join([*head, *lines[2:]]))
        assert (raw.reader, raw.status, raw.values.tolist()) == ("gurobi", "feasible", whole.values.tolist())
        assert raw.objective == {b"# Objective value 0.5\n": 0.5, lines[1]: whole.objective}.get(
            b"".join(head)
        )


def test_a_missing_column_is_zero_only_where_zeros_are_omitted(tmp_path):
    for file, fatal in ((f"{G}_milp_optimal.sol", True), (f"{G}_milp_optimal.json", False)):
        data = re.sub(rb'\{ "VarName": "p1_00_00_r", "X": 1\}, |p1_00_00_r 1\n', b"", text(file))
        assert b"p1_00_00_r" not in data
        (tmp_path / "a").write_bytes(data)
        if fatal:
            with pytest.raises(SolutionError, match="1 of 35 columns of milp-mccormick are missing"):
                read_solution(tmp_path / "a", problem("milp"))
        else:
            assert read_solution(tmp_path / "a", problem("milp")).violation.worst > 0.1


@for_each("code", range(1, 21))
def test_codes_of_gurobi_are_statuses(code):
    with_point = {
        "SolutionInfo": {"Status": code, "ObjVal": 3},
        "Vars": [{"VarName": "x", "X": 2}, {"VarName": "y"}],
    }
    raw = parse_raw(json.dumps(with_point).encode())
    expected = {2: IN_GAP, 13: FEASIBLE, 18: LOCAL, 3: INFEASIBLE, 4: INFEASIBLE, 5: UNBOUNDED}
    limit = code in {6, 7, 8, 9, 10, 11, 15, 16, 17, 19}
    assert raw.status == expected.get(code, LIMIT if limit else ERROR)
    assert raw.values.tolist() == ([] if code in {3, 4, 5} else [2, 0])
    if code not in {2, 18}:
        del with_point["Vars"]
        alone = parse_raw(json.dumps(with_point).encode())
        assert alone.status == (NOTHING if limit else raw.status if code in {3, 4, 5} else ERROR)
        assert not alone.has_point


def test_the_incumbent_of_a_pool_is_read():
    raw = read_raw(TINY / f"{G}_milp_pool.json")
    values = values_by_name(names_of("milp"), raw)
    listed = json.loads(text(f"{G}_milp_pool.json"))["Vars"]
    first = {entry["VarName"]: entry["PoolNX"][0] for entry in listed}
    assert values.values.tolist() == [first.get(name.decode(), 0) for name in names_of("milp")]
    assert values.unknown == 0
    raw = read_raw(TINY / f"{C}_milp_pool.sol")
    assert raw.message == "populate solution limit exceeded; incumbent; solution 1 of 3"
    assert (raw.values == read_raw(TINY / f"{C}_milp_optimal.sol").values).all()
    raw = read_raw(TINY / "xpress-by-layout_milp_two_solutions.slx")
    assert raw.message == "solution 1 of 2"
    assert (raw.values == read_raw(TINY / f"{X}_milp_optimal.slx").values).all()


@for_each("code, status", [
        (1, GLOBAL), (101, GLOBAL), (102, IN_GAP), (129, GLOBAL), (130, IN_GAP), (24, LOCAL), (5, FEASIBLE),
        (127, FEASIBLE),
        (3, INFEASIBLE), (4, INFEASIBLE), (103, INFEASIBLE), (119, INFEASIBLE), (2, UNBOUNDED),
        (118, UNBOUNDED), (104, LIMIT), (107, LIMIT), (113, LIMIT), (131, LIMIT), (108, NOTHING),
        (114, NOTHING), (11, LIMIT), (14, ERROR), (301, ERROR), (9999999, ERROR),
    ])  # fmt: skip
def test_codes_of_cplex_are_statuses(code, status):
    raw = parse_raw(swapped(f"{C}_qp_optimal.sol", b'StatusValue="1"', f'StatusValue="{code}"'.encode()))
    assert (raw.status, raw.has_point) == (status, status not in {INFEASIBLE, UNBOUNDED})


def test_a_stopped_simplex_claims_a_point_only_when_it_is_feasible():
    data = swapped(f"{C}_qp_optimal.sol", b'StatusValue="1"', b'StatusValue="11"')
    raw = parse_raw(data.replace(b'primalFeasible="1"', b'primalFeasible="0"'))
    assert (raw.status, raw.has_point) == (NOTHING, True)


@for_each("words, status, without_point", [
        ("optimal solution found", GLOBAL, ERROR), ("gap limit reached", IN_GAP, ERROR),
        ("node limit reached", LIMIT, NOTHING), ("user interrupt", LIMIT, NOTHING),
        ("infeasible", INFEASIBLE, INFEASIBLE), ("infeasible or unbounded", INFEASIBLE, INFEASIBLE),
        ("unbounded", UNBOUNDED, UNBOUNDED), ("unknown", FEASIBLE, SILENT),
        ("words of a later version", ERROR, ERROR),
    ])  # fmt: skip
def test_words_of_scip_are_statuses(words, status, without_point):
    raw = parse_raw(f"solution status: {words}\nobjective value: 3\nx 3 \t(obj:1)\n".encode())
    assert (raw.status, raw.message, raw.values.tolist()) == (status, words, [3])
    raw = parse_raw(f"solution status: {words}\nno solution available\n".encode())
    assert (raw.status, raw.has_point) == (without_point, False)


def test_cbc_without_a_point_may_write_a_single_line():
    for words, status in (("Stopped on time", NOTHING), ("Stopped on nodes", NOTHING), ("Optimal", ERROR)):
        raw = parse_raw(f"{words} - objective value 1e+50\n".encode())
        assert (raw.reader, raw.status, raw.has_point, raw.objective) == ("cbc", status, False, None)


def test_cbc_with_rows_and_marks_gives_the_same_columns():
    plain, with_rows = (read_raw(TINY / f"{B}_milp_optimal{end}.sol") for end in ("", "_all"))
    assert plain.names.tolist() == with_rows.names.tolist() == names_of("milp").tolist()
    assert plain.values.tolist() == with_rows.values.tolist()
    marked = re.sub(rb"\n(?= +\d+ (?:alpha|p1|c14))", rb"\n**", text(f"{B}_milp_optimal_all.sol"))
    assert marked.count(b"\n**") == 12
    assert parse_raw(marked).values.tolist() == plain.values.tolist()


@for_each("words, status", [
        ("Optimal", IN_GAP), ("Optimal (within gap tolerance)", IN_GAP), ("Infeasible", INFEASIBLE),
        ("Integer infeasible", INFEASIBLE), ("Unbounded", UNBOUNDED), ("Stopped on time", LIMIT),
        ("Stopped on iterations", LIMIT), ("Stopped on difficulties", ERROR), ("Status unknown", ERROR),
        ("Stopped on time (no integer solution - continuous used)", NOTHING),
    ])  # fmt: skip
def test_words_of_cbc_are_statuses(words, status):
    raw = parse_raw(f"{words} - objective value 3.00000000\n      0 x    3   0\n".encode())
    assert (raw.reader, raw.status, raw.message) == ("cbc", status, words)
    kept = status in WITH_POINT or status == ERROR
    assert raw.values.tolist() == ([3] if kept else [])


@for_each("words, status", [
        ("Status unknown", "feasible"), ("Words of a later version", "feasible"),
        ("Infeasible", INFEASIBLE), ("Stopped on time (no integer solution - continuous used)", SILENT),
    ])  # fmt: skip
def test_the_point_of_cbc_is_judged_and_not_its_words(tmp_path, words, status):
    data = text(f"{B}_milp_optimal.sol")
    head = re.match(rb"Optimal", data)
    (tmp_path / "x.sol").write_bytes(words.encode() + data[head.end() :])
    solution = read_solution(tmp_path / "x.sol", problem("milp"), identified=status == INFEASIBLE)
    assert (solution.status, bool(solution.doubt)) == (status, False)
    if status == "feasible":
        assert solution.message == words
        assert solution.objective == pytest.approx(OPTIMA["milp"], abs=2e-6)


def test_glpk_has_no_names_and_tells_lp_from_mps():
    raws = {order: read_raw(TINY / f"{K}_milp_optimal_{order}.sol") for order in ("lp", "mps")}
    for order, raw in raws.items():
        assert (raw.order, raw.rows, len(raw.values)) == (order, 48, 36)
        with pytest.raises(SolutionError, match=f"without names.*in the order of the .{order} file"):
            values_by_name(names_of("milp"), raw)
        for rows, columns in ((48, 35), (49, 36), (46, 36)):
            with pytest.raises(SolutionError, match="of 36 columns and 48 rows, the problem has"):
                values_in_order(columns, rows, raw)


@pytest.mark.parametrize("order", ["lp", "mps"])
def test_one_comes_first_in_lp_and_last_in_mps(tmp_path, order):
    """The QP has no rows: GLPK lists nine columns, one of them fixed to 1, and the row c_ONE."""
    values = dict(zip(names_of("qp").tolist(), 0.01 * np.arange(1, 9), strict=True))
    listed = [1, *values.values()] if order == "lp" else [*values.values(), 1]
    head = f"c Problem:    {'' if order == 'lp' else 'tiny'}\ns ipt 1 9 o 0\ni 1 1 0\n"
    lines = "".join(f"j {at} {value} 0\n" for at, value in enumerate(listed, 1))
    (tmp_path / "a.sol").write_text(f"{head}{lines}e o f\n")
    assert read_solution(tmp_path / "a.sol", problem("qp")).point.tolist() == list(values.values())


@for_each("kind, letters, status", [
        ("mip", "o", GLOBAL), ("mip", "f", LIMIT), ("mip", "i", NOTHING), ("mip", "n", INFEASIBLE),
        ("mip", "u", NOTHING), ("ipt", "o", GLOBAL), ("ipt", "u", NOTHING), ("bas", "f f", GLOBAL),
        ("bas", "f u", LIMIT), ("bas", "n u", INFEASIBLE), ("bas", "f n", UNBOUNDED),
        ("bas", "u u", NOTHING), ("bas", "i f", NOTHING),
    ])  # fmt: skip
def test_letters_of_glpk_are_statuses(kind, letters, status):
    line = {"mip": "2.5", "ipt": "2.5 7", "bas": "b 2.5 7"}[kind]
    raw = parse_raw(f"s {kind} 1 1 {letters} -3\ni 1 {line}\nj 1 {line}\ne o f\n".encode())
    assert (raw.status, raw.values.tolist()) == (status, [] if status in {INFEASIBLE, UNBOUNDED} else [2.5])


@pytest.mark.parametrize(
    "word, value", [("EPS", 0), ("  EPS", 0), ("+INF", np.inf), ("-INF", -np.inf), ("-1.5E+00", -1.5)]
)
def test_special_values_of_gams_are_numbers(word, value):
    data = re.sub(rb"(alpha_00_01,).*", rb"\g<1>" + word.encode(), text(f"{A}_conopt_qp_optimal.csv"))
    assert parse_raw(data).values[1] == value


@for_each("model, solver, status", [
        (1, 1, IN_GAP), (2, 1, LOCAL), (3, 1, UNBOUNDED), (4, 1, INFEASIBLE), (5, 1, NOTHING),
        (6, 3, NOTHING), (7, 1, FEASIBLE), (7, 2, LIMIT), (8, 3, LIMIT), (8, 1, IN_GAP),
        (10, 1, INFEASIBLE), (13, 10, ERROR), (14, 3, NOTHING), (14, 7, ERROR), (19, 1, INFEASIBLE),
        (99, 1, ERROR),
    ])  # fmt: skip
def test_states_of_gams_are_statuses(model, solver, status):
    data = text(f"{A}_conopt_qp_optimal.csv").replace(
        b"model_status,2\nsolver_status,1", f"model_status,{model}\nsolver_status,{solver}".encode()
    )
    raw = parse_raw(data)
    assert (raw.status, raw.has_point) == (status, status in WITH_POINT)
