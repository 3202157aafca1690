"""CPLEX as a reader of LP and MPS, through its Python API.

The community edition solves up to 1000 columns and rows.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import cplex
import numpy as np
from cplex.exceptions import CplexError, CplexSolverError

from ...models.processes.child_program import on_stop
from ..statuses import claim_of, finite_or_none
from .model_content import Algebra, Entries, numbered, with_infinities
from .protocol import Job, Outcome, RefusedError, TooLargeError, write_in_full

_SIZE_LIMIT = 1016


def version() -> str:
    """Its version."""
    return str(cplex.Cplex().get_version())


def _load(path: Path, *, log: bool = False) -> Any:
    model = cplex.Cplex()
    for stream in ("log", "results", "warning", "error"):
        getattr(model, f"set_{stream}_stream")(sys.stdout if log else None)
    try:
        model.read(str(path))
    except CplexError as error:
        raise RefusedError(str(error)) from error
    return model


def read(path: Path) -> Algebra:
    """The file as CPLEX reads it, quadratic rows last; its parser of decimals sometimes errs by an ulp."""
    model = _load(path)
    columns, goal = model.variables, model.objective
    if goal.get_sense() != goal.sense.minimize or goal.get_offset() != 0:
        raise RefusedError("it is not minimised, or has a constant besides ONE")
    plain, products = model.linear_constraints, model.quadratic_constraints
    senses = np.array([*plain.get_senses(), *products.get_senses()])
    limits = np.array([*plain.get_rhs(), *products.get_rhs()])
    mixed = "MI" in model.problem_type[model.get_problem_type()]
    return Algebra.of(
        columns.get_names(),
        [*plain.get_names(), *products.get_names()],
        [*numbered(goal.get_linear()), *_entries(goal, plain, products)],
        lower=with_infinities(columns.get_lower_bounds()),
        upper=with_infinities(columns.get_upper_bounds()),
        integer=[kind in "BI" for kind in (columns.get_types() if mixed else "C" * columns.get_num())],
        row_lower=np.where(senses == "L", -np.inf, limits),
        row_upper=np.where(senses == "G", np.inf, limits),
    )


def _entries(goal: Any, plain: Any, products: Any) -> Entries:
    """The quadratic terms of the objective, from both triangles of x'Qx/2, and the entries of the rows."""
    lines = goal.get_quadratic() if goal.get_num_quadratic_nonzeros() else []
    for i, line in enumerate(lines):
        yield from ((None, i, j, q / 2) for j, q in zip(*line.unpack(), strict=True))
    for row, line in enumerate([*plain.get_rows(), *products.get_linear_components()]):
        yield from ((row, j, a) for j, a in zip(*line.unpack(), strict=True))
    for row, part in enumerate(products.get_quadratic_components(), start=plain.get_num()):
        yield from ((row, i, j, a) for i, j, a in zip(part.ind1, part.ind2, part.val, strict=True))


def solve(job: Job) -> Outcome:
    """Solve the file; the solution is CPLEX's XML."""
    model = _load(job.model, log=True)
    if job.start is not None:
        model.MIP_starts.read(str(job.start))
    settings = model.parameters
    settings.timelimit.set(job.seconds)
    settings.threads.set(job.threads)
    for parameter, value in (
        (settings.mip.tolerances.mipgap, job.gap),
        (settings.mip.tolerances.absmipgap, 1e-9),
        (settings.mip.tolerances.integrality, 0.0),
        # With this, two of some 100 runs of `minlp-quartic` have bounds above the optimum; by default, two
        # claim false optima. Numerical emphasis may be the remedy; it is not measured.
        (settings.simplex.tolerances.feasibility, 1e-9),
        (settings.simplex.tolerances.optimality, 1e-9),
        (settings.barrier.convergetol, 1e-12),
        (settings.barrier.qcpconvergetol, 1e-12),
    ):
        parameter.set(value)
    aborter = model.use_aborter(cplex.Aborter())
    try:
        with on_stop(aborter.abort):
            model.solve()
    except CplexSolverError as error:
        if error.args[2] == _SIZE_LIMIT:
            raise TooLargeError(str(error)) from error
        raise RefusedError(str(error)) from error
    answer = model.solution
    words = answer.get_status_string()
    mixed = "MI" in model.problem_type[model.get_problem_type()]
    nodes = answer.progress.get_num_nodes_processed() if mixed else None
    bound = finite_or_none(answer.MIP.get_best_objective()) if mixed else None
    if not answer.is_primal_feasible():
        status, _ = claim_of(answer.get_status(), "cplex")
        return Outcome(status.without_point, words, bound, nodes)
    with write_in_full(job.solution) as part:
        answer.write(str(part))
    return Outcome(bound=bound, nodes=nodes)
