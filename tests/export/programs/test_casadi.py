"""Result of Ipopt when it is stopped: the best feasible point that it has found."""

import signal
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.programs.casadi import FEASIBILITY, IterateWatch, ca, read_nl
from crossfield.export.programs.casadi import solve_model as solve
from crossfield.export.programs.protocol import RefusedError
from crossfield.export.writing.nl_order import NlOrder
from crossfield.models.processes import child_program


@pytest.fixture
def relaxed(tmp_path):
    """A relaxed problem with rows, its model with the greedy field as start, and the order of its columns."""
    problem = cf.formulate(cf.sample("skew", 6), "miqcp-bilinear", relax=True)
    cf.write(problem, tmp_path / "model.nl", start=cf.greedy_field(problem.instance))
    return problem, read_nl(tmp_path / "model.nl"), NlOrder(problem).order


@pytest.fixture
def own_interrupt():
    """The driver takes over SIGINT; restore it."""
    before = signal.getsignal(signal.SIGINT)
    yield
    signal.signal(signal.SIGINT, before)


def test_only_feasible_points_that_are_lower_are_kept(relaxed):
    problem, model, order = relaxed
    watch = IterateWatch(model)
    assert watch.value == pytest.approx(
        problem.objective_value(problem.point(cf.greedy_field(problem.instance)))
    )

    def seen(point):
        value, rows = model.evaluate(point)
        outputs = {"x": point, "f": value, "g": rows}
        multipliers = [np.zeros(watch.sizes[name]) for name in list(watch.sizes)[3:]]
        assert watch.eval([ca.DM(column) for column in (*outputs.values(), *multipliers)]) == [0]
        return watch.value

    lower = problem.point(cf.power_field(problem.instance))
    worse, broken = problem.point(cf.greedy_field(problem.instance)), lower.copy()
    worse[problem.blocks["s"].slice] += 0.1
    broken[problem.blocks["s"].slice] -= 10 * FEASIBILITY
    start = watch.value
    assert seen(worse[order]) == seen(broken[order]) == start
    assert seen(lower[order]) == pytest.approx(problem.objective_value(lower))
    assert watch.value < start
    child_program.ask_to_stop()
    try:
        assert watch.eval([ca.DM(np.zeros(size)) for size in watch.sizes.values()]) == [1]
    finally:
        child_program.forget_stops()


def test_a_stop_at_an_iterate_that_breaks_rows_leaves_the_start(relaxed, own_interrupt):
    """At its first iterate Ipopt has moved the start away from its bounds, and rows are broken."""
    _, model, _ = relaxed
    answer = solve("ipopt", model, 1e-9, 0.0)
    assert answer.code == 400
    assert "the best feasible point before it" in answer.words
    assert np.array_equal(answer.point, model.start)


@pytest.mark.parametrize("solver, title", [("ipopt", "Ipopt"), ("bonmin", "Bonmin")])
def test_an_error_inside_a_solver_is_told_without_places_in_its_source(solver, title, relaxed, own_interrupt):
    _, model, _ = relaxed
    crossed = replace(model, lower=model.upper + 1.0)
    with pytest.raises(
        RefusedError, match=rf"^{title} ended with an error, 'LBX\[0\] <= UBX\[0\] was violated"
    ):
        solve(solver, crossed, 1.0, 0.0)
