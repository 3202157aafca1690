"""SCIP as a reader of LP, MPS, .nl and OSiL, through PySCIPOpt.

SCIP represents a quadratic or nonlinear objective by a row with an additional variable. It evaluates no
nonlinear row at a point, but it judges points. At a feasible one the objective is accurate to a small amount
if slightly more is feasible and slightly less is not.
"""

from __future__ import annotations

from importlib.metadata import version as installed
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyscipopt

from ...models.processes.child_program import on_stop
from ..statuses import claim_of, finite_or_none
from ..writing.stamps import is_one_column
from .model_content import Algebra, Behaviour, Entries, Points, numbered
from .protocol import Job, Outcome, RefusedError, file_names, write_in_full

_INFINITY: Final = 1e19  # SCIP's is 1e20
_OBJECTIVE_COLUMNS: Final = frozenset({"quadobjvar", "qmatrixvar", "nlobjvar"})
_OBJECTIVE_ROWS: Final = frozenset({"quadobj", "qmatrix", "objcons"})
_HAIR: Final = 1e-5


def version() -> str:
    """Its version, and PySCIPOpt's."""
    return f"{pyscipopt.Model().version()} (PySCIPOpt {installed('pyscipopt')})"


def _load(path: Path) -> Any:
    scip = pyscipopt.Model()
    scip.hideOutput()
    try:
        scip.readProblem(str(path))
    except Exception as error:  # PySCIPOpt raises plain exceptions
        raise RefusedError(f"SCIP cannot read it: {error}") from error
    if scip.getObjectiveSense() != "minimize":
        raise RefusedError("it is not minimised")
    return scip


def read(path: Path) -> Algebra:
    """The LP or MPS file as SCIP reads it."""
    scip = _load(path)
    if scip.getObjoffset() != 0:
        raise RefusedError("it has a constant besides ONE")
    variables = [v for v in scip.getVars() if v.name not in _OBJECTIVE_COLUMNS]
    rows = [row for row in scip.getConss() if row.name not in _OBJECTIVE_ROWS]
    goals = [row for row in scip.getConss() if row.name in _OBJECTIVE_ROWS]
    number = {v.name: place for place, v in enumerate(variables)}
    entries = [*numbered(v.getObj() for v in variables), *_entries(scip, rows, number)]
    squares = list(_entries(scip, goals, number))
    if any(value for _, *at, value in squares if len(at) == 1):
        raise RefusedError("its quadratic objective has linear terms besides the costs")
    lower, upper = _limits([(v.getLbOriginal(), v.getUbOriginal()) for v in variables])
    row_lower, row_upper = _limits([(scip.getLhs(row), scip.getRhs(row)) for row in rows])
    return Algebra.of(
        list(number),
        [row.name for row in rows],
        [*entries, *((None, *entry) for _, *entry in squares if len(entry) > 2)],
        lower=lower,
        upper=upper,
        integer=[v.vtype() in {"BINARY", "INTEGER"} for v in variables],
        row_lower=row_lower,
        row_upper=row_upper,
    )


def _limits(ends: list[tuple[float, float]]) -> tuple[Any, Any]:
    lower, upper = np.array(ends, dtype=float).reshape(-1, 2).T
    return np.where(lower < -_INFINITY, -np.inf, lower), np.where(upper > _INFINITY, np.inf, upper)


def _entries(scip: Any, rows: list[Any], number: dict[str, int]) -> Entries:
    """The entries of rows, without the variable that represents the objective."""
    for place, row in enumerate(rows):
        if row.getConshdlrName() == "linear":
            yield from ((place, number[name], value) for name, value in scip.getValsLinear(row).items())
            continue
        if not scip.checkQuadraticNonlinear(row):
            raise RefusedError(f"row {row.name} is not quadratic there")
        products, squares, linear = scip.getTermsQuadratic(row)
        yield from ((place, number[a.name], number[b.name], value) for a, b, value in products)
        for v, value, cost in squares:
            yield place, number[v.name], number[v.name], value
            yield place, number[v.name], cost
        yield from ((place, number[v.name], value) for v, value in linear if v.name in number)


