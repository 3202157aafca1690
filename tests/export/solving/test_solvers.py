"""Local solvers: right optima, limits, starts, interrupts, and refusals by name."""

import math
import re
import signal
import subprocess
import sys
import textwrap
import time
from dataclasses import replace
from functools import cache

import crossfield as cf
import numpy as np
import pytest
from children import complaints
from crossfield.export.cli.app import invoke
from crossfield.export.cli.tables import tables
from crossfield.export.runs.methods import Request
from crossfield.export.solvers_table import BUNDLED
from crossfield.export.solving.local import choose_solver
from crossfield.export.statuses import Status
from crossfield.models.errors import (
    InputError,
    MissingSolverError,
    SolverError,
    UnsupportedBySolverError,
)
from crossfield.models.formulations.catalogue import FORMULATIONS
from exhaustive import least_absolute, least_squares, random_instance
from folders import contents
from loops import for_each

SOLVED = {Status.OPTIMAL_GLOBAL, Status.OPTIMAL_LOCAL}


def one_pixel(gauge, skew_coefficient):
    mask, theta = np.ones((1, 1), dtype=bool), np.array([2 * np.pi / 3])
    return cf.Instance.on_pixels(
        "pixel", mask, np.array([[0, 0]]), theta, np.ones(1), gauge=gauge, skew_coefficient=skew_coefficient
    )


def formulated(instance, name, *, relax=False):
    """The problem, of orthogonal crosses where the formulation is for these only."""
    recipe = FORMULATIONS[name]
    instance = replace(instance, orthogonal=recipe.orthogonal)
    return cf.formulate(
        instance, name, p=cf.greedy_field(instance).p if recipe.fixed else None, relax=relax or None
    )


# Right optima


@pytest.mark.parametrize("solver", ["highs", "ipopt", "bonmin"])
@pytest.mark.parametrize("gauge", ["box", "strokes"])
def test_one_pixel_has_the_optimum_of_the_hand_calculation(solver, gauge):
    """Stroke at 120 degrees in the box: alpha = pi/2.

    There beta minimises (pi/2 + beta - theta)^2 + skew_coefficient beta^2.
    """
    skew_coefficient = 1e-2
    problem = cf.formulate(one_pixel(gauge, skew_coefficient), "qp-fixed", p=np.zeros(0, int))
    solution = cf.solve(problem, solver)
    misfit = np.pi / 6
    alpha, beta = (np.pi / 2, misfit / (1 + skew_coefficient)) if gauge == "box" else (2 * np.pi / 3, 0.0)
    least = misfit**2 * skew_coefficient / (1 + skew_coefficient) if gauge == "box" else 0.0
    assert solution.status in SOLVED
    assert solution.objective == pytest.approx(least, abs=2e-8)
    assert solution.field.alpha[0] + solution.field.beta[0] == pytest.approx(alpha + beta, abs=1e-4)
    assert solution.field.alpha[0] == pytest.approx(alpha, abs=1e-4)


@pytest.mark.parametrize(
    "name,solver", [("milp-mccormick", "highs"), ("milp-mccormick", "bonmin"), ("miqp-exact", "bonmin")]
)
def test_two_pixels_with_exchanged_lines_meet_with_jump_one(name, solver):
    """Strokes at b and pi/2 - b, each on line u: one cross in two labels, (0, b) and (pi/2, -b)."""
    b = 0.3
    mask, pixels = np.ones((1, 2), dtype=bool), np.array([[0, 0], [0, 1]])
    instance = cf.Instance.on_pixels(
        "pair", mask, pixels, np.array([b, np.pi / 2 - b]), np.ones(2), gauge="box", skew_coefficient=0
    )
    solution = cf.solve(cf.formulate(instance, name), solver)
    assert solution.objective == pytest.approx(0, abs=1e-6)
    assert solution.field.p.tolist() == [1]
    assert solution.field.alpha == pytest.approx([0, np.pi / 2], abs=2e-3)
    assert solution.field.beta == pytest.approx([b, -b], abs=2e-3)


