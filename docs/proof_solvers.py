"""Proofs of MIP solvers from the written files: cold, and with the windows of a certificate.

Each solve runs in a separate process, on two threads if the solver has threads.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import crossfield as cf
from crossfield.export.solvers_table import PROGRAMS
from crossfield.models.errors import InstanceError
from crossfield.models.field.field import Norm
from crossfield.models.formulations.problem import Problem, with_windows
from crossfield.models.instance.instance import Instance
from crossfield.models.proof.certificate import write_certificate
from crossfield.models.proof.descent.record import Claim
from crossfield.models.proof.prove import prove
from crossfield.models.proof.tightening import remaining_windows
from drawings import Sketch

THREADS: Final = 2
PROVEN: Final = 1e-6
"""Gap, relative to 1 or the objective if that is more, of an optimum that is proven."""
FREE: Final = {"gurobi": (2000, 200), "cplex": (1000, 1000)}
"""Columns and rows of free editions, and columns of problems with quadratic terms."""


@dataclass(frozen=True)
class Answer:
    """Result of a solver: best objective and dual bound, if any, and seconds."""

    objective: float | None
    bound: float | None
    seconds: float

    @property
    def proven(self) -> bool:
        """Whether the bound equals the objective up to rounding."""
        if self.objective is None or self.bound is None:
            return False
        return self.objective - self.bound <= PROVEN * max(1.0, abs(self.objective))


def solve_file(problem: Problem, solver: str, seconds: float) -> Answer:
    """Solve the MPS file of a problem."""
    with tempfile.TemporaryDirectory() as folder:
        solution = cf.solve(
            problem, solver, folder=folder, limits=cf.Limits(seconds, gap=1e-7, threads=THREADS)
        )
    return Answer(solution.objective, solution.bound, solution.seconds or seconds)


def can_take(problem: Problem, solver: str) -> bool:
    """Whether the free edition of the solver takes the problem."""
    if solver not in FREE:
        return True
    most, most_quadratic = FREE[solver]
    linear = problem.objective_degree == 1
    return max(problem.n_columns, problem.n_rows) <= most and (linear or problem.n_columns <= most_quadratic)


def largest_instance(name: str, size: int, formulation: str, solver: str) -> Instance:
    """The sample at that size, or at the greatest size below it that the solver's free edition takes."""
    for smaller in range(size, 4, -1):
        try:
            instance = Sketch(name, name).instance(smaller)
        except InstanceError:  # the outline leaves no room on so coarse a grid
            continue
        if can_take(cf.formulate(instance, formulation), solver):
            return instance
    raise InstanceError(f"{name} has no size that {solver} takes")


USES: Final = (
    ("highs", "milp-mccormick"),
    ("scip", "miqp-exact"),
    ("gurobi", "milp-mccormick"),  # of the other one its free edition takes no more than some 20 pixels
    ("cplex", "miqp-exact"),
)
"""Formulations for each solver."""


def certificate_of(instance: Instance, seconds: float) -> Claim:
    """The certificate of an instance."""
    with tempfile.TemporaryDirectory() as folder:
        return write_certificate(
            prove(instance, limits=cf.Limits(seconds, gap=0)), Path(folder) / "certificate.npz"
        )


def prove_here(instance: Instance, norm: Norm, seconds: float) -> Answer:
    """Result of `crossfield prove` for an instance, in the norm that a formulation minimises."""
    proof = prove(instance, norm=norm, limits=cf.Limits(seconds, gap=0))
    return Answer(proof.energy, proof.bound, proof.seconds)


def solver_rows(name: str, size: int, seconds: float, proof_seconds: float) -> Iterator[dict[str, Any]]:
    """Proofs of each installed solver for a sample: from the files as they are, and tightened."""
    proofs: dict[str, Claim] = {}
    for solver, formulation in USES:
        if PROGRAMS[solver].missing:
            continue
        instance = largest_instance(name, size, formulation, solver)
        if instance.sha256 not in proofs:
            proofs[instance.sha256] = certificate_of(instance, proof_seconds)
        proof = proofs[instance.sha256]
        cold = cf.formulate(instance, formulation)
        narrow = with_windows(cold, remaining_windows(proof))
        row = {
            "name": name, "width": instance.grid.width, "height": instance.grid.height,
            "pixels": instance.grid.size, "solver": solver, "formulation": formulation,
            "columns": cold.n_columns, "rows": cold.n_rows, "seconds": seconds,
            "energy": proof.energy, "proof": proof.bound, "status": proof.status,
            "free_jumps": int((narrow.data["p_min"] < narrow.data["p_max"]).sum()),
            "pairs": len(instance.grid.first),
        }  # fmt: skip
        answers = {
            "cold": solve_file(cold, solver, seconds),
            "tightened": solve_file(narrow, solver, seconds),
            "here": prove_here(instance, 1 if formulation == "milp-mccormick" else 2, seconds),
        }
        row |= {kind: asdict(answer) | {"proven": answer.proven} for kind, answer in answers.items()}
        yield row
