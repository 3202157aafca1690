"""Dual bounds beside a feasible point: one rule for building, verifying and submitting.

A solver's bound is good to its tolerances, and may lie a little above the objective of a point that is
feasible to 1e-16. So far, it is cut to that objective; further, it contradicts the point and is no bound.
"""

from __future__ import annotations

from typing import Final

PROVEN: Final = (1e-6, 1e-9)
"""How far an optimal point may lie above a dual bound: relative to its objective, plus this much."""


def slack(objective: float) -> float:
    """How far a solver's bound may lie above the optimum by its own tolerances."""
    return 1e-6 * max(1.0, abs(objective))


def contradicts(bound: float, objective: float) -> bool:
    """Whether a bound lies so far above the objective of a feasible point that it cannot be a bound."""
    return bound - objective > slack(objective)


def cut(bound: float, objective: float) -> float:
    """The bound, or the objective of the best feasible point where that is lower."""
    return min(bound, objective)


def is_proven(objective: float, bound: float) -> bool:
    """Whether a point of that objective is optimal by a dual bound: see PROVEN."""
    return objective - bound <= PROVEN[0] * abs(objective) + PROVEN[1]


def relative_gap(objective: float, bound: float) -> float:
    """Objective minus bound over the objective's size, between 0 and 1."""
    return min(max(objective - bound, 0.0) / max(abs(objective), PROVEN[1]), 1.0)
