"""Layouts of answers as people have them: lists, listings, documents, pools, and answers in other text."""

import json
import re
from dataclasses import replace

import pytest
from answers import GOOD, TINY, problem, problem_of
from crossfield.export.solutions.readers.grammar import plain_text
from crossfield.export.solutions.readers.registry import parse_raw, read_raw, recognising_readers
from crossfield.export.solutions.solution import read_solution
from crossfield.models.errors import SolutionError
from crossfield.models.formulations.problem import formulate
from loops import for_each

POOL = TINY / "cplex-22.2.0.1_milp_pool.sol"


def text(file):
    return (TINY / file).read_bytes()


def listed(raw):
    return dict(zip(raw.names.tolist(), raw.values.tolist(), strict=True))


# lists of names and values


@for_each("data", [
        b"a,1\nb_2,-2.5e-3\n", b"name,value\na,1\nb_2,-2.5e-3\n", b'"a","1"\n"b_2","-2.5e-3"\n',
        b",0\na,1\nb_2,-0.0025\n", b"a = 1\nb_2 = -0.0025\n", b"a: 1\nb_2: -0.0025\n", b"a=1;\nb_2=-.0025;\n",
        b"a;1\nb_2;-0,0025\n", b"Name;Wert\na;1,0\nb_2;-2,5e-3\n", b'"a";"1,0"\n"b_2";"-0,0025"\n',
        b"\xef\xbb\xbfname;value\r\na;1\r\nb_2;-0,0025\r\n", b"\n\na , 1\nb_2 , -0.0025\n",
        b'{"a": 1, "b_2": -0.0025}', b'{"variables": {"a": 1, "b_2": -0.0025}}',
        b'{"solution": {"a": 1, "b_2": -0.0025}, "status": "feasible"}',
        b'{"status": "feasible", "a": 1, "objective": 3, "b_2": -0.0025}',
    ])  # fmt: skip
def test_lists_of_names_and_values_are_read(data):
    raw = parse_raw(data)
    assert listed(raw) == {b"a": 1, b"b_2": -0.0025}
    assert (raw.status, raw.omits_zeros) == ("feasible", False)
    assert len(recognising_readers(plain_text(data))) == 1


@for_each("data, fault", [
        (b"a,1\nb,one\nc,3\n", "line 2: 'one' is not a number"),
        (b"a;1\nb;1.5,2\n", "line 2: '1.5.2' is not a number"),
        (b"a = 1\nb = nan\n", "line 2: 'nan' is not a number"),
        (b"a = 1\nb", "line 2: the file is cut off in the middle of this line"),
        (b'{"a": 1, "a": 2}', "an object has a key twice"),
        (b'{"a": 1, "b": "2"}', r"\('b', '2'\)\" is not a name with a value"),
        (b'{"a": 1, "b": NaN}', "b has no value"),
        (b'{"a": 1, "b": true}', "is not a name with a value"),
        (b'{"variables": {}}', "is not a name with a value"),
        (b'{"variables": 3}', "is not a name with a value"),
        (b'{"a": 1,', "line 1: the JSON is damaged or cut off at column 9"),
    ])  # fmt: skip
def test_faults_in_lists_and_documents_are_named(data, fault):
    with pytest.raises(SolutionError, match=fault):
        parse_raw(data)


@for_each("word, status", [
        ("optimal", "optimal-local"), ("feasible", "feasible"), ("infeasible", "infeasible"),
        ("unbounded", "unbounded"), ("maxTimeLimit", "limit-with-point"),
        ("globallyOptimal", "optimal-in-gap"), ("Optimal", "optimal-local"), ("words of a tool", "feasible"),
    ])  # fmt: skip
def test_claims_of_a_plain_document_are_kept(word, status):
    document = {"status": word, "objective": 3.5, "bound": 3, "variables": {"x": 2}}
    raw = parse_raw(json.dumps(document).encode())
    pointless = status in {"infeasible", "unbounded"}
    assert (raw.status, raw.message, raw.has_point) == (status, word, not pointless)
    assert (raw.objective, raw.bound) == ((None, None) if pointless else (3.5, 3))


@for_each("code, status", [(1, "optimal-in-gap"), (2, "feasible"), (0, "no-point"), (-1, "infeasible"),
        (-2, "unbounded")])  # fmt: skip
def test_codes_of_pulp_are_statuses(code, status):
    data = re.sub(rb'"sol_status": \d', b'"sol_status": %d' % code, text("pulp-3.3.2_milp_optimal.json"))
    assert parse_raw(data).status == status


# listings


def test_exact_fractions_of_qsopt_are_numbers():
    third = b"1%b/3%b" % (b"0" * 400, b"0" * 400)
    head = b"status = OPTIMAL\nstatus OPTIMAL\n\tValue = -7/2\nVARS:\n"
    raw = parse_raw(head + b"x = 1/3\ny = -%b\nREDUCED COST:\nx = 5\n" % third)
    assert listed(raw) == {b"x": 1 / 3, b"y": -1 / 3}
    assert (raw.status, raw.objective, raw.omits_zeros) == ("optimal-global", -3.5, True)


