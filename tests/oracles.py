"""Independent readers of LP, MPS and .nl files, each giving a model as plain arrays to be compared with a Problem."""

from __future__ import annotations

import json
import shutil
import subprocess
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import highspy
import numpy as np
import pyscipopt
from cases import names_of
from crossfield.export.lp import needs_one
from crossfield.export.names import column_names, row_names
from crossfield.models.grid import Bools, Floats
from crossfield.models.problem import Problem

with warnings.catch_warnings(action="ignore"):  # its import warns on newer Pythons
    import casadi

BIG = 1e19
"""SCIP's infinity is 1e20."""


@dataclass(frozen=True)
class Model:
    """A quadratic model: costs, limits and coefficients in the order of `columns` and `rows`; x'Qx with Q symmetric."""

    columns: list[str]
    lower: Floats
    upper: Floats
    integer: Bools
    costs: Floats
    quadratic: Floats
    rows: list[str]
    row_lower: Floats
    row_upper: Floats
    matrix: Floats
    row_quadratic: Floats

    def objective(self, points: Floats) -> Floats:
        """The objective at points (k, columns)."""
        return points @ self.costs + np.einsum("ki,ij,kj->k", points, self.quadratic, points)

    def activities(self, points: Floats) -> Floats:
        """The rows at points (k, columns), shape (k, rows)."""
        return points @ self.matrix.T + np.einsum("ki,rij,kj->kr", points, self.row_quadratic, points)

    def ordered(self, columns: list[str], rows: list[str]) -> Model:
        """The same model with its columns and rows in another order."""
        c, r = [self.columns.index(name) for name in columns], [self.rows.index(name) for name in rows]
        return Model(
            columns, self.lower[c], self.upper[c], self.integer[c], self.costs[c], self.quadratic[np.ix_(c, c)],
            rows, self.row_lower[r], self.row_upper[r], self.matrix[np.ix_(r, c)], self.row_quadratic[np.ix_(r, c, c)],
        )  # fmt: skip


def _empty(columns: list[str], rows: list[str]) -> dict[str, Any]:
    n, m = len(columns), len(rows)
    arrays: dict[str, Any] = {name: np.zeros(n) for name in ("lower", "upper", "costs")}
    arrays |= {name: np.zeros(m) for name in ("row_lower", "row_upper")}
    arrays |= {
        "matrix": np.zeros((m, n)),
        "quadratic": np.zeros((n, n)),
        "row_quadratic": np.zeros((m, n, n)),
    }
    return {"columns": columns, "rows": rows, "integer": np.zeros(n, dtype=bool)} | arrays


def of_problem(problem: Problem) -> Model:
    """What an LP or MPS file of the problem should mean, from the problem's arrays: ONE is its last column."""
    one = ["ONE"] * needs_one(problem)
    given = _empty(
        names_of(column_names(problem)) + one, names_of(row_names(problem)) if problem.rows else ["c_ONE"]
    )
    n = problem.columns
    given["lower"][:n], given["upper"][:n], given["integer"][:n] = (
        problem.lower,
        problem.upper,
        problem.integer,
    )
    given["lower"][n:] = given["upper"][n:] = 1
    index, coefficient = problem.merged_objective(1)
    given["costs"][index[:, 0]] = coefficient
    given["costs"][n:] = problem.merged_objective(0)[1]
    index, coefficient = problem.merged_objective(2)
    for (first, second), value in zip(index.tolist(), coefficient.tolist(), strict=True):
        _add(given["quadratic"], first, second, value)
    if not problem.rows:
        given["matrix"][0, n], given["row_lower"][0], given["row_upper"][0] = 1, 1, 1
    start = 0
    for family in problem.rows:
        at = np.arange(start, start + family.count)
        given["row_lower"][at] = -np.inf if family.family.sense == "<=" else family.limit
        given["row_upper"][at] = np.inf if family.family.sense == ">=" else family.limit
        for term in family.of_degree(1):
            given["matrix"][at, term.factors[0]] += term.coefficient
        for term in family.of_degree(2):
            given["row_quadratic"][at, term.factors[0], term.factors[1]] += np.asarray(term.coefficient) / 2
            given["row_quadratic"][at, term.factors[1], term.factors[0]] += np.asarray(term.coefficient) / 2
        start += family.count
    return Model(**given)


def _add(matrix: Floats, first: int, second: int, value: float) -> None:
    matrix[first, second] += value / 2
    matrix[second, first] += value / 2


