"""Tiny odd instances through export, solve and read: every formulation, with all bundled solvers."""

from collections import Counter

import crossfield as cf
import pytest
from cases import SKEWED
from crossfield.export.solvers_table import suitability_in_format
from crossfield.export.solving.local import SolveFiles, Solvers
from crossfield.export.statuses import Status
from crossfield.export.verify.leeway import objective_leeway
from crossfield.models.errors import SolutionError, SolverError, UnsupportedByFormatError
from crossfield.models.formulations.catalogue import FORMULATIONS, norm_of
from crossfield.models.processes.deadline import Deadline
from crossfield.models.search.angle_program import fit_absolute
from crossfield.models.search.box_qp import fit_in_box
from odd_instances import odd_instance

BUNDLED = {"highs": ("lp", "mps"), "ipopt": ("nl",), "bonmin": ("nl",)}
OPTIMAL = {Status.OPTIMAL_GLOBAL, Status.OPTIMAL_LOCAL}
SECONDS = 2.0
CLOSE = 1e-4
DIGITS = 1e-9  # of the greatest weight: Ipopt scales the objective by it, and then its tolerance


@pytest.fixture(scope="module")
def solvers():
    with Solvers() as solvers:
        yield solvers


def answers(problem, solvers, folder, only=tuple(BUNDLED)):
    """The answers of the solvers that take a problem, by solver and format; None where they fail honestly."""
    solutions = {}
    for solver, form in [(name, form) for name in only for form in BUNDLED[name]]:
        taking = suitability_in_format(problem, solver, form).answer
        if taking != "yes" and (taking, solver) != ("local", "ipopt"):
            continue
        try:
            held = cf.write(problem, folder / f"{solver}.{form}").problem
        except UnsupportedByFormatError as error:
            if "readers drop or refuse values" not in str(error):  # a weight is too small for files
                raise
            solutions[solver, form] = None
            continue
        files = SolveFiles.for_model(folder / f"{solver}.{form}", solver)
        limits = cf.Limits(SECONDS, gap=0.0)
        try:
            solution = solvers.solve_file(held, solver, files, limits, Deadline.after(10 * SECONDS))
        except SolverError as error:
            if "ended with an error" not in str(error):  # Bonmin, with great weights
                raise
            solutions[solver, form] = None
            continue
        except SolutionError as error:
            weights = problem.instance.stroke_coefficient, problem.instance.skew_coefficient
            # Without a cost, a column that is bounded from one side only may go to infinity.
            if min(weights) > 0 or "no column" not in str(error):
                raise
            solutions[solver, form] = None
            continue
        again = cf.read_solution(files.solution, held)
        if again.status == "optimal-in-gap":  # the file does not state the gap of the limits
            again = cf.read_solution(files.solution, held, stated_gap=0.0)
        assert (again.status, again.objective) == (solution.status, solution.objective)
        assert_consistent(held, solution)
        solutions[solver, form] = solution
    return solutions


def assert_consistent(held, solution):
    """The claims of an answer do not contradict its point; a feasible problem is not called another."""
    assert solution.identified
    assert solution.status not in {Status.INFEASIBLE, Status.UNBOUNDED}
    assert solution.contradictions == ()
    if solution.point is None:
        assert solution.status not in OPTIMAL
        return
    objective = held.objective_value(solution.point)
    assert solution.objective == objective
    size = max(1.0, abs(objective))
    assert solution.reported is None or abs(solution.reported - objective) <= 1e-5 * size
    assert (
        solution.bound is None
        or solution.bound <= objective + objective_leeway(held, solution.point) + CLOSE * size
    )


def optima(solutions):
    """Objectives of optimal answers, each with the greatest amount that its broken rows saved."""
    points = [
        solution for solution in solutions.values() if solution is not None and solution.status in OPTIMAL
    ]
    return [(solution.objective, objective_leeway(solution.problem, solution.point)) for solution in points]


def assert_equal_optima(instance, values, least=None):
    """All optima agree, and with the least energy if it is known."""
    scaled = DIGITS * max(instance.stroke_coefficient, instance.skew_coefficient)
    for value, low in values:
        other, high = (least, 0.0) if least is not None else values[0]
        assert abs(value - other) <= CLOSE * max(1.0, abs(other)) + scaled + low + high, values


def assert_answers_of(seed, solvers, folder):
    """Solve one formulation with all solvers, and all formulations of its norm at the jumps of a field."""
    instance = odd_instance(seed)
    field, name = cf.greedy_field(instance), SKEWED[seed % len(SKEWED)]
    count = Counter()
    if FORMULATIONS[name].fixed:
        problems = [cf.formulate(instance, name, p=field.p)]
    else:
        problems = [cf.formulate(instance, name), cf.formulate(instance, name, relax=True)]
    for problem in problems:
        solutions = answers(problem, solvers, folder)
        if problem.is_convex or not problem.formulation.options.relax:
            assert_equal_optima(instance, optima(solutions))
        count.update((problem.name, *key) for key, solution in solutions.items() if solution is not None)
    norm = norm_of(problems[0].formulation.declaration, problems[0].formulation.options)
    if norm is None:
        return count
    best = fit_in_box(field) if norm == 2 else fit_absolute(field, norm)[0]
    for other in SKEWED:
        problem = cf.formulate(instance, other, p=field.p if FORMULATIONS[other].fixed else None)
        if norm_of(problem.formulation.declaration, problem.formulation.options) == norm:
            pinned = problem if FORMULATIONS[other].fixed else cf.with_integers_fixed(problem, field)
            solutions = answers(pinned, solvers, folder, only=("ipopt",))
            assert_equal_optima(instance, optima(solutions), best.energy(norm).total)
            count.update((other, "at jumps") for solution in solutions.values() if solution is not None)
    return count


def test_some_odd_instances_are_exported_solved_and_read(solvers, tmp_path):
    count = sum((assert_answers_of(seed, solvers, tmp_path) for seed in range(len(SKEWED))), Counter())
    assert {name for name, *_ in count} == set(SKEWED)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(2))
def test_odd_instances_are_exported_solved_and_read(block, solvers, tmp_path):
    first = len(SKEWED) + 50 * block
    count = sum((assert_answers_of(seed, solvers, tmp_path) for seed in range(first, first + 50)), Counter())
    assert {name for name, *_ in count} == set(SKEWED)
    assert {solver for _, solver, *_ in count} == {*BUNDLED, "at jumps"}