def test_columns_at_0_are_omitted_only_where_the_end_of_the_list_is_there():
    for file, end in (
        ("qsopt_ex-2.5.10.3_milp_optimal_fixed.sol", b"REDUCED COST:"),
        ("cplex-by-layout_milp_display.txt", b"All other variables"),
        ("pyomo-6.10.1_milp_optimal.yml", b"  Constraint:"),
    ):
        data = text(file)
        assert parse_raw(data).omits_zeros
        with pytest.raises(SolutionError, match="the file is cut off: it has no line"):
            parse_raw(data[: data.index(end)])


def test_python_mip_states_no_objective():
    """It writes 0.0 for every model."""
    raw = read_raw(TINY / "mip-2.0.0_milp_optimal.sol")
    assert text("mip-2.0.0_milp_optimal.sol").startswith(b"Feasible solution - objective 0.0\n")
    assert (raw.objective, raw.omits_zeros) == (None, True)


@for_each("banner, status", [
        ("Time Limit Reached", "limit-with-point"), ("Optimal Solution Found", "optimal-global"),
        ("Target Gap Achieved", "optimal-in-gap"),
        ("Stopping After Finding First Feasible Solution", "feasible"),
    ])  # fmt: skip
def test_banners_of_symphony_are_statuses(banner, status):
    data = text("symphony-5.6.17_milp_optimal.txt").replace(b"Optimal Solution Found", banner.encode())
    assert parse_raw(data).status == status


@for_each("words, status", [
        ("Integer optimal, tolerance (0.0001/1e-06)", "optimal-in-gap"),
        ("Integer optimal solution", "optimal-global"), ("Aborted, integer feasible", "limit-with-point"),
        ("Time limit exceeded, integer feasible", "limit-with-point"),
    ])  # fmt: skip
def test_words_of_cplex_are_statuses(words, status):
    data = text("cplex-by-layout_milp_display.txt").replace(b"Integer optimal solution", words.encode())
    raw = parse_raw(data)
    assert (raw.status, raw.objective) == (status, 0.55653608285)


def test_an_infeasible_problem_in_a_log_of_cplex():
    assert parse_raw(
        b"CPLEX> optimize\nMIP - Integer infeasible.\nCurrent MIP best bound is infinite.\n"
    ).status == ("infeasible")


@for_each("code, status", [
        (1, "optimal-in-gap"), (2, "optimal-local"), (8, "optimal-in-gap"), (10, "infeasible"),
        (4, "infeasible"), (3, "unbounded"), (14, "limit-without-point"),
    ])  # fmt: skip
def test_states_in_a_gams_listing_are_statuses(code, status):
    data = text("gams-by-layout_milp_optimal.lst").replace(b"MODEL STATUS      1", b"MODEL STATUS %6d" % code)
    raw = parse_raw(data)
    assert (raw.status, raw.has_point) == (status, status in {"optimal-in-gap", "optimal-local"})


def test_a_rounded_file_names_the_way_to_all_digits(tmp_path):
    """Three decimals, as in listings of older versions."""
    path = tmp_path / "old.lst"
    data = text("gams-by-layout_milp_optimal.lst")
    path.write_bytes(re.sub(rb"\d+\.\d{4}\b", lambda number: b"%.3f" % float(number[0]), data))
    solution = read_solution(path, problem("milp"))
    assert solution.status == "unknown"
    assert 1e-5 < solution.violation.worst < 1e-3
    assert "`gams MODEL --RESULTS=FILE.csv` writes all" in solution.remedy


# other text


@for_each("file, begin, end", [
        ("highs-1.15.1", b"Model status\n", b"# Dual"), ("scip-10.0", b"objective value:", None),
        ("cbc-2.10.8", b"Optimal - objective value", b"Total time"), ("glpk-5.0", b"c Problem:", None),
    ])  # fmt: skip
def test_text_before_and_after_changes_nothing(file, begin, end):
    data = text(f"{file}_milp_optimal_log.txt")
    alone = parse_raw(data[data.index(begin) : data.index(end) if end else len(data)])
    mail = b"Dear all,\nhere is the answer:\n\n" + data + b"\nBest wishes\nX.\n"
    for inside in (parse_raw(data), parse_raw(mail)):
        for attribute in ("reader", "status", "message", "objective", "bound", "rows", "omits_zeros"):
            assert getattr(inside, attribute) == getattr(alone, attribute)
        assert inside.values.tolist() == alone.values.tolist()


