"""Local solvers: right optima, limits, starts, interrupts, and refusals by name."""

import math
import re
import signal
import subprocess
import sys
import textwrap
import time
from dataclasses import replace

import crossfield as cf
import pytest
from cases import make_instance
from children import complaints
from command_line import invoke
from crossfield.export.solving.local import choose_solver
from crossfield.export.statuses import Status
from crossfield.models.formulations.catalogue import FORMULATIONS
from exhaustive import random_instance
from folders import contents
from independent_energy import Formulas


def formulated(instance, name, *, relax=False):
    """The problem, of orthogonal crosses where the formulation is for these only."""
    recipe = FORMULATIONS[name]
    instance = replace(instance, orthogonal=recipe.orthogonal)
    jumps = cf.greedy_field(instance).p if recipe.fixed else None
    return cf.formulate(instance, name, p=jumps, relax=relax or None)


# Right optima


@pytest.mark.parametrize("gauge", ["box", "strokes"])
def test_the_exact_miqp_has_the_optimum_of_the_enumeration(gauge):
    instance = random_instance(1, (2, 2), 4, gauge)
    expected = Formulas(instance).least(2, 256)
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
        with pytest.raises(cf.UnsupportedBySolverError, match="crossfield list"):
            choose_solver(formulated(small, name))
    with pytest.raises(cf.InputError, match=r"choose one of gurobi, cplex, .*highs"):
        choose_solver(formulated(small, "qp-fixed"), "HiGHS")


def test_a_missing_package_is_a_named_error(small, monkeypatch):
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(cf.MissingSolverError, match="Ipopt is not installed; pip install casadi"):
        choose_solver(formulated(small, "qp-fixed"))
    assert choose_solver(formulated(small, "milp-mccormick")).name == "highs"


# Limits, gaps, threads, starts


@pytest.fixture(scope="module")
def hard():
    """An instance that no solver here proves in seconds."""
    return cf.sample("mouse", 10)


@pytest.mark.slow
@pytest.mark.parametrize("name,solver", [("milp-mccormick", "highs"), ("miqp-exact", "bonmin")])
def test_a_time_limit_ends_with_the_incumbent(hard, name, solver):
    """No solver proves it in hours, and all take the start at once: two seconds are as good as thirty."""
    problem, start = cf.formulate(hard, name), cf.greedy_field(hard)
    solution = cf.solve(problem, solver, start=start, limits=cf.Limits(2))
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
    assert invoke(["solve", "skew", "--size", "4", "-f", "milp-mccormick", "-o", str(files)]) == 1
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


@pytest.mark.oracles
def test_a_solver_that_is_given_the_optimum_has_no_worse_point():
    best = cf.prove(make_instance("full", skew_coefficient=1.0), norm=1, jobs=1).field
    # any point closes a relative gap of 1
    problem = cf.formulate(best.instance, "milp-mccormick")
    optimum = problem.objective_value(problem.point(best))
    for solver in ("highs", "gurobi", "cplex", "xpress", "scip"):
        try:
            solution = cf.solve(problem, solver, limits=cf.Limits(20.0, 1.0, 1), start=best)
        except cf.MissingSolverError:
            continue
        assert solution.objective == pytest.approx(optimum, abs=1e-6), solver
        assert solution.nodes >= 0
        assert solution.seconds > 0


def test_only_a_search_and_a_proof_go_without_a_time_limit(tmp_path):
    endless, instance = cf.Limits(math.inf), cf.sample("skew", 4)
    with pytest.raises(cf.InputError, match="needs a finite time limit"):
        cf.solve(cf.formulate(instance, "milp-mccormick"), limits=endless)
    with pytest.raises(cf.InputError, match="needs a finite time limit"):
        cf.run(instance, tmp_path, limits=endless)
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
    with pytest.raises(
        cf.SolverError, match=r"random\.qp-fixed\.nl: Ipopt: ImportError: libgfortran is gone"
    ):
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
    "highs": ["solve", "mouse", "-f", "milp-mccormick", "--size", "14"],
    "ipopt": ["solve", "mouse", "-f", "miqcp-bilinear", "--relax", "--size", "40"],
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
def test_ctrl_c_during_the_milp_of_a_run_goes_on_with_its_best_point(tmp_path):
    """With one thread the MILP comes before the search."""
    command = ["run", "mouse", "--size", "14", "--time-limit", "6", "--threads", "1"]
    code, out, err = interrupted(tmp_path, "*.highs.log", command, AT_WORK["highs"])
    assert code == 0
    assert "MILP: interrupted; its best field so far was kept" in err
    assert "two-stage" in out
    assert "interrupted: two-stage; report.json lists the results so far" in err
    assert (tmp_path / "report.json").exists()
