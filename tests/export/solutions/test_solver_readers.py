"""Solution files of other solvers than HiGHS and AMPL's, as the real ones wrote them for our files."""

import itertools
import json
import re
import sys
import tracemalloc

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
    INFEASIBLE,
    LIMIT,
    LOCAL,
    NOTHING,
    OPTIMA,
    RELAXATIONS,
    SILENT,
    STATUS_ALONE,
    TINY,
    UNBOUNDED,
    WITH_POINT,
    A,
    B,
    C,
    G,
    K,
    R,
    S,
    X,
    problem,
    problem_of,
)
from crossfield.export.solutions.readers.registry import READERS, parse_raw, read_raw
from crossfield.export.solutions.readers.text import HEAD, Status, values_for, values_in_order
from crossfield.export.solutions.solution import read_solution
from crossfield.models.errors import SolutionError
from crossfield.models.formulations.names import column_names
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each


def names_of(name):
    matrix = np.ascontiguousarray(column_names(problem(name)))
    return matrix.view(f"S{matrix.shape[1]}").ravel()


def text(file):
    return (TINY / file).read_bytes()


def swapped(file, old, new):
    """A file with one replacement, whose old text must exist."""
    data = text(file)
    assert old in data
    return data.replace(old, new, 1)


# what real solvers write


def test_every_file_is_in_the_table_and_every_reader_has_one():
    assert {path.name for path in GOOD} == set(FILES)
    readers = {reader for reader, _ in FILES.values()}
    assert readers | {"highs", "ampl-text", "ampl-binary"} == {reader.name for reader in READERS}


@for_each("path", GOOD)
def test_reader_status_and_point(path):
    reader, status = FILES[path.name]
    raw = read_raw(path)
    assert (raw.reader, raw.status) == (reader, status)
    assert raw.has_point == (status in WITH_POINT and reader not in STATUS_ALONE)
    assert (raw.names is None) == (reader == "glpk" and raw.has_point)
    assert "\n" not in raw.message


@for_each("path", [*GOOD, *BAD, *(path for path in HERE.rglob("*.sol") if TINY not in path.parents)])
def test_no_file_is_claimed_by_two_readers(path):
    head = path.read_bytes()[:HEAD]
    claimed = [reader.name for reader in READERS if reader.recognises(head)]
    if path.stem in {"empty", "junk"}:
        assert claimed == []
    else:
        assert len(claimed) == 1


@for_each("path", [path for path in GOOD if FILES[path.name][1] in WITH_POINT and problem_of(path)])
def test_the_point_is_the_one_that_the_solver_had(path):
    reader, status = FILES[path.name]
    name = problem_of(path)
    solution = read_solution(path, problem(name))
    if reader in STATUS_ALONE:
        assert (solution.point, solution.status, solution.reported) == (None, status, None)
        return
    assert (solution.unknown, solution.claimed) == (0, status)
    if solution.reported is not None:
        assert solution.objective == pytest.approx(solution.reported, abs=1e-6)
    worst = solution.violation.worst
    if any(part in path.name for part in RELAXATIONS):
        assert worst > 0.1
        assert solution.status == "unknown"
        return
    assert solution.status == status
    assert worst < 1e-6
    assert solution.objective > OPTIMA[name] - 2e-6
    if "optimal" in path.name or "pool" in path.name:
        assert solution.objective == pytest.approx(OPTIMA[name], abs=2e-6)


@for_each("path", GOOD)
def test_windows_line_ends_change_nothing(path):
    data = path.read_bytes()
    one, other = parse_raw(data), parse_raw(data.replace(b"\n", b"\r\n"))
    assert (one.status, one.message, one.rows, one.objective) == (
        other.status,
        other.message,
        other.rows,
        other.objective,
    )
    assert one.values.tolist() == other.values.tolist()


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


