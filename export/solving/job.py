"""What a solver is asked to do, and how its run ended."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from ...models.errors import InputError
from ...models.instance.grid import Floats
from ...models.processes.deadline import Deadline
from ...models.processes.side_by_side import checked

if TYPE_CHECKING:  # the driver of a solver needs no formulations
    from ...models.formulations.problem import Problem

LEAST: Final = 0.01
"""Seconds of a solve for which nothing is left: still the point that it starts from comes back."""


@dataclass(frozen=True)
class Limits:
    """Seconds of a solve, files included; relative gap at which a discrete search may stop; threads.

    With 0 threads the solver chooses. Raises InputError for what cannot be.
    """

    seconds: float = 60.0
    gap: float = 1e-6
    threads: int = 0

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not (0 < self.seconds < np.inf and 0 <= self.gap < np.inf):
            raise InputError(
                f"a time limit of {self.seconds} s and a gap of {self.gap} cannot be; "
                "give a positive number of seconds, and a gap that is not negative"
            )
        checked(self.threads, "threads", least=0)

    def until(self, deadline: Deadline) -> Limits:
        """The same with what is left until then."""
        return replace(self, seconds=max(deadline.left(), LEAST))


class Job(NamedTuple):
    """What a solver is to do: read `model`, a file of `problem`; leave `solution` and `log` by the deadline.

    solver: its name. start: a complete point (columns,), or None.
    """

    solver: str
    model: Path
    solution: Path
    log: Path
    problem: Problem
    start: Floats | None
    limits: Limits
    deadline: Deadline


class RunEnd(NamedTuple):
    """What the solution file does not say: whether the user interrupted, and the dual bound, if any."""

    interrupted: bool
    bound: float | None = None
