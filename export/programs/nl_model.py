"""A .nl file as CasADi reads it: the one loader, for the solvers that come with CasADi and for `verify`."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

with warnings.catch_warnings(action="ignore"):  # its import warns on newer Pythons
    import casadi as ca

from ...models.instance.grid import Bools, Floats

__all__ = ["NlModel", "ca", "read_nl"]

FEASIBLE: Final = 1e-6
"""Violation up to which a point counts as feasible: the solvers' own tolerance."""


@dataclass(frozen=True, eq=False)
class NlModel:
    """A .nl file in its own order: limits of columns (n,) and rows (m,), start (n,), integrality (n,).

    start: zeros if the file has none. problem: CasADi's expressions, `x`, `f` and `g`.
    """

    problem: dict[str, Any]
    lower: Floats
    upper: Floats
    row_lower: Floats
    row_upper: Floats
    start: Floats
    discrete: Bools

    @cached_property
    def _function(self) -> Any:
        return ca.Function("model", [self.problem["x"]], [self.problem["f"], self.problem["g"]])

    def evaluate(self, point: Floats) -> tuple[float, Floats]:
        """Objective and rows (m,) at a point (n,)."""
        objective, rows = self._function(point)
        return float(objective), np.array(rows).ravel()

    def feasible_value(self, point: Floats) -> float | None:
        """The objective at a point (n,), or None when the point is not feasible."""
        objective, rows = self.evaluate(point)
        whole = np.abs(point - np.round(point))[self.discrete].max(initial=0.0) <= FEASIBLE
        return objective if whole and self.holds(point, rows) else None

    def holds(self, point: Floats, rows: Floats) -> bool:
        """Whether a point (n,) and the values of its rows (m,) respect their limits."""
        excess = (self.lower - point, point - self.upper, self.row_lower - rows, rows - self.row_upper)
        return all(float(part.max(initial=0.0)) <= FEASIBLE for part in excess)


def read_nl(path: Path) -> NlModel:
    """The content of a .nl file."""
    read = ca.NlpBuilder()
    read.import_nl(str(path))
    problem = {"x": ca.vertcat(*read.x), "f": read.f, "g": ca.vertcat(*read.g)}
    numbers = (read.x_lb, read.x_ub, read.g_lb, read.g_ub, read.x_init)
    ends = (np.array(ca.DM(values), dtype=float).ravel() for values in numbers)
    lower, upper, row_lower, row_upper, start = ends
    discrete = np.array(read.discrete, dtype=bool)
    return NlModel(problem, lower, upper, row_lower, row_upper, start, discrete)