@pytest.mark.parametrize(
    "word, value",
    [
        ("1.#INF", np.inf),
        ("-inf", -np.inf),
        ("1e+20", 1e20),
        ("-0", 0),
        (".5D-1", 0.05),
        ("0.9999999", 0.9999999),
    ],
)
def test_spellings_of_numbers_in_every_list(word, value):
    for data in (
        f"# Objective value = 1\nx {word}\ny 1\n",
        f"objective value: 1\nx {word} \t(obj:0)\ny 1 \t(obj:{word})\n",
        f"Optimal - objective value 1\n  0 x {word} 0\n  1 y 1 {word}\n",
        f"s mip 1 2 o 1\ni 1 {word}\nj 1 {word}\nj 2 1\ne o f\n",
        f"NAME a\n  C x {word}\n  C y 1\nENDATA\n",
        f'1,"x ","C","BS",{word},0,0,{word},0\n2,"y ","C","BS",1,0,0,{word},0\n',
        f"model_status,1\nsolver_status,1\nobjective,1\nx,{word}\ny, 1\n",
        f"=obj= 1\nx {word}\ny 1\n",
        (
            '<CPLEXSolution><header solutionStatusValue="1"/>'
            f'<variable name="x" value="{word}"/><variable name="y" value="1"/></CPLEXSolution>'
        ),
    ):
        assert parse_raw(data.encode()).values.tolist() == [value, 1]


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
def test_codes_of_gurobi(code):
    with_point = {
        "SolutionInfo": {"Status": code, "ObjVal": 3},
        "Vars": [{"VarName": "x", "X": 2}, {"VarName": "y"}],
    }
    raw = parse_raw(json.dumps(with_point).encode())
    expected = {2: GLOBAL, 13: FEASIBLE, 18: LOCAL, 3: INFEASIBLE, 4: INFEASIBLE, 5: UNBOUNDED}
    limit = code in {6, 7, 8, 9, 10, 11, 15, 16, 17, 19}
    assert raw.status == expected.get(code, LIMIT if limit else ERROR)
    assert raw.values.tolist() == ([] if code in {3, 4, 5} else [2, 0])
    if code != 2:
        del with_point["Vars"]
        alone = parse_raw(json.dumps(with_point).encode())
        assert alone.status == (
            NOTHING if limit else raw.status if code in {3, 4, 5} else LOCAL if code == 18 else ERROR
        )
        assert not alone.has_point


def test_the_incumbent_of_a_pool_is_read():
    raw = read_raw(TINY / f"{G}_milp_pool.json")
    values = values_for(names_of("milp"), raw)
    listed = json.loads(text(f"{G}_milp_pool.json"))["Vars"]
    first = {entry["VarName"]: entry["PoolNX"][0] for entry in listed}
    assert values.values.tolist() == [first.get(name.decode(), 0) for name in names_of("milp")]
    assert values.unknown == 0
    raw = read_raw(TINY / f"{C}_milp_pool.sol")
    assert raw.message == "populate solution limit exceeded; incumbent, the first of 3 solutions"
    assert (raw.values == read_raw(TINY / f"{C}_milp_optimal.sol").values).all()
    raw = read_raw(TINY / "xpress-by-layout_milp_two_solutions.slx")
    assert raw.message == "the first of 2 solutions"
    assert (raw.values == read_raw(TINY / f"{X}_milp_optimal.slx").values).all()


@for_each("code, status", [
        (1, GLOBAL), (101, GLOBAL), (102, GLOBAL), (129, GLOBAL), (24, LOCAL), (5, FEASIBLE), (127, FEASIBLE),
        (3, INFEASIBLE), (4, INFEASIBLE), (103, INFEASIBLE), (119, INFEASIBLE), (2, UNBOUNDED),
        (118, UNBOUNDED), (104, LIMIT), (107, LIMIT), (113, LIMIT), (131, LIMIT), (108, NOTHING),
        (114, NOTHING), (11, LIMIT), (14, ERROR), (301, ERROR), (9999999, ERROR),
    ])  # fmt: skip
def test_codes_of_cplex(code, status):
    raw = parse_raw(swapped(f"{C}_qp_optimal.sol", b'StatusValue="1"', f'StatusValue="{code}"'.encode()))
    assert (raw.status, raw.has_point) == (status, status in WITH_POINT)


def test_a_stopped_simplex_has_a_point_only_when_it_is_feasible():
    data = swapped(f"{C}_qp_optimal.sol", b'StatusValue="1"', b'StatusValue="11"')
    raw = parse_raw(data.replace(b'primalFeasible="1"', b'primalFeasible="0"'))
    assert (raw.status, raw.has_point) == (NOTHING, False)


