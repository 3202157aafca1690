"""Xpress as a reader of LP and MPS, through its Python API. The community edition is limited in size."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

with warnings.catch_warnings(action="ignore"):  # it prints which licence it uses
    import xpress

from ...models.processes.child_program import on_stop
from ...models.storage import replacing
from ..statuses import claim_of, finite_or_none
from .model_content import Algebra, Entries, entries_of_triangle, numbered, with_infinities
from .protocol import Job, Outcome, RefusedError, TooLargeError

_ROWS, _COLUMNS = 1, 2


def version() -> str:
    """Its version."""
    return str(xpress.__version__)


def _load(path: Path, *, log: bool = False) -> Any:
    with warnings.catch_warnings(action="ignore"):
        model = xpress.problem()
    model.setControl("outputlog", int(log))
    try:
        model.readProb(str(path))
    except (xpress.ModelError, xpress.SolverError, xpress.InterfaceError) as error:
        _raise_refusal(error)
    return model


def _raise_refusal(error: Exception) -> None:
    if "too many rows and columns" in str(error):
        raise TooLargeError(str(error)) from error
    raise RefusedError(str(error)) from error


def read(path: Path) -> Algebra:
    """The file as Xpress reads it."""
    model = _load(path)
    if model.attributes.objsense != 1 or model.attributes.objrhs != 0:
        raise RefusedError("it is not minimised, or has a constant besides ONE")
    n, m = model.attributes.cols, model.attributes.rows
    kinds, limits = np.array(model.getRowType(0, m - 1)), np.array(model.getRHS(0, m - 1))
    start, column, value = (np.array(part) for part in model.getRows(0, m - 1))
    row = np.repeat(np.arange(m), np.diff(start))
    linear = zip(row.tolist(), column.tolist(), value.tolist(), strict=True)
    return Algebra.of(
        list(model.getNameList(_COLUMNS, 0, n - 1)),
        list(model.getNameList(_ROWS, 0, m - 1)),
        [*numbered(model.getObj(0, n - 1)), *_hessian(model, n), *linear, *_row_products(model)],
        lower=with_infinities(model.getLB(0, n - 1)),
        upper=with_infinities(model.getUB(0, n - 1)),
        integer=[kind in "BI" for kind in model.getColType(0, n - 1)],
        row_lower=np.where(kinds == "L", -np.inf, limits),
        row_upper=np.where(kinds == "G", np.inf, limits),
    )


def _hessian(model: Any, n: int) -> Entries:
    """The quadratic terms, from the upper triangle of x'Qx/2."""
    start, column, value = (np.array(part) for part in model.getMQObj(0, n - 1))
    return entries_of_triangle(np.repeat(np.arange(n), np.diff(start) if len(value) else 0), column, value)


def _row_products(model: Any) -> Entries:
    """The products of rows, from one triangle of x'Qx."""
    for row in model.getQRows():
        for i, j, q in zip(*model.getQRowQMatrixTriplets(row), strict=True):
            yield int(row), int(i), int(j), q if i == j else 2 * q


def solve(job: Job) -> Outcome:
    """Solve the file; the solution is an .slx, which has no status."""
    model = _load(job.model, log=True)
    if job.start is not None:
        model.readSlxSol(str(job.start))
    for option, value in (
        ("timelimit", job.seconds), ("miprelstop", job.gap), ("mipabsstop", 1e-9), ("feastol", 1e-9),
        ("miptol", 1e-9), ("mipaddcutoff", -1e-9), ("optimalitytol", 1e-9), ("bargapstop", 1e-12),
        *((("threads", job.threads), ("concurrentthreads", job.threads)) if job.threads else ()),
    ):  # fmt: skip
        model.setControl(option, value)
    # Before the search: an interrupted search has the presolved model's names, but the whole model's values.
    names = list(model.getNameList(_COLUMNS, 0, model.attributes.cols - 1))
    try:
        with on_stop(model.interrupt):
            _, solution_status = model.optimize()
    except (xpress.ModelError, xpress.SolverError, xpress.InterfaceError) as error:
        _raise_refusal(error)
    status, words = claim_of(solution_status.name, "xpress")
    mixed = model.attributes.mipents or model.attributes.qconstraints
    bound, nodes = (
        (finite_or_none(model.attributes.bestbound), model.attributes.nodes) if mixed else (None, None)
    )
    if status.needs_point:
        _write_slx(job, names, model.getSolution())
    return Outcome(status, words, bound, nodes)


def _write_slx(job: Job, names: list[str], values: list[float]) -> None:
    """Write an .slx; Xpress' own method refuses points of an interrupted search."""
    lines = (f"  C {name} {value!r}\n" for name, value in zip(names, map(float, values), strict=True))
    with replacing(job.solution) as stream:
        stream.write(f"NAME {job.stamp}\n{''.join(lines)}ENDATA\n".encode())
