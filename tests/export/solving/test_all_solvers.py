"""Every solver takes a starting point and a gap, and reports seconds and nodes."""

from __future__ import annotations

import crossfield as cf
import pytest
from cases import make_instance
from crossfield.export.bundle.starts import STARTS
from crossfield.export.solvers_table import PROGRAMS, SOLVERS
from crossfield.export.solving.local import Solvers

pytestmark = pytest.mark.oracles
ENOUGH = 1.0
"""A gap, relative to the objective, that every point closes where the bound is not negative."""


@pytest.fixture(scope="module")
def best():
    """The optimum of an instance, as a field."""
    return cf.prove(make_instance("full", skew_coefficient=1.0), norm=1, jobs=1).field


def test_a_solver_that_is_given_the_optimum_has_no_worse_point(best):
    problem = cf.formulate(best.instance, "milp-mccormick")
    optimum = problem.objective_value(problem.point(best))
    with Solvers() as solvers:
        for solver in STARTS:
            if not PROGRAMS[SOLVERS[solver].program].missing:
                solution = solvers.solve(problem, solver, limits=cf.Limits(20.0, ENOUGH, 1), start=best)
                assert solution.objective == pytest.approx(optimum, abs=1e-6), solver
                assert solution.nodes is not None
                assert solution.nodes >= 0
                assert solution.seconds is not None
                assert solution.seconds > 0