def test_cplex_omits_zeros_only_when_it_says_so():
    dense, sparse = (read_raw(TINY / f"{C}_milp_optimal{end}.sol") for end in ("", "_nonzero"))
    assert (dense.omits_zeros, sparse.omits_zeros) == (False, True)
    assert len(dense.values) == 35
    assert len(sparse.values) == np.count_nonzero(dense.values)
    name = names_of("milp")
    assert (values_for(name, dense).values == values_for(name, sparse).values).all()


def test_escaped_names_of_cplex():
    raw = parse_raw(swapped(f"{C}_qp_optimal.sol", b'"ONE"', b'"a&lt;b&amp;c"'))
    assert raw.names[0] == b"a<b&c"


def test_zeros_of_scip_may_be_written():
    sparse, dense = (read_raw(TINY / f"{S}_milp_{end}.sol") for end in ("optimal", "zeros_without_status"))
    assert len(sparse.values) < len(dense.values) == 35
    name = names_of("milp")
    for raw in (sparse, dense):
        assert values_for(name, raw).unknown == 0
    np.testing.assert_allclose(values_for(name, sparse).values, values_for(name, dense).values, atol=1e-9)


def test_columns_that_scip_adds_are_no_strangers():
    raw = read_raw(TINY / f"{S}_quartic_nl_without_status.sol")
    assert b"nlobjvar" in raw.names
    assert values_for(names_of("quartic"), raw).unknown == 0


def test_infinite_values_of_scip():
    raw = read_raw(TINY / f"{S}_other_infinite.sol")
    assert raw.values.tolist() == [np.inf, -np.inf]


@for_each("words, status, without_point", [
        ("optimal solution found", GLOBAL, ERROR), ("gap limit reached", LIMIT, NOTHING),
        ("node limit reached", LIMIT, NOTHING), ("user interrupt", LIMIT, NOTHING),
        ("infeasible", INFEASIBLE, INFEASIBLE), ("infeasible or unbounded", INFEASIBLE, INFEASIBLE),
        ("unbounded", UNBOUNDED, UNBOUNDED), ("unknown", FEASIBLE, SILENT),
        ("words of a later version", ERROR, ERROR),
    ])  # fmt: skip
def test_words_of_scip(words, status, without_point):
    raw = parse_raw(f"solution status: {words}\nobjective value: 3\nx 3 \t(obj:1)\n".encode())
    assert (raw.status, raw.message, raw.values.tolist()) == (status, words, [3])
    raw = parse_raw(f"solution status: {words}\nno solution available\n".encode())
    assert (raw.status, raw.has_point) == (without_point, False)


def test_cbc_with_rows_and_marks_gives_the_same_columns():
    plain, with_rows = (read_raw(TINY / f"{B}_milp_optimal{end}.sol") for end in ("", "_all"))
    assert plain.names.tolist() == with_rows.names.tolist() == names_of("milp").tolist()
    assert plain.values.tolist() == with_rows.values.tolist()
    marked = re.sub(rb"\n(?= +\d+ (?:alpha|p1|c14))", rb"\n**", text(f"{B}_milp_optimal_all.sol"))
    assert marked.count(b"\n**") == 12
    assert parse_raw(marked).values.tolist() == plain.values.tolist()


def test_cbc_omits_zeros_when_none_is_written():
    data = text(f"{B}_milp_optimal.sol")
    dense = parse_raw(data)
    sparse = parse_raw(re.sub(rb"\n +\d+ \S+ +0 +\S+(?=\n)", b"", data))
    assert (dense.omits_zeros, sparse.omits_zeros) == (False, True)
    assert len(sparse.values) == np.count_nonzero(dense.values)
    name = names_of("milp")
    assert (values_for(name, sparse).values == values_for(name, dense).values).all()


@for_each("words, status", [
        ("Optimal", GLOBAL), ("Optimal (within gap tolerance)", GLOBAL), ("Infeasible", INFEASIBLE),
        ("Integer infeasible", INFEASIBLE), ("Unbounded", UNBOUNDED), ("Stopped on time", LIMIT),
        ("Stopped on iterations", LIMIT), ("Stopped on difficulties", ERROR), ("Status unknown", ERROR),
        ("Stopped on time (no integer solution - continuous used)", NOTHING),
    ])  # fmt: skip
def test_words_of_cbc(words, status):
    raw = parse_raw(f"{words} - objective value 3.00000000\n      0 x    3   0\n".encode())
    assert (raw.reader, raw.status, raw.message) == ("cbc", status, words)
    assert raw.values.tolist() == ([3] if status in WITH_POINT else [])


