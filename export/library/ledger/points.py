"""Known fields and certificates, and the points of every formulation with a field.

A field (angles and jumps) gives a point of any formulation: every other column has its best value, without
solver tolerances.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ....models.field.field import CrossField, Norm
from ....models.formulations.problem import Problem
from ....models.instance.angles import QUARTER
from ....models.instance.domain import Floats
from ....models.instance.instance import Instance
from ....models.proof.certificate import read_certificate
from ....models.proof.descent.record import Claim
from ....models.storage import temporary_folder
from ...formats.registry import program_version
from .grades import ACCEPTED_VIOLATION

METHOD: Final = "prove"
ROLES: Final = {"baseline": ".baseline", "least_mixed": ".mixed", "least_1": ".l1", "least_2": ""}
"""Roles of known fields, and the suffixes of their files; equal fields share the last file."""
_ORIGIN: Final = ("solver", "version", "seconds", "by")


@dataclass(frozen=True, eq=False)
class KnownField:
    """A known field, with solver and version that found it; seconds and submitter of a submitted one."""

    field: CrossField
    solver: str
    version: str
    seconds: float | None = None
    by: str | None = None

    @classmethod
    def of(cls, field: CrossField, facts: Mapping[str, Any]) -> KnownField:
        """Return a field with the origin that a document states."""
        return cls(field, **{key: facts[key] for key in _ORIGIN})

    @property
    def origin(self) -> dict[str, Any]:
        """Its origin, for a document."""
        return {key: getattr(self, key) for key in _ORIGIN}


def finder(method: str) -> tuple[str, str]:
    """Return crossfield with a method, and its version, as the solver that found something."""
    name, _, version = program_version().partition(" ")
    return f"{name} ({method})", version


@dataclass(frozen=True, eq=False)
class CheckedCertificate:
    """A checked certificate: norm, field, name and bytes of its file, and status, energy and bound."""

    norm: Norm
    known: KnownField
    file: str
    data: bytes
    facts: dict[str, Any]

    @classmethod
    def of(cls, claim: Claim, file: str, data: bytes) -> CheckedCertificate:
        """Return it as the checker found it."""
        facts = {key: getattr(claim, key) for key in ("status", "energy", "bound")}
        return cls(claim.norm, KnownField(claim.field, *finder(METHOD)), file, data, facts)


def certificate_file(instance: str, norm: Norm) -> str:
    """Return the name of the file of a certificate that a build made."""
    return f"{instance}{ROLES[f'least_{norm}']}.certificate.npz"


def check_certificate(data: bytes, file: str, on: Instance) -> CheckedCertificate:
    """Check the bytes of a certificate of an instance. Raises as `read_certificate`."""
    with temporary_folder() as folder:
        path = folder / file
        path.write_bytes(data)
        return CheckedCertificate.of(read_certificate(path, on=on), file, data)


def least_energy(known: Sequence[KnownField], norm: Norm) -> KnownField:
    """Return the field whose energy in a norm is lowest, the first of equal ones."""
    return min(known, key=lambda field: field.field.energy(norm).total)


def complete_point(problem: Problem, field: CrossField) -> Floats:
    """Return the best point of a problem (columns,) with the angles and jumps of a field."""
    point = problem.point(field)
    # With the facet as printed, z is free in an interval, and takes the value there that makes t least.
    if problem.formulation.options.facet == "printed" and {"z", "t"} <= problem.blocks.keys():
        domain, odd = field.instance.domain, (field.p & 1).astype(np.float64)
        first, second = field.beta[domain.first], field.beta[domain.second]
        lower = np.maximum(-QUARTER, first + QUARTER * odd - QUARTER)
        upper = np.minimum(first - QUARTER * odd + QUARTER, QUARTER * odd)
        z = np.where(odd > 0, first, np.clip((first - second) / 2, lower, upper))
        point[problem.blocks["z"].slice] = z
        point[problem.blocks["t"].slice] = np.abs(first - 2 * z - second)
    return point


def clipped_field(problem: Problem, point: Floats) -> CrossField:
    """Return the field of a point (columns,), with angles and jumps clipped to their ranges."""
    field, instance = problem.field(point), problem.instance
    return CrossField(
        instance,
        np.clip(field.alpha, instance.alpha_lower, instance.alpha_upper),
        np.clip(field.beta, -QUARTER, QUARTER),
        np.clip(field.p, instance.p_min, instance.p_max),
    )


@dataclass(frozen=True, eq=False)
class BestPoint:
    """The best known point of a problem with its field."""

    problem: Problem
    known: KnownField
    point: Floats

    @property
    def objective(self) -> float:
        """The recomputed objective."""
        return self.problem.objective_value(self.point)


def best_point(
    problem: Problem, known: Sequence[KnownField], certified: CrossField | None = None
) -> BestPoint:
    """Return the point of least objective among those of the known fields, the first of equal ones.

    certified: field of the certificate of a tightened problem, if no known field is in its windows.
    """
    points = [BestPoint(problem, field, complete_point(problem, field.field)) for field in known]
    inside = [
        best
        for best in points
        if problem.windows is None or problem.violation(best.point).worst <= ACCEPTED_VIOLATION
    ]
    if not inside and certified is not None:
        proven = KnownField(certified, *finder(METHOD))
        return BestPoint(problem, proven, complete_point(problem, certified))
    return min(inside, key=lambda best: best.objective)