def by_highs(path: Path) -> Model:
    """The file as HiGHS reads it. It reads no quadratic rows."""
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    assert highs.readModel(str(path)) == highspy.HighsStatus.kOk
    lp, hessian = highs.getLp(), highs.getModel().hessian_
    assert lp.sense_ == highspy.ObjSense.kMinimize
    assert lp.offset_ == 0
    given = _empty(list(lp.col_names_), list(lp.row_names_))
    given |= {
        "lower": np.array(lp.col_lower_),
        "upper": np.array(lp.col_upper_),
        "costs": np.array(lp.col_cost_),
    }
    given |= {"row_lower": np.array(lp.row_lower_), "row_upper": np.array(lp.row_upper_)}
    if len(lp.integrality_):
        given["integer"] = np.array([kind == highspy.HighsVarType.kInteger for kind in lp.integrality_])
    start, index, value = (
        np.array(part) for part in (lp.a_matrix_.start_, lp.a_matrix_.index_, lp.a_matrix_.value_)
    )
    assert lp.a_matrix_.format_ == highspy.MatrixFormat.kColwise
    given["matrix"][index, np.repeat(np.arange(lp.num_col_), np.diff(start))] = value
    if hessian.dim_:
        start, index, value = (np.array(part) for part in (hessian.start_, hessian.index_, hessian.value_))
        column = np.repeat(np.arange(hessian.dim_), np.diff(start))
        for i, j, q in zip(index.tolist(), column.tolist(), value.tolist(), strict=True):
            _add(given["quadratic"], i, j, q if i != j else q / 2)  # lower triangle of the Hessian
    return Model(**given)


def by_scip(path: Path) -> Model:
    """The file as SCIP reads it; a quadratic objective is a row with a variable of its own there."""
    scip = pyscipopt.Model()
    scip.hideOutput()
    scip.readProblem(str(path))
    assert scip.getObjectiveSense() == "minimize"
    assert scip.getObjoffset() == 0
    extra = {"quadobjvar", "qmatrixvar", "quadobj", "qmatrix"}
    variables = [variable for variable in scip.getVars() if variable.name not in extra]
    rows = [row for row in scip.getConss() if row.name not in extra]
    given = _empty([variable.name for variable in variables], [row.name for row in rows])
    number = {name: index for index, name in enumerate(given["columns"])}
    given["lower"], given["upper"] = _limits([(v.getLbOriginal(), v.getUbOriginal()) for v in variables])
    given["integer"] = np.array([v.vtype() in {"BINARY", "INTEGER"} for v in variables])
    given["costs"] = np.array([v.getObj() for v in variables])
    given["row_lower"], given["row_upper"] = _limits([(scip.getLhs(row), scip.getRhs(row)) for row in rows])
    for row in scip.getConss():
        goal = row.name in extra
        place = 0 if goal else given["rows"].index(row.name)
        linear = np.zeros_like(given["costs"]) if goal else given["matrix"][place]
        square = given["quadratic"] if goal else given["row_quadratic"][place]
        _scip_row(scip, row, number, linear, square)
        assert not linear.any() or not goal
    return Model(**given)


def _limits(ends: list[tuple[float, float]]) -> tuple[Floats, Floats]:
    lower, upper = np.array(ends).reshape(-1, 2).T
    return np.where(lower < -BIG, -np.inf, lower), np.where(upper > BIG, np.inf, upper)


def _scip_row(scip: Any, row: Any, number: dict[str, int], linear: Floats, square: Floats) -> None:
    if row.getConshdlrName() == "linear":
        for name, value in scip.getValsLinear(row).items():
            linear[number[name]] += value
        return
    assert scip.checkQuadraticNonlinear(row)
    products, squares, rest = scip.getTermsQuadratic(row)
    for first, second, value in products:
        _add(square, number[first.name], number[second.name], value)
    for variable, value, cost in squares:
        _add(square, number[variable.name], number[variable.name], value)
        linear[number[variable.name]] += cost
    for variable, value in rest:
        if variable.name in number:  # all but the variable that stands for the objective
            linear[number[variable.name]] += value