def test_glpk_has_no_names_and_tells_lp_from_mps():
    raws = {order: read_raw(TINY / f"{K}_milp_optimal_{order}.sol") for order in ("lp", "mps")}
    for order, raw in raws.items():
        assert (raw.order, raw.rows, len(raw.values)) == (order, 48, 35)
        with pytest.raises(SolutionError, match=f"without names.*in the order of the .{order} file"):
            values_for(names_of("milp"), raw)
        for rows, columns in ((48, 34), (49, 35), (46, 35)):
            with pytest.raises(SolutionError, match="of 35 columns and 48 rows, the problem has"):
                values_in_order(columns, rows, raw)


@pytest.mark.parametrize("order", ["lp", "mps"])
def test_one_comes_first_in_lp_and_last_in_mps(tmp_path, order):
    """The QP has a constant and no rows: GLPK would list nine columns, one of them ONE, and the row c_ONE."""
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
def test_letters_of_glpk(kind, letters, status):
    line = {"mip": "2.5", "ipt": "2.5 7", "bas": "b 2.5 7"}[kind]
    raw = parse_raw(f"s {kind} 1 1 {letters} -3\ni 1 {line}\nj 1 {line}\ne o f\n".encode())
    assert (raw.status, raw.values.tolist()) == (status, [2.5] if status in WITH_POINT else [])


def test_highs_style_2_is_told_from_glpk_by_its_extra_row():
    with pytest.raises(SolutionError, match=r"style2\.sol: .*style 2 \(GLPK raw\).*write_solution_style = 0"):
        read_solution(TINY / "bad" / "highs-1.15.1_milp_style2.sol", problem("milp"))


def test_both_files_of_xpress_hold_the_same_columns():
    for name in ("milp_optimal", "qp_optimal"):
        slx, asc = (read_raw(TINY / f"{X}_{name}.{end}") for end in ("slx", "asc"))
        assert slx.names.tolist() == asc.names.tolist()
        np.testing.assert_allclose(slx.values, asc.values, rtol=1e-14)


@pytest.mark.parametrize(
    "word, value", [("EPS", 0), ("  EPS", 0), ("+INF", np.inf), ("-INF", -np.inf), ("-1.5E+00", -1.5)]
)
def test_special_values_of_gams(word, value):
    data = re.sub(rb"(alpha_00_01,).*", rb"\g<1>" + word.encode(), text(f"{A}_conopt_qp_optimal.csv"))
    assert parse_raw(data).values[1] == value


@for_each("model, solver, status", [
        (1, 1, GLOBAL), (2, 1, LOCAL), (3, 1, UNBOUNDED), (4, 1, INFEASIBLE), (5, 1, NOTHING),
        (6, 3, NOTHING), (7, 1, FEASIBLE), (7, 2, LIMIT), (8, 3, LIMIT), (8, 1, FEASIBLE),
        (10, 1, INFEASIBLE), (13, 10, ERROR), (14, 3, NOTHING), (14, 7, ERROR), (19, 1, INFEASIBLE),
        (99, 1, ERROR),
    ])  # fmt: skip
def test_states_of_gams(model, solver, status):
    data = text(f"{A}_conopt_qp_optimal.csv").replace(
        b"model_status,2\nsolver_status,1", f"model_status,{model}\nsolver_status,{solver}".encode()
    )
    raw = parse_raw(data)
    assert (raw.status, raw.has_point) == (status, status in WITH_POINT)
    listing = swapped(
        f"{A}_conopt_qp_optimal.lst", b"SOLVER STATUS     1", f"SOLVER STATUS     {solver}".encode()
    )
    listing = listing.replace(b"MODEL STATUS      2", f"MODEL STATUS      {model}".encode())
    assert parse_raw(listing).status == status


def test_the_last_solve_of_a_listing_counts():
    first, last = text(f"{A}_cplex_milp_optimal.lst"), text(f"{A}_cplex_milp_time_without_point.lst")
    summary = last[last.index(b"               S O L V E      S") :]
    assert parse_raw(first + summary).status == NOTHING


def test_the_csv_and_the_listing_of_a_run_agree():
    for path in GOOD:
        if FILES[path.name][0] == "gams-csv":
            csv, listing = read_raw(path), read_raw(path.with_suffix(".lst"))
            assert (csv.status, csv.message) == (listing.status, listing.message)


