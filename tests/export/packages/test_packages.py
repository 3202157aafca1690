"""Problems as models of solver packages, and their answers back from memory."""

from __future__ import annotations

import sys
from functools import cache

import crossfield as cf
import numpy as np
import pandas as pd
import pytest
from instance_kinds import grid, surface
from meshes import tetrahedron

PACKAGES = [
    "highs",
    pytest.param("gurobi", marks=pytest.mark.needs("gurobi")),
    pytest.param("scip", marks=pytest.mark.needs("scip")),
    pytest.param("linopy", marks=pytest.mark.needs("linopy")),
    pytest.param("pyomo", marks=pytest.mark.needs("pyomo")),
]


@cache
def instance_of(domain):
    """Three pixels in a row or the four faces of a closed mesh, with strokes that contradict each other."""
    weights = {"stroke_coefficient": 1.0, "skew_coefficient": 0.1}
    if domain == "grid":
        return grid("///", [0.1, 0.9, 1.2], **weights)
    return surface(tetrahedron(), [0, 2], [0.4, 1.0], **weights)


@cache
def problem_of(name, domain="grid"):
    instance = instance_of(domain)
    return cf.formulate(
        instance, name, p=np.zeros(len(instance.domain.first), int) if name == "qp-fixed" else None
    )


def solve(package, model):
    """Solve a model with its package, and return what only the results of the package state."""
    if package == "linopy":
        model.solve("highs", io_api="direct", output_flag=False)
    elif package == "pyomo":
        from pyomo.contrib.appsi.solvers import Highs

        results = Highs().solve(model)
        return {"status": results.termination_condition.name, "bound": results.best_objective_bound}
    else:
        getattr(model, "run" if package == "highs" else "optimize")()
    return {}


@cache
def optimum(name, domain):
    """The objective that HiGHS finds in the file of a problem."""
    return cf.solve(problem_of(name, domain)).objective


@pytest.mark.parametrize("package", PACKAGES)
@pytest.mark.parametrize("domain", ["grid", "mesh"])
def test_a_milp_comes_back_from_memory_as_a_proven_optimum(package, domain):
    problem = problem_of("milp-mccormick", domain)
    model = getattr(problem, f"to_{package}")()
    solution = problem.solution(model, **solve(package, model))
    assert solution.status == "optimal-global"
    assert solution.doubt == solution.caveat == ""
    assert solution.objective == pytest.approx(optimum("milp-mccormick", domain), abs=1e-5)
    assert solution.field.energy(1).total == pytest.approx(solution.objective, abs=1e-5)


@pytest.mark.parametrize("package", PACKAGES[:-1])
def test_a_convex_qp_comes_back_as_an_optimum(package):
    problem = problem_of("qp-fixed")
    model = getattr(problem, f"to_{package}")()
    solution = problem.solution(model, **solve(package, model))
    assert solution.doubt == ""
    assert solution.objective == pytest.approx(optimum("qp-fixed", "grid"), abs=1e-5)
    assert solution.status == "optimal-global"


def test_an_optimum_of_highs_whose_dual_objective_differs_is_none():
    """HiGHS 1.15.1 calls points optimal that are not if a QP has no row; `to_highs` adds one."""
    problem = problem_of("qp-fixed")
    model = problem.to_highs()
    model.deleteRows(1, np.array([0], np.int32))
    model.run()
    solution = problem.solution(model)
    best = optimum("qp-fixed", "grid")
    assert solution.status == ("optimal-global" if solution.objective < best + 1e-5 else "limit-with-point")


IN_SQUARES, IN_AMOUNTS = 0.026406, 0.027006
"""Least energies of the pair of pixels below, in the 2-norm and with the smoothness in the 1-norm."""


@pytest.mark.parametrize(
    "name, package",
    [
        *((name, "gurobi") for name in ("miqp-exact", "minlp-quartic", "miqcp-bilinear")),
        *((name, "scip") for name in ("miqp-exact", "miqcp-bilinear", "minlp-parity")),
        *((name, "pyomo") for name in ("miqcp-bilinear", "minlp-quartic", "minlp-parity")),
        *((name, "linopy") for name in ("miqp-exact", "minlp-quartic")),
    ],
)
@pytest.mark.needs("gurobi")
@pytest.mark.needs("scip")
@pytest.mark.needs("linopy")
@pytest.mark.needs("pyomo")
def test_nonlinear_problems_with_integers_come_back_proven(name, package):
    problem = cf.formulate(grid("//", [0.1, 0.9], stroke_coefficient=1.0, skew_coefficient=0.1), name)
    model = getattr(problem, f"to_{package}")()
    stated = {}
    if package == "pyomo":
        import pyomo.environ as pyo

        results = pyo.SolverFactory("gurobi_direct_minlp").solve(model)
        stated = {"status": results.solver.termination_condition, "bound": results.problem.lower_bound}
    elif package == "linopy":
        model.solve("gurobi", io_api="direct", OutputFlag=0)
    else:
        model.optimize()
    solution = problem.solution(model, **stated)
    assert solution.status == "optimal-global"
    assert solution.doubt == ""
    expected = IN_AMOUNTS if name == "miqcp-bilinear" else IN_SQUARES
    assert solution.objective == pytest.approx(expected, abs=3e-6)


@pytest.fixture
def solved():
    """A MILP and its solution."""
    problem = problem_of("milp-mccormick")
    model = problem.to_highs()
    model.run()
    return problem, problem.solution(model)


