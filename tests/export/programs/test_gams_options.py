"""What GAMS and its solvers are given, which needs neither of them: the licence of the free edition ends."""

import pytest
from crossfield.export.programs import gams


@pytest.mark.parametrize(
    "solver, line", [("cplex", "epgap 0.001"), ("baron", "EpsR 0.001")], ids=["cplex", "baron"]
)
def test_the_gap_of_a_solve_replaces_the_gap_in_the_model(solver, line):
    """The statement `option optcr` in a model overrides the command line, and an option file both."""
    assert line in gams.option_file(solver, 1e-3).splitlines()
    assert set(gams.option_file(solver).splitlines()) == set(gams.option_file(solver, 1e-3).splitlines()) - {
        line
    }