@for_each("solver, model, missing, node, status", [
        (1, 1, 0, 5, GLOBAL), (1, 1, -1, 5, LOCAL), (1, 2, 0, -3, INFEASIBLE), (1, 2, -1, -3, NOTHING),
        (1, 3, 0, -1, UNBOUNDED), (1, 4, 0, 5, FEASIBLE), (4, 4, 0, 5, LIMIT), (4, 4, 0, -3, NOTHING),
        (3, 5, 0, -3, NOTHING), (5, 5, 0, -3, ERROR), (9, 4, 0, 5, FEASIBLE), (10, 5, 0, -3, ERROR),
        (11, 5, -1, -3, ERROR),
    ])  # fmt: skip
def test_codes_of_baron(solver, model, missing, node, status):
    raw = parse_raw(f"problem 2 16 10 5 0.1 0.2 {solver} {model} {missing} 13 {node} 3 0.2 0.3\n".encode())
    assert (raw.reader, raw.status, raw.has_point) == ("baron-tim", status, False)


def test_a_short_line_of_an_older_baron():
    assert parse_raw(b"problem 2 16 10 5 0.1 0.2 1 1\n").status == GLOBAL


def test_the_value_is_the_third_column_of_barons_table():
    raw = read_raw(TINY / f"{R}_pair_optimal_res.lst")
    assert raw.names[:2].tolist() == [b"p1_00_00_r", b"p2_00_00_r"]
    assert raw.values[:3].tolist() == [1, 0, -0.0852952087640408834756656]


def test_a_huge_objective_of_baron_is_unbounded():
    raw = parse_raw(text(f"{R}_other_unbounded_res.lst").split(b"The above solution was found along")[0])
    assert (raw.status, raw.has_point) == (UNBOUNDED, False)


def test_miplib_omits_zeros():
    raw = parse_raw(b"=obj= -14.4\nx 10\ny -9.7\n")
    assert (raw.objective, raw.values.tolist(), raw.omits_zeros) == (-14.4, [10, -9.7], True)
    values = values_for(np.array([b"u", b"y"]), raw)
    assert (values.values.tolist(), values.missing, values.unknown) == ([0, -9.7], 0, 1)


# files that are no good

