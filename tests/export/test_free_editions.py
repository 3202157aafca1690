"""The limits of free editions in the table of programs are those at which the programs refuse a model."""

from __future__ import annotations

import re

import pytest
from crossfield.export.solvers_table import PROGRAMS


def gurobi(columns, rows, *, quadratic):
    import gurobipy

    with gurobipy.Env(params={"OutputFlag": 0}) as environment, gurobipy.Model(env=environment) as model:
        x = model.addVars(columns, ub=1.0)
        model.addConstrs(x[k % columns] + x[(k + 1) % columns] <= 1 for k in range(rows))
        model.setObjective(x.sum() + (x[0] * x[0] if quadratic else 0.0))
        try:
            model.optimize()
        except gurobipy.GurobiError as error:
            if "too large" not in str(error):
                raise
            return False
        return True


def cplex(columns, rows, *, quadratic):
    import cplex

    with cplex.Cplex() as model:
        for stream in (model.set_log_stream, model.set_results_stream, model.set_error_stream):
            stream(None)
        model.variables.add(obj=[1.0] * columns, ub=[1.0] * columns)
        pairs = [[[k % columns, (k + 1) % columns], [1.0, 1.0]] for k in range(rows)]
        model.linear_constraints.add(lin_expr=pairs, senses="L" * rows, rhs=[1.0] * rows)
        if quadratic:
            model.objective.set_quadratic([1.0] + [0.0] * (columns - 1))
        try:
            model.solve()
        except cplex.exceptions.CplexSolverError as error:
            if "size limits" not in str(error):
                raise
            return False
        return True


def xpress(columns, rows, *, quadratic):
    import xpress

    model = xpress.problem()
    model.controls.outputlog = 0
    x = [model.addVariable(ub=1.0) for _ in range(columns)]
    try:
        model.addConstraint([x[k % columns] + x[(k + 1) % columns] <= 1 for k in range(rows)])
        model.setObjective(xpress.Sum(x) + (x[0] * x[0] if quadratic else 0.0))
        model.optimize()
    except (xpress.SolverError, xpress.ModelError) as error:
        if "too many rows and columns" not in str(error):
            raise
        return False
    return True


@pytest.mark.parametrize(
    "takes, numbers, most, beyond",
    [
        pytest.param(
            gurobi, [2000, 2000, 200],
            [(2000, 2000, False), (200, 500, True)], [(2001, 1, False), (2, 2001, False), (201, 1, True)],
            marks=pytest.mark.needs("gurobi"),
        ),
        pytest.param(
            cplex, [1000, 1000],
            [(1000, 1000, False), (1000, 1000, True)], [(1001, 1, False), (2, 1001, False)],
            marks=pytest.mark.needs("cplex"),
        ),
        pytest.param(
            xpress, [5000, 200],
            [(2500, 2500, False), (150, 50, True)], [(2501, 2500, False), (151, 50, True)],
            marks=pytest.mark.needs("xpress"),
        ),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore")  # Xpress warns that its edition is free
def test_a_free_edition_takes_models_up_to_its_limits(takes, numbers, most, beyond):
    assert [int(word) for word in re.findall(r"\d+", PROGRAMS[takes.__name__].free)] == numbers
    for sizes, expected in ((most, True), (beyond, False)):
        for columns, rows, quadratic in sizes:
            assert takes(columns, rows, quadratic=quadratic) is expected, (columns, rows, quadratic)
