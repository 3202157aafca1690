"""Description of a solver package in memory, and functions that the modules of packages share."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ...models.formulations.problem import Problem
from ...models.instance.domain import Floats
from ..statuses import Status

Values = Mapping[str, float] | Sequence[float] | Floats


class Claims(NamedTuple):
    """Title, status, objective and bound of a model, and whether it has values."""

    title: str
    status: Status
    words: str
    has_point: bool
    objective: float | None = None
    bound: float | None = None


@dataclass(frozen=True)
class Package:
    """A package that solves problems in memory.

    title: its name for people. model: its class of models, with the module. holds, can_hold: the problems
    that it holds, in words and as a test. remedy: advice for other problems. build: makes a model. claims,
    values: of a solved model; values by name, or in the order of the problem's columns. solve: the call that
    solves a model. lifts: whether products are lifted if it cannot hold them.
    """

    title: str
    model: str
    holds: str
    can_hold: Callable[[Problem], bool]
    remedy: str
    build: Callable[..., Any]
    claims: Callable[[Any], Claims]
    values: Callable[[Any, Problem], Values]
    solve: str
    lifts: bool = False

    @property
    def name(self) -> str:
        """Name of the package that is installed and imported."""
        return self.model.partition(".")[0]

    def is_model(self, thing: object) -> bool:
        """Whether a thing is a model of the package; it cannot be one before the package is imported."""
        module, _, name = self.model.rpartition(".")
        return module in sys.modules and isinstance(thing, getattr(sys.modules[module], name))


def title_of(problem: Problem) -> str:
    """The name of a model: of instance and formulation, and the stamp that identifies the problem."""
    return f"{problem.instance.name} {problem.name} {problem.stamp}"


def degrees(objective: int, rows: int) -> Callable[[Problem], bool]:
    """A test for problems up to these degrees of the objective and the rows."""
    return lambda problem: problem.objective_degree <= objective and problem.row_degree <= rows