FAULTS = {
    "baron-26.5.27_qp_sum": "summary of BARON, which holds no values; give its results",
    "baron_res_cut": "the end of the search is missing",
    "baron_res_cut_after_the_table": "line 183: the file is cut off where the objective should be",
    "baron_res_cut_in_the_table": "line 173: the table is cut off",
    "baron_res_value_missing": "line 180: 3 words stand where 4 should",
    "baron_tim_status_is_no_number": "line 1: '1.5' is not the number of a status",
    "cbc_cut_in_a_line": "line 84: the file is cut off in the middle",
    "cbc_numbers_start_again_twice": "line 85: the numbers start again for the second time",
    "cbc_value_is_a_word": "line 52: 'many' is not a number",
    "cbc_value_missing": "line 52: 3 words stand where 4 should",
    "cplex-22.2.0.1_milp_integers": "writeLevel 2 and holds the integer columns only; use level 1",
    "cplex_cut": "line 39: the XML is damaged or cut off",
    "cplex_entities": "DTD or entities",
    "cplex_no_header": "no header with a status",
    "cplex_no_variables": "holds no variables",
    "cplex_value_is_nan": "line 33: a variable has no name, or a value that is not a number",
    "gams_csv_na": "line 5: 'NA' is not a number",
    "gams_csv_no_columns": "line 3: no columns follow",
    "gams_csv_no_solver_status": "line 2: 'status,1' stands where solver_status should",
    "gams_csv_state_is_a_word": "line 1: 'two' is not the number of a state",
    "gams_csv_undf": "line 5: 'UNDF' is not a number",
    "gams_lst_cut": "cut off in the summary of its last solve; run GAMS again",
    "gams_lst_no_solve": "no summary of a solve; let the GAMS file run",
    "glpk_column_missing": "line 57: 35 columns are announced, 34 lines follow",
    "glpk_columns_out_of_order": "line 65: this is not the line of column 9",
    "glpk_columns_without_end": "line 57: 999999999999 columns are announced, 35 lines follow",
    "glpk_counts_are_words": "line 8: 's mip many 35 o",
    "glpk_cut": "it has no line `e o f`",
    "gurobi-13.0.3_milp_start": "line 1: this is a MIP start",
    "gurobi_cut_in_a_number": "line 8: the file is cut off in the middle",
    "gurobi_json_cut": "line 1: the JSON is damaged or cut off at column 900",
    "gurobi_json_no_status": "the SolutionInfo has no Status",
    "gurobi_json_optimal_without_vars": "states optimal but holds no Vars",
    "gurobi_json_value_is_nan": "x has no value",
    "gurobi_json_value_is_text": "not a list of names and values",
    "gurobi_no_values": "the file holds no values",
    "gurobi_three_words": "line 5: 3 words stand where 2 should",
    "gurobi_value_is_a_word": "line 5: 'about' is not a number",
    "highs-1.15.1_milp_style2": "style 2",
    "highs-1.15.1_milp_style3": "style 3",
    "miplib_cut_in_a_number": "line 20: the file is cut off in the middle",
    "miplib_objective_is_a_word": "line 1: 'unknown' is not a number",
    "miplib_value_missing": "line 7: 1 words stand where 2 should",
    "scip-10.0_milp_partial": "line 1: this is a partial solution",
    "scip_cut_after_the_status": "line 2: the file is cut off where the objective should be",
    "scip_cut_in_a_line": "line 12: the file is cut off in the middle",
    "scip_no_objective": "line 2: 'the objective is 8.8' stands where the objective should",
    "scip_value_is_unknown": "line 5: 'unknown' is not a number",
    "xpress_asc_cut_in_a_line": "line 83: the file is cut off in the middle",
    "xpress_asc_rows_only": "no line of a column",
    "xpress_asc_value_is_a_word": "line 50: 'half' is not a number",
    "xpress_slx_cut": "it has no line ENDATA",
    "xpress_slx_line_of_a_row": "line 4: this line is of no column",
    "xpress_slx_no_columns": "the file holds no columns",
    "xpress_slx_value_is_a_word": "line 4: 'half' is not a number",
}


@for_each("path", BAD)
def test_bad_files_are_refused_with_file_place_and_remedy(path):
    with pytest.raises(SolutionError, match=re.escape(FAULTS[path.stem])) as caught:
        read_solution(path, problem(problem_of(path) or "milp"))
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert re.search(r"write|give|run|use|refused", message)
    assert "\n" not in message


def listed(raw):
    """Entries of a file: pairs of name and value, or of place and value."""
    names = range(len(raw.values)) if raw.names is None else raw.names.tolist()
    return dict(zip(names, raw.values.tolist(), strict=True))


def cuts(data):
    """Places to cut: after every line, within some, and all along when there are few lines."""
    ends = [at + 1 for at, byte in enumerate(data) if byte == ord("\n")]
    return [*ends[:-1], *range(7, len(data), 997 if len(ends) > 3 else 53), len(data) - 2]


@for_each("path", GOOD)
def test_a_file_cut_anywhere_never_gives_other_values_or_a_stronger_claim(path):
    data = path.read_bytes()
    whole = parse_raw(data)
    for end in cuts(data):
        try:
            raw = parse_raw(data[:end])
        except SolutionError:
            continue
        assert raw.status in {whole.status, Status.FEASIBLE, Status.NO_POINT}
        kept = {name: value for name, value in listed(raw).items() if name in listed(whole)}
        assert kept.items() <= listed(whole).items()
        if whole.has_point and not raw.omits_zeros and raw.names is not None:
            assert (values_for(whole.names, raw).missing == 0) == (len(kept) == len(whole.values))


def attempt(data):
    try:
        raw = parse_raw(data)
    except SolutionError:
        return
    assert not np.isnan(raw.values).any()
    assert raw.names is None or len(raw.names) == len(raw.values)
    assert raw.status in set(Status)
    assert raw.has_point or not raw.values.size


LONG = 600_000
"""Bytes of a hostile file: comparing each with each would take ten minutes."""

