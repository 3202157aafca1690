"""Layouts of answers as people have them: documents and pools."""

import json
import re

import numpy as np
import pytest
from answers import TINY, problem
from crossfield.export.solutions.readers.registry import parse_raw, read_raw
from crossfield.export.solutions.solution import read_solution
from crossfield.models.errors import SolutionError
from loops import for_each

POOL = TINY / "cplex-22.2.0.1_milp_pool.sol"


def text(file):
    return (TINY / file).read_bytes()


def listed(raw):
    return dict(zip(raw.names.tolist(), raw.values.tolist(), strict=True))


@for_each("word, status", [
        ("optimal", "optimal-local"), ("feasible", "feasible"), ("infeasible", "infeasible"),
        ("unbounded", "unbounded"), ("maxTimeLimit", "limit-with-point"),
        ("globallyOptimal", "optimal-global"),
    ])  # fmt: skip
def test_claims_of_a_plain_document(word, status):
    document = {"status": word, "objective": 3.5, "bound": 3, "variables": {"x": 2}}
    raw = parse_raw(json.dumps(document).encode())
    pointless = status in {"infeasible", "unbounded"}
    assert (raw.status, raw.message, raw.has_point) == (status, word, not pointless)
    assert (raw.objective, raw.bound) == ((None, None) if pointless else (3.5, 3))


@for_each("code, status", [(1, "optimal-global"), (2, "feasible"), (0, "no-point"), (-1, "infeasible"),
        (-2, "unbounded")])  # fmt: skip
def test_codes_of_pulp(code, status):
    data = re.sub(rb'"sol_status": \d', b'"sol_status": %d' % code, text("pulp-3.3.2_milp_optimal.json"))
    assert parse_raw(data).status == status


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


def test_the_pool_of_gurobi():
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


def test_the_pool_of_xpress():
    path = TINY / "xpress-by-layout_milp_two_solutions.slx"
    first, second = read_raw(path, 1), read_raw(path, 2)
    assert (first.names == second.names).all()
    assert np.abs(first.values - second.values).max() > 0.1
