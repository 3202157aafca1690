"""Gurobi as a reader of LP and MPS, through gurobipy. Its free licence allows 2000 columns and rows."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import gurobipy
import numpy as np

from ...models.processes.child_program import on_stop
from ..statuses import finite_or_none
from .model_content import Algebra, Entries, numbered
from .protocol import Job, Outcome, RefusedError, TooLargeError, write_in_full

_SIZE_LIMIT = 10010


def version() -> str:
    """Its version."""
    return ".".join(map(str, gurobipy.gurobi.version()))


@contextmanager
def _open_model(path: Path, *, log: bool = False) -> Iterator[Any]:
    with (
        gurobipy.Env(params={"OutputFlag": int(log)}) as environment,
        gurobipy.read(str(path), environment) as model,
    ):
        yield model


def read(path: Path) -> Algebra:
    """The file as Gurobi reads it; quadratic rows come after the others."""
    with _open_model(path) as model:
        if model.ModelSense != gurobipy.GRB.MINIMIZE or model.ObjCon != 0:
            raise RefusedError("it is not minimised, or has a constant besides ONE")
        variables, plain, products = model.getVars(), model.getConstrs(), model.getQConstrs()
        senses = np.array([r.Sense for r in plain] + [r.QCSense for r in products])
        limits = np.array([r.RHS for r in plain] + [r.QCRHS for r in products])
        goal = model.getObjective()
        square = _products(goal) if isinstance(goal, gurobipy.QuadExpr) else []
        entries = [*numbered(model.getAttr("Obj", variables)), *((None, *product) for product in square)]
        return Algebra.of(
            [v.VarName for v in variables],
            [r.ConstrName for r in plain] + [r.QCName for r in products],
            [*entries, *_row_entries(model, len(plain), products)],
            lower=model.getAttr("LB", variables),
            upper=model.getAttr("UB", variables),
            integer=[v.VType in "BI" for v in variables],
            row_lower=np.where(senses == "<", -np.inf, limits),
            row_upper=np.where(senses == ">", np.inf, limits),
        )


def _row_entries(model: Any, plain: int, products: list[Any]) -> Entries:
    """The entries of that many linear rows, and of the quadratic ones after them."""
    sparse = model.getA().tocoo()
    yield from zip(sparse.row.tolist(), sparse.col.tolist(), sparse.data.tolist(), strict=True)
    for place, row in enumerate(products, start=plain):
        expression = model.getQCRow(row)
        yield from ((place, *product) for product in _products(expression))
        linear = expression.getLinExpr()
        for term in range(linear.size()):
            yield place, linear.getVar(term).index, linear.getCoeff(term)


def _products(expression: Any) -> list[tuple[int, int, float]]:
    return [
        (expression.getVar1(term).index, expression.getVar2(term).index, expression.getCoeff(term))
        for term in range(expression.size())
    ]


def solve(job: Job) -> Outcome:
    """Solve the file; the solution is a .json, which holds the status and the bound."""
    with _open_model(job.model, log=True) as model, on_stop(model.terminate):
        if job.start is not None:
            model.read(str(job.start))
        for option, value in (
            ("TimeLimit", job.seconds), ("MIPGap", job.gap), ("MIPGapAbs", 1e-9), ("FeasibilityTol", 1e-9),
            ("OptimalityTol", 1e-9), ("IntFeasTol", 1e-9), ("BarConvTol", 1e-12), ("Threads", job.threads),
        ):  # fmt: skip
            model.setParam(option, value)
        try:
            model.optimize()
        except gurobipy.GurobiError as error:
            if error.errno == _SIZE_LIMIT:
                raise TooLargeError(str(error)) from error
            raise RefusedError(f"Gurobi error {error.errno}: {error}") from error
        model.setParam("JSONSolDetail", 1)  # columns at 0 too
        with write_in_full(job.solution) as part:
            model.write(str(part))
        if not (model.IsMIP or model.IsQCP):
            return Outcome()
        return Outcome(bound=finite_or_none(model.ObjBound), nodes=int(model.NodeCount))
