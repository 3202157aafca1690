"""Known fields, and the complete points of every formulation that follow from them.

A point of any formulation comes from a field (angles and jumps): every other column then has its best value,
without solver tolerances.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ....models.field.field import CrossField
from ....models.formulations.problem import Problem
from ....models.instance.grid import Floats
from ....models.instance.instance import QUARTER, Instance
from ....models.proof.dual_start import search
from ....models.search.greedy import greedy_field
from ....models.search.pinned import pinned
from ...formats.registry import generator

_ROUNDS: Final = 8


@dataclass(frozen=True)
class Provenance:
    """Origin of a field: solver and version, and for a submitted one seconds and submitter."""

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


def baseline_field(instance: Instance) -> Known:
    """Return the greedy field, whose jumps are the data of `qp-fixed` and therefore fixed."""
    return Known(pinned(greedy_field(instance)), ours("greedy"))


def searched_field(instance: Instance) -> Known:
    """Return a field of low 2-norm energy, by a fixed amount of work."""
    return Known(pinned(search(instance, rounds=_ROUNDS, jobs=1).field), ours("search"))


def least_energy(known: Sequence[Known], norm: int) -> Known:
    """Return the field whose energy in a norm is lowest, the first of equal ones."""
    return min(known, key=lambda each: each.field.energy(2 if norm == 2 else 1).total)


def complete_point(problem: Problem, found: CrossField) -> Floats:
    """Return the best point of a problem (columns,) with the angles and jumps of a field.

    As `Problem.point`; with the facet as printed, z is free in an interval, and takes the value there that
    makes t least.
    """
    point = problem.point(found)
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
    """Return the field of a point (columns,), with angles and jumps clipped into their ranges."""
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
        """The objective, recomputed from the declaration."""
        return self.problem.objective_value(self.point)

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


def best_point(problem: Problem, known: Sequence[Known]) -> Best:
    """Return the point of least objective among those of the known fields, the first of equal ones."""
    points = [Best(problem, each, complete_point(problem, each.field)) for each in known]
    return min(points, key=lambda best: best.objective)