def test_claims_come_from_the_answer_only():
    """A log states `optimal`, and a mail anything: neither is a claim of the list of values."""
    raw = read_raw(TINY / "scip-10.0_milp_optimal_log.txt")
    assert b"problem is solved [optimal solution found]" in text("scip-10.0_milp_optimal_log.txt")
    assert (raw.status, raw.bound) == ("feasible", None)
    raw = read_raw(TINY / "neos-by-layout_milp_optimal_ampl.txt")
    assert b"optimal solution; objective 0.55" in text("neos-by-layout_milp_optimal_ampl.txt")
    assert (raw.status, raw.objective, raw.bound) == ("feasible", None, None)
    raw = parse_raw(b"Status: optimal\nobjective = 7\n\n" + b"".join(b"x%d = 1\n" % at for at in range(6)))
    assert (raw.status, raw.objective, len(raw.values)) == ("feasible", None, 6)


def test_a_damaged_line_inside_a_text_is_an_error_with_its_place():
    data = text("scip-10.0_milp_optimal_log.txt")
    damaged = re.sub(rb"(?m)^(psi_01_00 +)\S+", rb"\1many", data)
    line = data.count(b"\n", 0, data.index(b"psi_01_00")) + 1
    for words in (b"", b"\nBest wishes\n"):
        with pytest.raises(SolutionError, match=f"line {line}: 'many' is not a number"):
            parse_raw(damaged + words)


# pools


def test_the_solution_of_a_pool_is_chosen_by_number():
    objectives = [0.5565360828459345, 0.5565360828459345, 6.2831853071795862]
    raws = [read_raw(POOL, number) for number in (1, 2, 3)]
    assert [raw.objective for raw in raws] == objectives
    assert [raw.message.rpartition("; ")[2] for raw in raws] == [f"solution {at} of 3" for at in (1, 2, 3)]
    assert [raw.status for raw in raws] == ["limit-with-point", "feasible", "feasible"]
    solution = read_solution(POOL, problem("milp"), solution=3)
    assert solution.objective == pytest.approx(objectives[2])
    for number in (0, 4, -1):
        with pytest.raises(SolutionError, match=f"there is no solution {number} in it; choose one of 1 to 3"):
            read_raw(POOL, number)
    with pytest.raises(SolutionError, match="no solution 2 in it; choose one of 1 to 1"):
        read_raw(TINY / "gurobi-13.0.3_milp_optimal.json", 2)


def test_the_best_of_a_pool_is_the_default_and_without_objectives_the_first():
    data = POOL.read_bytes()
    worse = data.replace(b'objectiveValue="0.55653608284593448"', b'objectiveValue="7"', 1)
    assert parse_raw(worse).message.endswith("p3; solution 2 of 3")
    unknown = data.replace(b'objectiveValue="6.2831853071795862"', b"")
    assert parse_raw(unknown).message.endswith("incumbent; solution 1 of 3")
    twice = b"Value of objective function: 9\n\nActual values of the variables:\nx 1\n\n"
    raw = parse_raw(twice + twice.replace(b"9", b"8").replace(b"x 1", b"x 2"))
    assert (raw.message, listed(raw)) == ("solution 2 of 2", {b"x": 2})


def test_a_solution_of_the_pool_of_gurobi_is_chosen_by_number():
    path = TINY / "gurobi-13.0.3_milp_pool.json"
    second = read_raw(path, 2)
    entries = json.loads(path.read_bytes())["Vars"]
    assert listed(second) == {entry["VarName"].encode(): entry["PoolNX"][1] for entry in entries}
    assert (second.status, second.objective, second.bound) == ("feasible", 0.728214059788993, None)
    solution = read_solution(path, problem("milp"), solution=2)
    assert solution.objective == pytest.approx(second.objective)
    data = re.sub(rb'"PoolNX": \[ \S+ 0\]', b'"PoolNX": [ 1]', path.read_bytes(), count=1)
    with pytest.raises(SolutionError, match="not every column has 2 values"):
        parse_raw(data)


# identity


@for_each("path", [path for path in GOOD if problem_of(path) == "milp" and read_raw(path).stamps])
def test_a_file_that_states_its_problem_is_refused_for_another(path):
    assert read_solution(path, problem("milp")).identified
    other = replace(problem("milp").instance, stroke_coefficient=1.5000001)
    with pytest.raises(SolutionError, match="is of another problem: it states"):
        read_solution(path, formulate(other, "milp-mccormick"))


# speed


def test_a_long_list_of_pairs_is_read_in_pieces():
    count = 100_000
    data = b"name,value\n" + b"".join(b"alpha_%06d,%d.5\n" % (at, at) for at in range(count))
    raw = parse_raw(data)
    assert (len(raw.names), raw.values[-1]) == (count, count - 0.5)
    with pytest.raises(SolutionError, match=f"line {count // 2 + 2}: 1 words stand where 2 should"):
        parse_raw(data.replace(b"alpha_050000,50000.5", b"alpha_050000="))
