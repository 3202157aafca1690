"""Solves without time, shares of limits, and the modules that a solver's child process loads."""

import threading

import crossfield as cf
import pytest
from crossfield.export.programs.protocol import part_path
from crossfield.export.solving.local import Solvers
from crossfield.export.statuses import Status
from crossfield.models.processes.child import Child, KilledError


@pytest.mark.parametrize("name", ["qp-fixed", "milp-mccormick"])
def test_without_time_the_start_is_the_answer(tmp_path, name):
    """No solver is started then; a feasible start is the best point so far."""
    instance = cf.sample("skew", 6)
    start = cf.greedy_field(instance)
    problem = cf.formulate(instance, name, p=start.p if name == "qp-fixed" else None)
    solution = cf.solve(problem, folder=tmp_path, start=start, limits=cf.Limits(1e-6))
    assert solution.status == Status.LIMIT_WITH_POINT
    assert "nothing better than the start" in solution.message
    norm = 1 if name == "milp-mccormick" else 2
    assert solution.objective == pytest.approx(start.energy(norm).total, rel=1e-9)
    assert solution.bound is None
    assert not list(tmp_path.glob("*.log"))
    assert cf.solve(problem, limits=cf.Limits(1e-6)).status == Status.LIMIT_WITHOUT_POINT


class KilledAfterItsCall(Child):
    """A child whose work is done, its files written, when the parent kills it; `spoil` changes the files."""

    spoil = staticmethod(lambda _job: None)

    def call(self, work, program, step, job, **options):
        super().call(work, program, step, job, **options)
        self.spoil(job)
        raise KilledError("did not end in time")


class KilledSolvers(Solvers):
    def child(self, program):
        if program not in self._children:
            self._children[program] = self._stack.enter_context(KilledAfterItsCall(self._folder))
        return self._children[program]


@pytest.fixture
def skew():
    """A problem and a start."""
    start = cf.greedy_field(cf.sample("skew", 4))
    return cf.formulate(start.instance, "milp-mccormick"), start


@pytest.mark.slow
def test_a_complete_answer_of_a_killed_solver_counts(tmp_path, skew):
    """The file of HiGHS states an optimum, within the gap that it was given."""
    problem, _ = skew
    with KilledSolvers() as solvers:
        solution = solvers.solve(problem, "highs", folder=tmp_path, limits=cf.Limits(60.0))
    assert (solution.claimed, solution.doubt) == (Status.OPTIMAL_IN_GAP, "")
    assert solution.objective == pytest.approx(cf.solve(problem).objective, abs=1e-6)


def test_a_cut_answer_of_a_killed_solver_is_not_read(tmp_path, skew):
    problem, start = skew

    def cut(job):
        job.solution.replace(part_path(job.solution))

    with KilledSolvers() as solvers:
        solvers.child("highs").spoil = cut
        solution = solvers.solve(problem, "highs", folder=tmp_path, limits=cf.Limits(60.0))
        assert (solution.status, solution.point) == (Status.LIMIT_WITHOUT_POINT, None)
        assert not list(tmp_path.glob("*.sol")) + list(tmp_path.glob(".part*"))
        solution = solvers.solve(problem, "highs", folder=tmp_path, limits=cf.Limits(60.0), start=start)
    assert (solution.status, solution.start_returned) == (Status.LIMIT_WITH_POINT, True)
    assert not list(tmp_path.glob(".part*"))


def test_a_time_limit_does_not_keep_highs_from_reading_a_file(tmp_path):
    """HiGHS ends the reading of an MPS file at its time limit, with the error of an unreadable file."""
    from crossfield.export.programs.highs import load_model

    problem = cf.formulate(cf.sample("mouse", 24), "milp-mccormick")
    cf.write(problem, tmp_path / "model.mps")
    assert load_model(tmp_path / "model.mps", time_limit=1e-4).getNumCol() == problem.n_columns + 1


def test_an_event_ends_a_solve_with_its_best_point(tmp_path):
    """HiGHS does not close the gap of this problem within minutes."""
    start, asked = cf.greedy_field(cf.sample("bottle", 12)), threading.Event()
    problem = cf.formulate(start.instance, "milp-mccormick")
    asked.set()
    solution = cf.solve(problem, "highs", folder=tmp_path, limits=cf.Limits(600.0), start=start, stop=asked)
    assert solution.interrupted
    assert solution.objective <= problem.objective_value(problem.point(start)) + 1e-6
    assert solution.field.instance.sha256 == start.instance.sha256


@pytest.mark.needs("cbc")
def test_an_event_at_the_start_of_an_executable_is_no_error_of_it(tmp_path):
    """An interrupt ends CBC and GLPK with an error while they read a file."""
    start, asked = cf.greedy_field(cf.sample("bottle", 12)), threading.Event()
    problem = cf.formulate(start.instance, "milp-mccormick")
    asked.set()
    solution = cf.solve(problem, "cbc", folder=tmp_path, limits=cf.Limits(600.0), start=start, stop=asked)
    assert solution.interrupted
    assert (solution.status, solution.doubt) == (Status.LIMIT_WITH_POINT, "")


def test_an_event_ends_a_run_with_the_fields_so_far(tmp_path):
    asked = threading.Event()

    def progress(line):
        if line.startswith("PolyVector"):
            asked.set()

    report = cf.run(cf.sample("skew", 4), tmp_path, limits=cf.Limits(600.0), progress=progress, stop=asked)
    assert repr(report).startswith("<Report on skew: ")
    assert report.interrupted == "polyvector"
    assert report.field is report.kept.field
    first = {"start", "greedy", "power", "power + QP", "polyvector"}
    assert {candidate.method for candidate in report.candidates} <= first
    assert (tmp_path / "field.npz").exists()
    assert not (tmp_path / "overview.png").exists()
