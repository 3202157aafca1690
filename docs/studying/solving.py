"""Runs of solvers on files, and the reference proofs."""

from __future__ import annotations

import tempfile
from functools import cache, lru_cache
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Any, Final

import crossfield as cf
from crossfield.export.cli.tables import smallest_problems
from crossfield.export.formats.registry import generator
from crossfield.export.solvers_table import SOLVERS
from crossfield.export.solving.local import Solvers, format_for
from crossfield.models.errors import SolutionError, SolverError, UnsupportedBySolverError
from crossfield.models.field.field import CrossField
from crossfield.models.formulations.problem import Problem, formulate, tightened
from crossfield.models.formulations.windows import Windows
from crossfield.models.instance.instance import Instance
from crossfield.models.proof.tightening import windows_left
from crossfield.models.search.box_qp import fitted

from .instances import made
from .rows import Run

GAP: Final = 1e-6
"""Relative gap up to which an optimum counts as proven, requested of all solvers."""
TOO_LARGE: Final = "too large"
FAILED: Final = "failed"
JUMPS_GIVEN: Final = "qp-fixed"
ANGLES: Final = "angles"
"""Way of the rows with the optimum of `qp-fixed`."""
PROOF: Final = "prove"


@cache
def pairs() -> tuple[tuple[str, str], ...]:
    """Every formulation with every solver that takes it, in the order of the tables."""
    return tuple(
        (problem.name, solver)
        for problem in smallest_problems()
        for solver in SOLVERS
        if format_for(problem, solver).answer == "yes"
    )


@cache
def programs() -> Solvers:
    """The solvers of this process, whose children end with it."""
    found = Solvers().__enter__()
    Finalize(None, found.__exit__, exitpriority=10)  # children of multiprocessing run no other clean-up
    return found


@lru_cache(maxsize=4)
def greedy(name: str, size: int) -> CrossField:
    """The greedy field of an instance, with the best angles: where starts and given jumps come from."""
    return cf.greedy_field(made(name, size))


@lru_cache(maxsize=4)
def windows(name: str, size: int, seconds: float) -> Windows:
    """The windows of a certificate of an instance."""
    with tempfile.TemporaryDirectory(prefix="crossfield-study-") as folder:
        proof = cf.prove(made(name, size), limits=cf.Limits(seconds, gap=0), jobs=1)
        return windows_left(cf.write_certificate(proof, Path(folder) / "a.certificate.npz"))


def posed(run: Run) -> Problem:
    """The problem of a run."""
    instance = made(run.instance, run.size)
    options = {} if run.facet == "hull" else {"facet": run.facet}
    jumps = greedy(run.instance, run.size).p if run.way == JUMPS_GIVEN else None
    found = formulate(instance, run.way, p=jumps, **options)
    return (
        tightened(found, windows(run.instance, run.size, PROOF_SECONDS)) if run.windows == "proof" else found
    )


PROOF_SECONDS: Final = 20.0
"""Seconds for a proof unless stated otherwise."""


def solved(run: Run) -> dict[str, Any]:
    """Result of a solver on a file: its status, and the objective recomputed at its point."""
    problem = posed(run)
    start = greedy(run.instance, run.size) if run.start == "greedy" else None
    facts: dict[str, Any] = {
        "version": programs().version(run.solver),
        "format": format_for(problem, run.solver).format,
        **sizes(problem.instance),
        "columns": problem.n_columns,
        "rows": problem.n_rows,
    }
    try:
        found = programs().solve(problem, run.solver, limits=cf.Limits(run.limit, GAP, 1), start=start)
    except UnsupportedBySolverError as error:
        return facts | {"status": TOO_LARGE, "note": str(error)}
    except (SolverError, SolutionError) as error:
        return facts | {"status": FAILED, "note": str(error)}
    facts |= {"status": str(found.status), "bound": found.bound, "seconds": found.seconds}
    facts |= {"nodes": found.nodes, "note": found.doubt}
    return facts if found.point is None else facts | _at_point(found)


def _at_point(found: cf.Solution) -> dict[str, Any]:
    violation = found.violation
    return {
        "objective": found.objective,
        "violation": violation and violation.worst,
        **energies(found.field),
    }


def proved(run: Run) -> dict[str, Any]:
    """Result of a proof of an instance, or the optimum for the jumps of the greedy field."""
    instance = made(run.instance, run.size)
    facts: dict[str, Any] = {"version": generator(), **sizes(instance)}
    if run.way == ANGLES:
        energy = fitted(greedy(run.instance, run.size)).energy().total
        return facts | {"status": "optimal", "objective": energy, "bound": energy}
    proof = cf.prove(
        instance, norm=1 if run.norm == 1 else 2, limits=cf.Limits(run.limit, gap=0), jobs=1, seed=run.seed
    )
    facts |= {"status": proof.status, "objective": proof.energy, "bound": proof.bound}
    return facts | {"seconds": proof.seconds, "note": proof.ended, **energies(proof.field)}


def sizes(instance: Instance) -> dict[str, int]:
    """Numbers of pixels and pairs of an instance."""
    return {"pixels": instance.grid.size, "pairs": len(instance.grid.first)}


def energies(field: CrossField) -> dict[str, float]:
    """The energies of a field in both norms."""
    return {"energy_2": field.energy(2).total, "energy_1": field.energy(1).total}
