"""Fields and certificates by a fixed amount of work, and the points of every formulation with a field.

A field (angles and jumps) gives a point of any formulation: every other column has its best value, without
solver tolerances. Every build finds the same fields and certificates.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np

from ....models.errors import SolutionError
from ....models.field.field import CrossField, Norm
from ....models.formulations.problem import Problem, formulate, with_integers_fixed
from ....models.instance.angles import QUARTER
from ....models.instance.grid import Floats
from ....models.instance.instance import Instance
from ....models.proof.certificate import Certificate, read_certificate, write_certificate
from ....models.search.reproducible_angles import reproducible_field
from ....models.search.search import search
from ...bundle.starts import write_start
from ...formats.registry import generator, write
from ...solutions.solution import read_solution
from .standing import FEASIBLE

METHOD: Final = "prove"
_ROUNDS: Final = 8
_NODES: Final = {"tiny": 1000, "small": 20}  # of the branch and bound in the 1-norm, by rung
_LP_UP_TO: Final = 1000  # pixels up to which the angles are fitted in the 1-norm
_MOST_WORK: Final = 20_000_000  # labels, counted at each rounding, after which a proof ends: some minutes
_MOST_BYTES: Final = 2_000_000  # of a certificate that leaves a gap; those of optima are kept
_SUFFIXES: Final[dict[Norm, str]] = {2: "", 1: ".l1", "mixed": ".mixed"}


@dataclass(frozen=True)
class Provenance:
    """Origin of a field: solver and version; seconds and submitter of a submitted field."""

    solver: str
    version: str
    seconds: float | None = None
    by: str | None = None

    @classmethod
    def of(cls, facts: dict[str, Any]) -> Provenance:
        """Return the provenance of a field from its facts in a document."""
        return cls(facts["solver"], facts["version"], facts["seconds"], facts["by"])


@dataclass(frozen=True, eq=False)
class Known:
    """A known field and its provenance."""

    field: CrossField
    provenance: Provenance


def ours(method: str) -> Provenance:
    """Return the provenance of a field that crossfield found by a method."""
    name, _, version = generator().partition(" ")
    return Provenance(f"{name} ({method})", version)


def searched_field(instance: Instance) -> Known:
    """Return a field of low 2-norm energy."""
    return Known(reproducible_field(search(instance, rounds=_ROUNDS, jobs=1).field), ours("search"))


def better_in_1norm(start: CrossField, rung: str) -> list[Known]:
    """Return fields of lower 1-norm energy by HiGHS: best angles for the jumps, and on low rungs a search."""
    if start.instance.grid.size > _LP_UP_TO:
        return []
    problem = formulate(start.instance, "milp-mccormick")  # whose objective is the 1-norm energy
    fitted = _solved(with_integers_fixed(problem, start))
    found = [fitted]
    if rung in _NODES:
        found.append(_solved(problem, mip_max_nodes=_NODES[rung], start=fitted or start))
    return [Known(each, Provenance("HiGHS", version("highspy"))) for each in found if each is not None]


def _solved(problem: Problem, start: CrossField | None = None, **options: int) -> CrossField | None:
    """The field that HiGHS finds under options, or None."""
    from ...programs.highs import loaded, set_options, solved, write_solution

    with tempfile.TemporaryDirectory(prefix="crossfield-") as folder:
        model, first, answer = (Path(folder) / name for name in ("model.mps", "start.sol", "answer.sol"))
        write(problem, model)
        highs = loaded(model, threads=1, parallel="off", mip_rel_gap=1e-6, mip_abs_gap=1e-9)
        set_options(highs, **options)
        if start is not None:
            write_start(problem, start, first, "highs")
            highs.readSolution(str(first), 0)
        write_solution(solved(highs, model), answer)
        try:
            found = read_solution(answer, problem)
        except SolutionError:
            return None
    return None if found.point is None else field_of(problem, found.point)


@dataclass(frozen=True, eq=False)
class Certified:
    """A checked certificate: norm, field, name and bytes of its file, and status, energy and bound."""

    norm: Norm
    known: Known
    file: str
    data: bytes
    facts: dict[str, Any]

    @classmethod
    def of(cls, found: Certificate, file: str, data: bytes, provenance: Provenance) -> Certified:
        """Return it as the checker found it."""
        facts = {"status": found.status, "energy": found.energy, "bound": found.bound}
        return cls(found.norm, Known(found.field, provenance), file, data, facts)


def certificate_file(instance: str, norm: Norm) -> str:
    """Return the name of the file of a certificate that a build made."""
    return f"{instance}{_SUFFIXES[norm]}.certificate.npz"


def certified(start: CrossField, file: str, norm: Norm = 2) -> tuple[Known, Certified | None]:
    """Prove the optimum in a norm from a field; return the best field and the certificate.

    file: name in a library. The certificate is None if it is large and leaves a gap.
    """
    from ....models.proof.prove import prove  # loads compiled functions

    found = prove(start.instance, norm=norm, start=start, work=_MOST_WORK, jobs=1)
    field = reproducible_field(found.field) if norm == 2 else found.field
    proof = replace(found, field=field, energy=field.energy(norm).total)
    with tempfile.TemporaryDirectory(prefix="crossfield-") as folder:
        path = Path(folder) / "a.certificate.npz"
        claim = write_certificate(proof, path)
        data = path.read_bytes()
    kept = claim.status == "optimal" or len(data) <= _MOST_BYTES
    return Known(field, ours(METHOD)), Certified.of(claim, file, data, ours(METHOD)) if kept else None


def certified_by(data: bytes, file: str, on: Instance, provenance: Provenance) -> Certified:
    """Check the bytes of a certificate of an instance. Raises as `read_certificate`."""
    with tempfile.TemporaryDirectory(prefix="crossfield-") as folder:
        path = Path(folder) / file
        path.write_bytes(data)
        return Certified.of(read_certificate(path, on=on), file, data, provenance)


def least_energy(known: Sequence[Known], norm: Norm) -> Known:
    """Return the field whose energy in a norm is lowest, the first of equal ones."""
    return min(known, key=lambda each: each.field.energy(norm).total)


def complete_point(problem: Problem, found: CrossField) -> Floats:
    """Return the best point of a problem (columns,) with the angles and jumps of a field."""
    point = problem.point(found)
    # With the facet as printed, z is free in an interval, and takes the value there that makes t least.
    if problem.formulation.options.facet == "printed" and {"z", "t"} <= problem.blocks.keys():
        grid, odd = found.instance.grid, (found.p & 1).astype(np.float64)
        first, second = found.beta[grid.first], found.beta[grid.second]
        lower = np.maximum(-QUARTER, first + QUARTER * odd - QUARTER)
        upper = np.minimum(first - QUARTER * odd + QUARTER, QUARTER * odd)
        z = np.where(odd > 0, first, np.clip((first - second) / 2, lower, upper))
        point[problem.blocks["z"].slice] = z
        point[problem.blocks["t"].slice] = np.abs(first - 2 * z - second)
    return point


def field_of(problem: Problem, point: Floats) -> CrossField:
    """Return the field of a point (columns,), with angles and jumps clipped to their ranges."""
    found, instance = problem.field(point), problem.instance
    return CrossField(
        instance,
        np.clip(found.alpha, instance.alpha_lower, instance.alpha_upper),
        np.clip(found.beta, -QUARTER, QUARTER),
        np.clip(found.p, instance.p_min, instance.p_max),
    )


@dataclass(frozen=True, eq=False)
class Best:
    """The best known point of a problem with its field and provenance."""

    problem: Problem
    known: Known
    point: Floats

    @property
    def objective(self) -> float:
        """The recomputed objective."""
        return self.problem.objective_value(self.point)

    @property
    def is_feasible(self) -> bool:
        """Whether no violation exceeds FEASIBLE."""
        return self.problem.violation(self.point).worst <= FEASIBLE

    def facts(self) -> dict[str, Any]:
        """Return objective, worst violation, integrality, energy of the field, and provenance."""
        violation, provenance = self.problem.violation(self.point), self.known.provenance
        return {
            "objective": self.objective,
            "violation": max(violation.rows, violation.bounds),
            "integrality": violation.integrality,
            "solver": provenance.solver,
            "version": provenance.version,
            "seconds": provenance.seconds,
            "by": provenance.by,
            "energy_2norm": self.known.field.energy().total,
        }


def best_point(problem: Problem, known: Sequence[Known], certified: CrossField | None = None) -> Best:
    """Return the point of least objective among those of the known fields, the first of equal ones.

    certified: field of the certificate of a tightened problem, if no known field is in its windows.
    """
    points = [Best(problem, each, complete_point(problem, each.field)) for each in known]
    inside = [each for each in points if problem.windows is None or each.is_feasible]
    if not inside and certified is not None:
        return Best(problem, Known(certified, ours(METHOD)), complete_point(problem, certified))
    return min(inside, key=lambda best: best.objective)