HEADS = [
    b"# Solution for model obj\n", b"x 1\ny 2\n",
    b'{ "SolutionInfo": { "Status": 2}, "Vars": [ ', b'{"SolutionInfo":',
    b"<?xml version='1.0'?><CPLEXSolution>", b"<CPLEXSolution><header solutionStatusValue='1'/><variables>",
    b"<!DOCTYPE a><CPLEXSolution>", b"solution status: infeasible\n", b"objective value: 3\n",
    b"NAME a\n  C x 1\n", b"ENDATA\n", b' 1,"x ","C","BS",', b"Optimal - objective value 3\n",
    b"c Problem: a\n", b"s mip 1 1 o 3\n", b"model_status,1\n",
    b"model_status,1\nsolver_status,1\nobjective,3\n", b"GAMS 54.6 Page 1\n",
    b"GAMS 54.6 Page 1\nS O L V E      S U M M A R Y\n", b"===\n BARON version 1\n",
    b"===\n BARON version 1\n *** Normal completion ***\n\nThe best solution found is:\n\n  variable\n",
    b"problem 1 1 1 1 1 1 1 1 ", b"=obj= 3\n", b"=infeas=\n",
]  # fmt: skip


@settings(deadline=None, max_examples=600)
@given(
    st.sampled_from(HEADS),
    st.one_of(
        st.binary(max_size=200), st.text('0123456789.-+eE# \n"<>/,{}[]:abCj*', max_size=200).map(str.encode)
    ),
)
def test_random_bytes_after_a_valid_head_are_refused_or_read(head, tail):
    attempt(head + tail)


PARTS = st.one_of(
    st.binary(max_size=6),
    st.sampled_from(
        [
            b"",
            b"\n",
            b" ",
            b"-",
            b"9" * 30,
            b"nan",
            b"\n\n",
            b"e o f",
            b"</",
            b'"',
            b"}",
            b"ENDATA\n",
            b"\xff",
            b"&a;",
        ]
    ),
)


@pytest.mark.slow
@settings(deadline=None, max_examples=800)
@given(
    st.sampled_from(GOOD),
    st.lists(st.tuples(st.integers(0, 20_000), st.integers(0, 12), PARTS), min_size=1, max_size=4),
)
def test_damaged_files_are_refused_or_read(path, damages):
    data = path.read_bytes()
    for start, length, part in damages:
        at = start % (len(data) + 1)  # the end too: a part may be added to a file that is already empty
        data = data[:at] + part + data[at + length :]
    attempt(data)


@for_each(
    "part",
    [b"\n", b" ", b"1 ", b"a\n", b"*** ", b'"', b"[", b"<a>", b"<a ", b",", b"c\n", b"# \n", b"\0", b"-"],
)
@for_each("head", HEADS)
@pytest.mark.slow
def test_long_repetitions_take_linear_time(head, part):
    """Milliseconds; looking back from every character would exceed the time of a test."""
    attempt(head + part * (LONG // len(part)))


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
        tracemalloc.start()
        with pytest.raises(SolutionError, match="more than 63 characters"):
            parse_raw(data)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 8 << 20


@pytest.mark.parametrize(
    "document", [b"[" * 100_000, b'{ "SolutionInfo": {"Status": ' + b"9" * 100_000 + b"}}"]
)
def test_hostile_json(document):
    start = b"" if document.startswith(b"{") else b'{ "SolutionInfo": '
    attempt(start + document)


# speed


def lines_of(form, count):
    block = "".join(
        form % (f"alpha_{at // 100:03d}_{at % 100:03d}", value)
        for at, value in enumerate(np.sin(np.arange(10_000)))
    )
    return block.encode() * (count // 10_000)


@pytest.mark.parametrize(
    "head, form",
    [("# Solution for model obj\n", "%s %.16e\n"), ("objective value: 3\n", "%-32s %20.15g \t(obj:0)\n")],
    ids=["gurobi", "scip"],
)
def test_lines_are_read_by_the_thousand_and_not_one_by_one(head, form):
    """Some hundred calls for a hundred thousand lines; a check of each line takes more than one per line."""
    data = head.encode() + lines_of(form, 100_000)
    calls = itertools.count()
    before = sys.getprofile()
    sys.setprofile(lambda *_: next(calls))
    try:
        raw = parse_raw(data)
    finally:
        sys.setprofile(before)
    assert next(calls) < 3000
    assert len(raw.values) == 100_000
    assert raw.names[-1] == b"alpha_099_099"
    np.testing.assert_allclose(raw.values[-10_000:], np.sin(np.arange(10_000)), rtol=1e-14)
