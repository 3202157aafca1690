"""Programs solve with a starting point, a gap that is enough, and tell their seconds and nodes."""

from __future__ import annotations

import pytest
from cases import make_instance
from crossfield.export.bundle.starts import STARTS
from crossfield.export.solvers_table import PROGRAMS, SOLVERS
from crossfield.export.verify.solve_with import Programs
from crossfield.models.formulations.problem import formulate
from crossfield.models.proof.prove import prove

pytestmark = pytest.mark.oracles
ENOUGH = 1.0
"""A gap, relative to the objective, that every point closes where the bound is not negative."""


@pytest.fixture(scope="module")
def best():
    """The optimum of an instance, as a field."""
    return prove(make_instance("full", w_beta=1.0), norm=1, jobs=1).field


def test_a_solver_that_is_given_the_optimum_has_no_worse_point(best, tmp_path):
    problem = formulate(best.instance, "milp-mccormick")
    optimum = problem.objective_value(problem.point(best))
    with Programs(tmp_path) as programs:
        for solver in STARTS:
            if PROGRAMS[SOLVERS[solver].program].present:
                found = programs.solve(problem, solver, 20.0, gap=ENOUGH, start=best)
                assert found.objective == pytest.approx(optimum, abs=1e-6), solver
                assert found.nodes is not None
                assert found.nodes >= 0
                assert found.seconds is not None
                assert found.seconds > 0


def test_a_gap_that_is_enough_ends_a_solve(best, tmp_path):
    problem, worse = formulate(best.instance, "milp-mccormick"), set()
    with Programs(tmp_path) as programs:
        for solver in ("highs", "cplex", "cbc", "glpk"):
            if PROGRAMS[SOLVERS[solver].program].present:
                first, last = (programs.solve(problem, solver, 60.0, gap=gap) for gap in (ENOUGH, 0.0))
                assert first.objective >= last.objective - 1e-6, solver
                worse |= {solver} if first.objective > last.objective + 1e-3 else set()
    assert "highs" in worse
