"""Files of starting points: each solver takes ours as a feasible incumbent with our objective."""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path
from typing import Any

import pytest
from cases import SKEWED, make_field, make_instance
from crossfield.export.bundle.starts import STARTS, complete_start, write_start, write_starts
from crossfield.export.formats.registry import write
from crossfield.models.errors import InputError, UnsupportedBySolverError
from crossfield.models.formulations.problem import Problem, formulate
from loops import for_each

pytestmark = pytest.mark.oracles

MIXED = [name for name in SKEWED if name not in {"qp-fixed", "minlp-parity"}]
CONVEX = ["minlp-quartic", "miqp-mccormick", "milp-mccormick", "miqp-exact"]
"""Those whose LP and MPS files are convex: (8) is, with its products lifted."""
BOTH = ("lp", "mps")


def given(name: str, solver: str, folder: Path, suffix: str) -> tuple[Problem, Path, Path, float]:
    """A problem, its model file, the start of a random field, and the start's objective."""
    instance = make_instance("row")
    problem = formulate(instance, name)
    field, path = make_field(instance, 7), folder / f"start{STARTS[solver].suffix}"
    objective = write_start(problem, field, path, solver)
    assert objective == pytest.approx(problem.objective_value(problem.point(field)), rel=1e-12)
    write(problem, folder / f"model.{suffix}")
    return problem, folder / f"model.{suffix}", path, objective


@pytest.mark.needs("gurobi")
@for_each("suffix", BOTH)
@for_each("name", MIXED)
def test_gurobi_takes_it(name: str, suffix: str, tmp_path: Path):
    import gurobipy

    _, model, start, objective = given(name, "gurobi", tmp_path, suffix)
    log = tmp_path / "log"
    options = {"OutputFlag": 0, "LogFile": str(log), "LogToConsole": 0}
    with gurobipy.Env(params=options) as environment, gurobipy.read(str(model), environment) as read:
        read.read(str(start))
        read.setParam("OutputFlag", 1)
        read.setParam("LogToConsole", 0)
        read.setParam("SolutionLimit", 1)
        read.optimize()
        assert read.ObjVal == pytest.approx(objective, rel=1e-9)  # the first solution is the start
    assert re.search(r"^Loaded user MIP start with objective", log.read_text(), re.MULTILINE)


@pytest.mark.needs("cplex")
@for_each("suffix", BOTH)
@for_each("name", CONVEX)
def test_cplex_takes_it(name: str, suffix: str, tmp_path: Path):
    import cplex

    _, model, start, objective = given(name, "cplex", tmp_path, suffix)
    log = io.StringIO()
    read = cplex.Cplex()
    for stream in ("log", "results", "warning", "error"):
        getattr(read, f"set_{stream}_stream")(log)
    read.read(str(model))
    read.MIP_starts.read(str(start))
    assert read.MIP_starts.get_num() == 1
    read.parameters.mip.limits.solutions.set(1)
    read.solve()
    result = re.search(
        r"MIP start 'start' defined initial solution with objective (\S+)\.$", log.getvalue(), re.MULTILINE
    )
    assert result, log.getvalue()
    assert float(result[1]) == pytest.approx(objective, abs=1e-4)  # it prints four digits
    assert read.solution.get_objective_value() == pytest.approx(objective, rel=1e-9)


@pytest.mark.needs("highs")
@for_each("suffix", BOTH)
def test_highs_takes_it(suffix: str, tmp_path: Path):
    import highspy

    _, model, start, objective = given("milp-mccormick", "highs", tmp_path, suffix)
    log = tmp_path / "log"
    highs: Any = highspy.Highs()
    highs.setOptionValue("log_to_console", "false")
    highs.setOptionValue("log_file", str(log))
    assert highs.readModel(str(model)) == highspy.HighsStatus.kOk
    assert highs.readSolution(str(start), 0) == highspy.HighsStatus.kOk
    highs.run()
    text = log.read_text()
    result = re.search(r"MIP start solution is feasible[,:] objective value is (\S+)", text)
    assert result, text
    assert float(result[1]) == pytest.approx(objective, rel=1e-9)
    assert "WARNING" not in text


@pytest.mark.needs("scip")
@for_each("suffix", ["nl", *BOTH])
@for_each("name", [*MIXED, "minlp-parity"])
def test_scip_takes_it(name: str, suffix: str, tmp_path: Path):
    import pyscipopt

    if (name, suffix) in {("minlp-parity", "lp"), ("minlp-parity", "mps")}:
        return  # they hold no cosine
    _, model, start, objective = given(name, "scip", tmp_path, suffix)
    scip = pyscipopt.Model()
    scip.hideOutput()
    scip.readProblem(str(model))
    solution = scip.readSolFile(str(start))
    assert scip.checkSol(solution, original=True)
    assert scip.getSolObjVal(solution) == pytest.approx(objective, rel=1e-9)
    assert scip.addSol(solution)


@pytest.mark.needs("xpress")
@for_each("suffix", BOTH)
@for_each("name", CONVEX)
def test_xpress_takes_it(name: str, suffix: str, tmp_path: Path):
    with warnings.catch_warnings(action="ignore"):
        import xpress

        _, model, start, objective = given(name, "xpress", tmp_path, suffix)
        read = xpress.problem()
    read.setControl("outputlog", 1)
    read.setLogFile(str(tmp_path / "log"))
    read.readProb(str(model))
    read.readSlxSol(str(start))
    read.setControl("maxmipsol", 1)
    read.setControl("outputlog", 1)
    read.optimize()
    assert read.attributes.objval == pytest.approx(objective, rel=1e-9)  # the first solution is the start


# files


def test_starts_are_written_for_the_solvers_that_take_them(tmp_path: Path):
    instance = make_instance()
    field = make_field(instance)
    written = {
        name: set(write_starts(formulate(instance, name), field, tmp_path, f"tiny.{name}"))
        for name in ("milp-mccormick", "miqcp-bilinear", "minlp-parity", "miqp-exact")
    }
    assert written["milp-mccormick"] == set(STARTS)
    assert written["miqcp-bilinear"] == {"gurobi", "scip"}
    assert written["miqp-exact"] == set(STARTS) - {"highs"}
    assert written["minlp-parity"] == {"scip"}
    assert (tmp_path / "tiny.milp-mccormick.gurobi.start.mst").is_file()
    fixed = formulate(instance, "qp-fixed", p=field.p)
    assert write_starts(fixed, field, tmp_path, "tiny.qp-fixed") == {}


def test_what_cannot_be_started_is_refused(tmp_path: Path):
    instance = make_instance()
    field = make_field(instance)
    with pytest.raises(InputError, match="baron"):
        write_start(formulate(instance, "milp-mccormick"), field, tmp_path / "a", "baron")
    with pytest.raises(UnsupportedBySolverError, match="minlp-quartic"):
        write_start(formulate(instance, "minlp-parity"), field, tmp_path / "a", "gurobi")
    with pytest.raises(UnsupportedBySolverError, match="5002"):
        write_start(formulate(instance, "miqcp-bilinear"), field, tmp_path / "a", "cplex")
    assert list(tmp_path.iterdir()) == []
    start = complete_start(formulate(instance, "minlp-quartic"), field)
    assert "z" in start.problem.blocks
    assert start.problem.violation(start.point).worst < 1e-12
