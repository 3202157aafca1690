"""What GAMS is given and what its output means, which needs no licence: that of the free edition ends."""

import pytest
from crossfield.export.programs import gams
from crossfield.export.statuses import Status, status_of_gams


@pytest.mark.parametrize(
    "solver, line", [("cplex", "epgap 0.001"), ("baron", "EpsR 0.001")], ids=["cplex", "baron"]
)
def test_the_gap_of_a_solve_replaces_the_gap_in_the_model(solver, line):
    """The statement `option optcr` in a model overrides the command line, and an option file both."""
    assert line in gams.option_file(solver, 1e-3).splitlines()
    assert set(gams.option_file(solver).splitlines()) == set(gams.option_file(solver, 1e-3).splitlines()) - {
        line
    }


OUTPUT = """**** SOLVER STATUS     {solver}
**** MODEL STATUS      {model}
**** OBJECTIVE VALUE                1.0000
Best possible = {bound}
"""


@pytest.mark.parametrize(
    "model, solver, bound, status",
    [
        (1, 1, 1.0, Status.OPTIMAL_IN_GAP),
        (5, 1, 0.5, Status.LIMIT_WITHOUT_POINT),  # locally infeasible: nothing is proven
        (14, 3, 0.5, Status.LIMIT_WITHOUT_POINT),  # no solution returned at the time limit
        (8, 1, 0.5, Status.OPTIMAL_IN_GAP),  # an integer solution at the gap that the solver was given
        (13, 10, 0.5, Status.ERROR),
    ],
)
def test_the_states_of_gams_have_one_meaning(model, solver, bound, status):
    """The driver keeps the bound with every status, and the reader of answers has the same table."""
    outcome = gams.outcome_of(OUTPUT.format(model=model, solver=solver, bound=bound))
    assert (outcome.status, outcome.bound) == (status, bound)
    assert status_of_gams(model, solver)[0] is status
