"""Files of starting points: each solver takes ours as a feasible incumbent with our objective."""

import io
import re
import warnings

import crossfield as cf
import pytest
from cases import SKEWED, make_field, make_instance
from crossfield.export.bundle.starts import STARTS, write_start, write_starts

pytestmark = pytest.mark.oracles

MIXED = [name for name in SKEWED if name not in {"qp-fixed", "minlp-parity"}]
CONVEX = ["minlp-quartic", "miqp-mccormick", "milp-mccormick", "miqp-exact"]
"""Those whose LP and MPS files are convex: (8) is, with its products lifted."""


def first_of_gurobi(model, start, log):
    import gurobipy

    options = {"OutputFlag": 0, "LogFile": str(log), "LogToConsole": 0}
    with gurobipy.Env(params=options) as environment, gurobipy.read(str(model), environment) as read:
        read.read(str(start))
        read.setParam("OutputFlag", 1)
        read.setParam("LogToConsole", 0)
        read.setParam("SolutionLimit", 1)
        read.optimize()
        assert re.search(r"^Loaded user MIP start with objective", log.read_text(), re.MULTILINE)
        return read.ObjVal  # the first solution is the start


def first_of_cplex(model, start, _):
    import cplex

    log, read = io.StringIO(), cplex.Cplex()
    for stream in ("log", "results", "warning", "error"):
        getattr(read, f"set_{stream}_stream")(log)
    read.read(str(model))
    read.MIP_starts.read(str(start))
    assert read.MIP_starts.get_num() == 1
    read.parameters.mip.limits.solutions.set(1)
    read.solve()
    assert "MIP start 'start' defined initial solution with objective" in log.getvalue()
    return read.solution.get_objective_value()


def first_of_highs(model, start, log):
    import highspy

    highs = highspy.Highs()
    highs.setOptionValue("log_to_console", "false")
    highs.setOptionValue("log_file", str(log))
    assert highs.readModel(str(model)) == highspy.HighsStatus.kOk
    assert highs.readSolution(str(start), 0) == highspy.HighsStatus.kOk
    highs.run()
    assert "WARNING" not in log.read_text()
    return float(
        re.search(r"MIP start solution is feasible[,:] objective value is (\S+)", log.read_text())[1]
    )


def first_of_scip(model, start, _):
    import pyscipopt

    scip = pyscipopt.Model()
    scip.hideOutput()
    scip.readProblem(str(model))
    solution = scip.readSolFile(str(start))
    assert scip.checkSol(solution, original=True)
    objective = scip.getSolObjVal(solution)
    assert scip.addSol(solution)
    return objective


def first_of_xpress(model, start, log):
    with warnings.catch_warnings(action="ignore"):  # that its edition is free
        import xpress

        read = xpress.problem()
    read.setControl("outputlog", 1)
    read.setLogFile(str(log))
    read.readProb(str(model))
    read.readSlxSol(str(start))
    read.setControl("maxmipsol", 1)
    read.optimize()
    return read.attributes.objval  # the first solution is the start


TAKING = {
    "gurobi": (first_of_gurobi, [(name, suffix) for name in MIXED for suffix in ("lp", "mps")]),
    "cplex": (first_of_cplex, [(name, suffix) for name in CONVEX for suffix in ("lp", "mps")]),
    "highs": (first_of_highs, [("milp-mccormick", "lp"), ("milp-mccormick", "mps")]),
    "scip": (
        first_of_scip,
        [("minlp-parity", "nl"), *((name, suffix) for name in MIXED for suffix in ("nl", "lp", "mps"))],
    ),
    "xpress": (first_of_xpress, [(name, suffix) for name in CONVEX for suffix in ("lp", "mps")]),
}
"""Functions that return the objective of the first point of a solver, and what it is given."""


@pytest.mark.parametrize("solver", [pytest.param(name, marks=pytest.mark.needs(name)) for name in TAKING])
def test_a_solver_takes_the_start(solver, tmp_path):
    first, cases = TAKING[solver]
    for name, suffix in cases:
        problem = cf.formulate(make_instance("row"), name)
        field, start = make_field(problem.instance, 7), tmp_path / f"start{STARTS[solver].suffix}"
        objective = write_start(problem, field, start, solver)
        assert objective == pytest.approx(problem.objective_value(problem.point(field)), rel=1e-12)
        model = tmp_path / f"{name}.{suffix}"
        cf.write(problem, model)
        assert first(model, start, tmp_path / f"{name}.{suffix}.log") == pytest.approx(objective, rel=1e-9)


def test_starts_are_written_for_the_solvers_that_take_them(tmp_path):
    instance = make_instance()
    field = make_field(instance)
    written = {
        name: set(write_starts(cf.formulate(instance, name), field, tmp_path, f"tiny.{name}"))
        for name in ("milp-mccormick", "miqcp-bilinear", "minlp-parity", "miqp-exact")
    }
    assert written["milp-mccormick"] == set(STARTS)
    assert written["miqcp-bilinear"] == {"gurobi", "scip"}
    assert written["miqp-exact"] == set(STARTS) - {"highs"}
    assert written["minlp-parity"] == {"scip"}
    assert (tmp_path / "tiny.milp-mccormick.gurobi.start.mst").is_file()
    fixed = cf.formulate(instance, "qp-fixed", p=field.p)
    assert write_starts(fixed, field, tmp_path, "tiny.qp-fixed") == {}