def by_name(problem, solution):
    return dict(zip(problem.to_arrays().column_names.tolist(), solution.point.tolist(), strict=True))


def test_values_alone_come_back_by_order_and_by_name_in_any_order(solved):
    problem, solution = solved
    values = by_name(problem, solution)
    shuffled = dict(reversed(values.items()))
    for answer in (solution.point, solution.point.tolist(), values, shuffled, pd.Series(shuffled)):
        checked = problem.solution(answer)
        assert checked.status == "feasible"
        assert checked.bound is None
        np.testing.assert_array_equal(checked.point, solution.point)


def test_a_status_counts_as_proof_only_with_a_bound_that_closes_the_gap(solved):
    problem, solution = solved
    words = {"optimal-in-gap": "optimal-in-gap", "Optimal": "optimal-local", "time limit": "limit-with-point"}
    for word, status in words.items():
        assert problem.solution(solution.point, status=word).status == status
    near, far = solution.objective - 1e-7, solution.objective - 0.1
    assert problem.solution(solution.point, status="optimal-in-gap", bound=near).status == "optimal-global"
    assert problem.solution(solution.point, status="optimal-in-gap", bound=far).status == "limit-with-point"
    assert problem.solution(solution.point, status="optimal-in-gap", gap=0.0).status == "optimal-global"
    above = problem.solution(solution.point, status="optimal-in-gap", bound=solution.objective + 0.1)
    assert "dual bound" in above.doubt
    assert above.bound is None


def test_claims_of_a_point_that_breaks_the_problem_are_not_kept(solved):
    problem, solution = solved
    wrong = solution.point.copy()
    wrong[problem.integer] += 0.5
    answer = problem.solution(wrong, status="optimal-in-gap", bound=solution.objective)
    assert "its point breaks" in answer.doubt
    assert answer.bound is None
    assert answer.status == "unknown"


def test_values_that_are_no_answer_are_refused(solved):
    problem, solution = solved
    values = by_name(problem, solution)
    first = next(iter(values))
    with pytest.raises(cf.InputError, match=r"give one for each of \d+ columns"):
        problem.solution(solution.point[1:])
    with pytest.raises(cf.SolutionError, match=rf"1 of .* columns .* are missing \({first}"):
        problem.solution({name: value for name, value in values.items() if name != first})
    with pytest.raises(cf.SolutionError, match=f"{first} has no value"):
        problem.solution(values | {first: np.nan})
    with pytest.raises(cf.SolutionError, match=rf"{first} has the value 1e\+09"):
        problem.solution(values | {first: 1e9})
    with pytest.raises(cf.InputError, match=r"cf\.read_solution"):
        problem.solution("answer.sol")
    for thing in (None, {first: "one"}, object()):
        with pytest.raises(cf.InputError, match="values"):
            problem.solution(thing)
    for wrong in ({"gap": -1.0}, {"bound": np.inf}):
        with pytest.raises(cf.InputError, match="out of range"):
            problem.solution(solution.point, **wrong)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_model_of_another_problem_or_without_an_answer_is_refused(package):
    problem, other = problem_of("milp-mccormick"), problem_of("milp-mccormick", "mesh")
    model = getattr(problem, f"to_{package}")()
    with pytest.raises(cf.SolutionError, match="no values yet; solve it with"):
        problem.solution(model)
    stated = solve(package, model)
    for foreign in (other, cf.formulate(grid("/##", 0.1), "milp-mccormick", stroke_norm=1)):
        with pytest.raises(cf.SolutionError):
            foreign.solution(model, **stated)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_model_without_a_solution_says_so(package):
    problem = problem_of("milp-mccormick")
    model = getattr(problem, f"to_{package}")()
    stated = {}
    if package == "pyomo":
        stated = {"status": "infeasible"}
    elif package == "linopy":
        model.add_constraints(model.variables["alpha"].sum() >= 1e3)
        model.solve("highs", io_api="direct", output_flag=False)
    elif package == "highs":
        model.addRow(1e3, np.inf, 1, np.array([0], np.int32), np.array([1.0]))
        model.run()
    else:
        (model.addConstr if package == "gurobi" else model.addCons)(model.getVars()[0] >= 1e3)
        model.optimize()
    solution = problem.solution(model, **stated)
    assert solution.status == "infeasible"
    assert solution.point is None


@pytest.mark.parametrize("package", PACKAGES)
def test_without_the_package_the_error_says_how_to_install_it(package, monkeypatch):
    name = {"highs": "highspy", "gurobi": "gurobipy", "scip": "pyscipopt"}.get(package, package)
    monkeypatch.setitem(sys.modules, name, None)  # as Python marks a package that is not there
    with pytest.raises(cf.MissingSolverError, match=f"pip install {name}"):
        getattr(problem_of("milp-mccormick"), f"to_{package}")()


@pytest.mark.parametrize(
    "package, name",
    [
        ("highs", "miqp-exact"),
        pytest.param("gurobi", "minlp-parity", marks=pytest.mark.needs("gurobi")),
        pytest.param("linopy", "minlp-parity", marks=pytest.mark.needs("linopy")),
    ],
)
def test_what_a_package_cannot_hold_is_refused_with_a_remedy(package, name):
    with pytest.raises(cf.UnsupportedBySolverError, match=r"takes .*, but this is .*; choose"):
        getattr(problem_of(name), f"to_{package}")()
