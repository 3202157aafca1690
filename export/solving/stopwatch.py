"""Seconds of a run by stage, complete up to rounding."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from ...models.processes.deadline import Clock


@dataclass
class Stopwatch:
    """The seconds of consecutive stages, to 3 decimals: their sum is the whole time until the last lap."""

    clock: Clock = time.perf_counter
    stages: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Begin the first stage."""
        self._begin = self.clock()

    def lap(self, stage: str) -> None:
        """End a stage and begin the next one; the rounding error goes to the next one too."""
        passed = self.clock() - self._begin - sum(self.stages.values())
        self.stages[stage] = round(self.stages.get(stage, 0.0) + max(passed, 0.0), 3)