@pytest.mark.parametrize(
    "seed", [1, pytest.param(2, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("gauge", ["box", "strokes"])
def test_the_milp_has_the_optimum_of_the_enumeration(seed, gauge):
    instance = random_instance(seed, (2, 2), 4, gauge)
    expected = least_absolute(instance)
    assert expected > 1e-3
    solution = cf.solve(cf.formulate(instance, "milp-mccormick"), "highs")
    assert solution.status == Status.OPTIMAL_GLOBAL
    assert solution.objective == pytest.approx(expected, abs=2e-6)
    assert solution.reported == pytest.approx(solution.objective, abs=1e-9)
    assert solution.bound <= solution.objective + 1e-9
    assert solution.field.energy(1).total == pytest.approx(expected, abs=2e-6)


@pytest.mark.parametrize("seed", [1, 4])
@pytest.mark.parametrize("gauge", ["box", "strokes"])
def test_the_exact_miqp_has_the_optimum_of_the_enumeration(seed, gauge):
    instance = random_instance(seed, (2, 2), 4, gauge)
    expected = least_squares(instance)
    assert expected > 1e-3
    solution = cf.solve(cf.formulate(instance, "miqp-exact"), "bonmin")
    assert solution.objective == pytest.approx(expected, abs=2e-5)
    assert solution.field.energy(2).total == pytest.approx(expected, abs=2e-5)
    assert solution.violation.worst < 1e-6


# The table of solvers and classes


SMALL = random_instance(1, (2, 2), 4)


@pytest.fixture
def small():
    return SMALL


def split(label):
    return label.removesuffix(", relaxed"), label.endswith(", relaxed")


PAIRS = [(row["formulation"], solver, row[solver]) for row in tables()["solvers"] for solver in BUNDLED]
DONE = [(label, solver) for label, solver, answer in PAIRS if answer == "yes"]
REFUSED = [(label, solver, answer) for label, solver, answer in PAIRS if answer != "yes"]


@cache
def solution_of(label, solver):
    name, relax = split(label)
    problem = formulated(SMALL, name, relax=relax)
    return cf.solve(problem, solver, start=cf.greedy_field(problem.instance), limits=cf.Limits(250))


@pytest.mark.slow
@pytest.mark.parametrize("label,solver", DONE)
def test_every_pair_of_the_table_is_solved(label, solver):
    solution = solution_of(label, solver)
    problem = solution.problem
    assert solution.status in SOLVED
    assert solution.violation.worst < 1e-6
    assert (
        solution.objective <= problem.objective_value(problem.point(cf.greedy_field(problem.instance))) + 1e-6
    )
    if problem.is_convex:
        everyone = [solution_of(label, other).objective for label_, other in DONE if label_ == label]
        assert everyone == pytest.approx([solution.objective] * len(everyone), abs=2e-5)


@for_each("label,solver,reason", REFUSED)
def test_every_other_pair_is_refused_by_name(small, tmp_path, label, solver, reason):
    name, relax = split(label)
    folder = tmp_path / "out"
    with pytest.raises(UnsupportedBySolverError) as caught:
        cf.solve(formulated(small, name, relax=relax), solver, folder=folder)
    assert reason in str(caught.value)
    assert name in str(caught.value)
    assert solver in str(caught.value)
    assert not folder.exists()


def test_the_preferred_solver_fits_the_class(small):
    preferred = {
        "milp-mccormick": "highs",
        "qp-fixed": "ipopt",
        "miqp-exact": "bonmin",
        "miqp-mccormick": "bonmin",
    }
    for name, solver in preferred.items():
        assert choose_solver(formulated(small, name)).name == solver
    assert choose_solver(formulated(small, "miqcp-bilinear", relax=True)).name == "ipopt"
    for name in ("minlp-parity", "minlp-cubic", "miqcp-bilinear"):
        with pytest.raises(UnsupportedBySolverError, match="crossfield list"):
            choose_solver(formulated(small, name))
    with pytest.raises(InputError, match=r"choose one of gurobi, cplex, .*highs"):
        choose_solver(formulated(small, "qp-fixed"), "HiGHS")


def test_a_missing_package_is_a_named_error(small, monkeypatch):
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(MissingSolverError, match="Ipopt is not installed; pip install casadi"):
        choose_solver(formulated(small, "qp-fixed"))
    assert choose_solver(formulated(small, "milp-mccormick")).name == "highs"


@pytest.mark.parametrize("name", ["milp-mccormick", "miqp-exact", "miqp-mccormick"])
def test_a_convex_relaxation_bounds_the_optimum(name):
    relaxed = solution_of(f"{name}, relaxed", "ipopt").objective
    solved = solution_of(name, "bonmin").objective
    assert relaxed <= solved + 1e-6
    assert relaxed < 0.9 * solved  # the facets alone do not say much


# Limits, gaps, threads, starts


@pytest.fixture(scope="module")
def hard():
    """An instance that no solver here proves in seconds."""
    return cf.sample("mouse", 10)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name,solver", [("milp-mccormick", "highs"), ("miqp-exact", "bonmin"), ("milp-mccormick", "bonmin")]
)
def test_a_time_limit_ends_with_the_incumbent(hard, name, solver):
    """No solver proves it in hours, and all take the start at once: three seconds are as good as thirty."""
    problem, start = cf.formulate(hard, name), cf.greedy_field(hard)
    solution = cf.solve(problem, solver, start=start, limits=cf.Limits(3))
    assert solution.status == Status.LIMIT_WITH_POINT
    assert solution.objective <= problem.objective_value(problem.point(start)) + 1e-9
    assert solution.violation.worst < 1e-6
    assert not solution.interrupted


def run_in_children(program, folder, monkeypatch):
    """Let children of this process run the program when they start, with highspy available."""
    (folder / "sitecustomize.py").write_text("import highspy\n" + textwrap.dedent(program))
    monkeypatch.setenv("PYTHONPATH", str(folder))


def test_a_claim_that_its_point_contradicts_is_no_answer(tmp_path, monkeypatch, capsys):
    """HiGHS reports an optimum for a point that is not feasible."""
    run_in_children(
        """
        import pathlib, re
        write = highspy.Highs.writeSolution
        def moved(self, path, style):
            status, file = write(self, path, style), pathlib.Path(path)
            file.write_text(re.sub(r"(?m)^alpha_00_01 .*$", "alpha_00_01 9", file.read_text()))
            return status
        highspy.Highs.writeSolution = moved
        """,
        tmp_path,
        monkeypatch,
    )
    files = tmp_path / "files"
    assert invoke(["solve", "skew", "--size", "4", "-f", "milp-mccormick", "-o", str(files), "--quiet"]) == 1
    assert "claims optimal-in-gap, but" in capsys.readouterr().err
    assert not list(files.glob("*.field.npz"))


def test_highs_is_ended_at_its_deadline_and_the_start_kept(tmp_path, monkeypatch):
    """A HiGHS that ignores the clock: the parent ends it, and the start is the answer."""
    instance = cf.sample("mouse", 8)
    start = cf.greedy_field(instance)
    run_in_children(
        """
        import signal, time
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal = lambda *_: None
        highspy.Highs.startSolve = lambda self: print("in", flush=True) or time.sleep(600)
        """,
        tmp_path,
        monkeypatch,
    )
    problem = cf.formulate(instance, "milp-mccormick")
    solution = cf.solve(problem, "highs", folder=tmp_path / "files", limits=cf.Limits(2.0), start=start)
    assert solution.status == Status.LIMIT_WITH_POINT
    assert solution.objective == pytest.approx(problem.objective_value(problem.point(start)), rel=1e-12)
    assert not list((tmp_path / "files").glob("*.start"))


@pytest.mark.slow
def test_highs_hears_the_interrupt_at_its_deadline_in_the_background_too(tmp_path, monkeypatch):
    """Ctrl-C is ignored, as in a shell's background; this HiGHS continues until a request to end."""
    run_in_children(
        """
        import os, time
        highspy.Highs.startSolve = lambda self: None
        highspy.Highs.wait = lambda self, seconds: (bool(time.sleep(seconds)), None)
        highspy.Highs.cancelSolve = lambda self: print("asked to end", flush=True) or os.kill(os.getpid(), 9)
        """,
        tmp_path,
        monkeypatch,
    )
    problem, files = cf.formulate(cf.sample("mouse", 8), "milp-mccormick"), tmp_path / "files"
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        solution = cf.solve(
            problem, "highs", folder=files, limits=cf.Limits(2.0), start=cf.greedy_field(problem.instance)
        )
    finally:
        signal.signal(signal.SIGINT, before)
    assert solution.status == Status.LIMIT_WITH_POINT
    assert "asked to end" in next(files.glob("*.log")).read_text()


def test_highs_takes_the_start_as_incumbent_and_a_wide_gap_ends_its_search(tmp_path, hard):
    problem, start = cf.formulate(hard, "milp-mccormick"), cf.greedy_field(hard)
    limits = cf.Limits(300, gap=0.97)
    solution = cf.solve(problem, "highs", folder=tmp_path, start=start, limits=limits)
    log = (tmp_path / "mouse.milp-mccormick.highs.log").read_text()
    claimed = re.search(r"MIP start solution is feasible[,:] objective value is (\S+)", log)
    assert float(claimed[1]) == pytest.approx(problem.objective_value(problem.point(start)), rel=1e-9)
    assert (solution.claimed, solution.status) == (Status.OPTIMAL_IN_GAP, Status.LIMIT_WITH_POINT)
    assert solution.bound < 0.9 * solution.objective
    assert solution.objective - solution.bound <= 0.97 * solution.objective + 1e-9


@pytest.mark.parametrize(
    "limits",
    [
        {"time_limit": 0},
        {"time_limit": float("nan")},
        {"gap": -1},
        {"threads": -1},
        {"threads": 100000},
    ],
)
def test_impossible_limits_are_refused(limits):
    with pytest.raises(InputError, match=r"out of range|must be between"):
        cf.Limits(**limits)


def test_only_a_search_and_a_proof_go_without_a_time_limit(tmp_path):
    endless, instance = cf.Limits(math.inf), cf.sample("skew", 4)
    for work in (
        lambda: cf.solve(cf.formulate(instance, "milp-mccormick"), limits=endless),
        lambda: cf.run(instance, tmp_path, limits=endless),
        lambda: Request(instance, tmp_path, endless),
    ):
        with pytest.raises(InputError, match="needs a finite time limit"):
            work()
    assert list(tmp_path.iterdir()) == []


def test_what_is_solved_is_the_file(tmp_path, small):
    """Another bound in the file would show: the solvers see nothing else."""
    problem = formulated(small, "qp-fixed")
    solution = cf.solve(problem, "ipopt", folder=tmp_path)
    stem = tmp_path / "random.qp-fixed"
    assert {name.removeprefix(stem.name) for name in contents(tmp_path) if "instance" not in name} == {
        ".nl", ".row", ".col", ".manifest.json", ".ipopt.sol", ".ipopt.log",
    }  # fmt: skip
    again = cf.read_solution(f"{stem}.ipopt.sol", problem)
    assert again.point.tolist() == solution.point.tolist()


# What goes wrong


def test_a_crashed_solver_is_said_and_no_stale_answer_taken(tmp_path, small, monkeypatch):
    problem = formulated(small, "qp-fixed")
    cf.solve(problem, "ipopt", folder=tmp_path)
    earlier = contents(tmp_path)
    assert "random.qp-fixed.ipopt.sol" in earlier
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "casadi.py").write_text("raise ImportError('libgfortran is gone')")
    monkeypatch.setenv("PYTHONPATH", str(broken))
    with pytest.raises(SolverError, match=r"random\.qp-fixed\.nl: Ipopt: ImportError: libgfortran is gone"):
        cf.solve(problem, "ipopt", folder=tmp_path)
    assert {name: data for name, data in contents(tmp_path).items() if "broken" not in name} == earlier


# Ctrl-C, as a signal to a real command line


def interrupted(folder, log, arguments, words, *, number=signal.SIGINT):
    """Exit code, output and complaints of a command that is interrupted once its log has the words."""
    command = [sys.executable, "-m", "crossfield", *map(str, arguments), "-o", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        while not any(re.search(words, path.read_text(), re.MULTILINE) for path in folder.rglob(log)):
            assert process.poll() is None, process.communicate()
            time.sleep(0.05)
        process.send_signal(number)
        out, err = process.communicate()
    return process.returncode, out, complaints(err)


CTRL_C = {
    "highs": ["solve", "mouse", "-f", "milp-mccormick"],
    "ipopt": ["solve", "mouse", "-f", "miqcp-bilinear", "--relax", "--size", "64"],
    "bonmin": ["solve", "mouse", "-f", "miqp-exact", "--size", "12"],
}
AT_WORK = {"highs": "MIP start solution is feasible", "ipopt": "^iter +objective", "bonmin": "NLP0014I"}
"""Text in the log of each solver once it is solving."""


@pytest.mark.slow
@pytest.mark.parametrize("solver", CTRL_C)
def test_ctrl_c_keeps_the_best_point(tmp_path, solver):
    name = CTRL_C[solver][3]
    code, out, err = interrupted(tmp_path, f"*.{solver}.log", [*CTRL_C[solver], "--json"], AT_WORK[solver])
    assert (code, err) == (0, "crossfield: interrupted; the best point so far was kept\n")
    field = cf.read_field(tmp_path / f"mouse.{name}.field.npz")
    assert '"interrupted": true' in out
    assert f'"energy_2_norm": {field.energy(2).total!r}' in out
    if solver != "ipopt":
        assert (
            field.energy(1 if solver == "highs" else 2).total
            <= cf.greedy_field(field.instance).energy(1 if solver == "highs" else 2).total + 1e-9
        )
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.slow
@pytest.mark.parametrize("threads, first", [("1", "two-stage"), ("2", "search")])
def test_ctrl_c_during_the_milp_of_a_run_goes_on_with_its_best_point(tmp_path, threads, first):
    """With one thread the MILP comes before the search, with more they run in parallel."""
    command = ["run", "mouse", "--size", "14", "--time-limit", "10", "--threads", threads]
    code, out, err = interrupted(tmp_path, "*.highs.log", command, AT_WORK["highs"])
    assert code == 0
    assert "MILP: interrupted; its best field so far was kept" in err
    assert "two-stage" in out
    assert f"interrupted: {first}; report.json lists the results so far" in err
    assert (tmp_path / "report.json").exists()