def evaluate(path: Path, points: Points) -> Behaviour:
    """The .nl or OSiL file as SCIP reads it: columns, linear rows, its judgement of the objective."""
    scip = _load(path)
    variables = {v.name: v for v in scip.getVars()}
    rows = {row.name: row for row in scip.getConss() if row.name not in _OBJECTIVE_ROWS}
    columns, row_names = file_names(path) if path.suffix == ".nl" else (points.names, list(rows))
    ours = [v for name, v in variables.items() if name not in _OBJECTIVE_COLUMNS and not is_one_column(name)]
    lower, upper = _limits([(v.getLbOriginal(), v.getUbOriginal()) for v in ours])
    row_lower, row_upper = _limits([(scip.getLhs(row), scip.getRhs(row)) for row in map(rows.get, row_names)])
    values = points.of(columns)
    return Behaviour(
        [v.name for v in ours],
        lower,
        upper,
        np.array([v.vtype() != "CONTINUOUS" for v in ours]),
        row_names,
        row_lower,
        row_upper,
        _objective(scip, variables, columns, points),
        np.column_stack(
            [
                np.zeros((len(values), 0)),
                *(_activity(scip, rows[name], columns, values) for name in row_names),
            ]
        ),
    )


def _objective(scip: Any, variables: dict[str, Any], columns: list[str], points: Points) -> Any:
    values = np.full(len(points.values), np.nan)
    columnwise = points.of(columns)
    for place in range(points.random, len(columnwise)):
        values[place] = _judge_objective(
            scip, variables, columns, columnwise[place], float(points.objective[place])
        )
    return values


def _activity(scip: Any, row: Any, columns: list[str], points: Any) -> Any:
    if row.getConshdlrName() != "linear":
        return np.full(len(points), np.nan)
    value = scip.getValsLinear(row)
    return points @ np.array([value.get(name, 0.0) for name in columns])


def _judge_objective(
    scip: Any, variables: dict[str, Any], columns: list[str], point: Any, claim: float
) -> float:
    """The claimed objective at a feasible point if SCIP agrees within a small amount, else infinity."""
    extra = [v for name, v in variables.items() if name in _OBJECTIVE_COLUMNS]
    linear_part = sum(variables[name].getObj() * value for name, value in zip(columns, point, strict=True))
    solution = scip.createSol()
    for one in filter(is_one_column, variables):
        scip.setSolVal(solution, variables[one], 1.0)
        linear_part += variables[one].getObj()
    for name, value in zip(columns, point, strict=True):
        scip.setSolVal(solution, variables[name], value)

    def feasible(step: float) -> bool:
        for variable in extra:
            scip.setSolVal(solution, variable, claim - linear_part - scip.getObjoffset() + step)
        return bool(scip.checkSol(solution, original=True))

    hair = _HAIR * max(1.0, abs(claim))
    if not extra:  # a linear objective is evaluated
        value = scip.getSolObjVal(solution)
        return value if feasible(0.0) else np.inf
    return claim if feasible(hair) and not feasible(-hair) else np.inf


def solve(job: Job) -> Outcome:
    """Solve the file; the solution is SCIP's .sol, without a status."""
    scip = _load(job.model)
    scip.hideOutput(quiet=False)
    for option, value in (
        ("limits/time", job.seconds),
        ("limits/gap", job.gap),
        ("limits/absgap", 1e-9),
        ("numerics/feastol", 1e-9),
        ("numerics/dualfeastol", 1e-9),
        ("misc/catchctrlc", False),
    ):
        scip.setParam(option, value)
    if job.start is not None:
        scip.addSol(scip.readSolFile(str(job.start)))
    with on_stop(scip.interruptSolve):
        scip.optimizeNogil()
    status, words = claim_of(scip.getStatus(), "scip")
    bound = finite_or_none(scip.getDualbound())
    if not scip.getNSols():
        return Outcome(status.without_point, words, bound, scip.getNTotalNodes())
    with write_in_full(job.solution) as part:
        scip.writeBestSol(str(part))
    return Outcome(status, words, bound, scip.getNTotalNodes())