def by_gurobi(path: Path) -> Model:
    """The file as Gurobi reads it; its free licence ends at 2000 columns. Needs gurobipy."""
    import gurobipy

    with (
        gurobipy.Env(params={"OutputFlag": 0}) as environment,
        gurobipy.read(str(path), environment) as model,
    ):
        assert model.ModelSense == gurobipy.GRB.MINIMIZE
        assert model.ObjCon == 0
        variables, plain, products = model.getVars(), model.getConstrs(), model.getQConstrs()
        given = _empty(
            [v.VarName for v in variables], [r.ConstrName for r in plain] + [r.QCName for r in products]
        )
        for name, attribute in (("lower", "LB"), ("upper", "UB"), ("costs", "Obj")):
            given[name] = np.array(model.getAttr(attribute, variables))
        given["integer"] = np.array([v.VType in "BI" for v in variables])
        goal = model.getObjective()
        if isinstance(goal, gurobipy.QuadExpr):
            _gurobi_products(goal, given["quadratic"])
        senses = [r.Sense for r in plain] + [r.QCSense for r in products]
        limits = np.array([r.RHS for r in plain] + [r.QCRHS for r in products])
        given["row_lower"] = np.where(np.array(senses) == "<", -np.inf, limits)
        given["row_upper"] = np.where(np.array(senses) == ">", np.inf, limits)
        given["matrix"][: len(plain)] = model.getA().toarray()
        for place, row in enumerate(products, start=len(plain)):
            expression = model.getQCRow(row)
            _gurobi_products(expression, given["row_quadratic"][place])
            rest = expression.getLinExpr()
            for term in range(rest.size()):
                given["matrix"][place, rest.getVar(term).index] += rest.getCoeff(term)
        return Model(**given)


def _gurobi_products(expression: Any, square: Floats) -> None:
    for term in range(expression.size()):
        _add(
            square, expression.getVar1(term).index, expression.getVar2(term).index, expression.getCoeff(term)
        )


@dataclass(frozen=True)
class NlReading:
    """An .nl file as CasADi reads it: bounds, integrality, and a function of points."""

    lower: Floats
    upper: Floats
    row_lower: Floats
    row_upper: Floats
    discrete: list[bool]
    start: Floats
    evaluate: Callable[[Floats], tuple[float, Floats]]


def by_casadi(path: Path) -> NlReading:
    """The .nl file as CasADi reads it."""
    read = casadi.NlpBuilder()
    read.import_nl(str(path))
    x = casadi.vertcat(*read.x)
    function = casadi.Function("model", [x], [read.f, casadi.vertcat(*read.g)])

    def evaluate(point: Floats) -> tuple[float, Floats]:
        objective, rows = function(point)
        return float(objective), np.array(rows).ravel()

    ends = [np.array(casadi.DM(values)).ravel() for values in (read.x_lb, read.x_ub, read.g_lb, read.g_ub)]
    return NlReading(*ends, list(read.discrete), np.array(casadi.DM(read.x_init)).ravel(), evaluate)


def has_asl() -> bool:
    """Whether the real AMPL Solver Library is here, as Debian's gjh-asl-json."""
    return shutil.which("gjh_asl_json") is not None


def by_asl(path: Path) -> tuple[dict[str, Any], float, Floats, Floats, Floats]:
    """What the AMPL Solver Library says of an .nl file at its starting point.

    Statistics, objective, gradient, rows, Jacobian (rows, columns).
    """
    subprocess.run(
        ["gjh_asl_json", str(path.with_suffix(""))], check=True, capture_output=True, cwd=path.parent
    )
    said = json.loads(path.with_suffix(".json").read_text())
    statistics, values = said["problem statistics"], said["initial evaluations"]
    columns, rows = statistics["total no. of variables"], statistics["total no. of constraints"]
    goal = values["objective function"]["0"]
    gradient, jacobian = np.zeros(columns), np.zeros((rows, columns))
    for key, value in goal["gradient"].items():
        gradient[int(key)] = value
    for key, value in values.get("constraints' jacobian", {}).items():
        jacobian[tuple(map(int, key.split("_")))] = value
    activities = np.array([values["constraints"][str(row)] for row in range(rows)])
    return statistics, goal["value"], gradient, activities, jacobian


def scip_columns(path: Path) -> dict[str, tuple[bool, float, float]]:
    """Columns of an .nl file as SCIP reads them: name -> integer, bounds."""
    scip = pyscipopt.Model()
    scip.hideOutput()
    scip.readProblem(str(path))
    found = {
        v.name: (v.vtype() != "CONTINUOUS", v.getLbOriginal(), v.getUbOriginal()) for v in scip.getVars()
    }
    found.pop("nlobjvar", None)
    return {
        name: (integer, *(float(e[0]) for e in _limits([(low, high)])))
        for name, (integer, low, high) in found.items()
    }
