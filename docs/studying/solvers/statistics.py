"""Solved runs, means over instances with bootstrap intervals, and the primal-dual integral."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Final

import numpy as np

from ..rows import Row
from .logs import Step
from .plan import BEST, LIMIT, PAIRS

GAP: Final = 1e-6
"""Gap, relative to 1 or the objective if that is more, that all solvers are asked for and that is proven."""
WITHIN: Final = 1e-5
"""Tolerated difference of an answer from a proven bound, in the same measure."""
TOO_LARGE: Final = "too large"
FAILED: Final = "failed"
DISCARDED: Final = "discarded"
"""Status of a run that is to be repeated: other work on its core, or no time left. It gets no row."""
SHIFT: Final = 1.0
PENALTY: Final = 10
SEED: Final = 20
RESAMPLES: Final = 10_000
Statistic = Callable[[np.ndarray], np.ndarray]
"""A mean along the last axis."""


def is_solved(row: Row) -> bool:
    """Whether a run ended within its CPU seconds with a proven optimum, by its status or its bound.

    `optimal-local` is what Bonmin reports, which is exact for these convex problems.
    """
    if row["objective"] is None or row["cpu"] > 1.05 * row["limit"]:
        return False
    if row["status"] in {"optimal-global", "optimal-local", "optimal"}:
        return True
    near = GAP * max(1.0, abs(row["objective"]))
    return row["status"] != "unknown" and row["bound"] is not None and row["objective"] - row["bound"] <= near


def contradicted(row: Row, energy: float, bound: float) -> bool:
    """Whether an answer contradicts the energy of a known field, or a proven bound of all fields."""
    slack = WITHIN * max(1.0, abs(energy))
    low = row["objective"] is not None and row["objective"] < bound - slack
    bounds = [row[name] for name in ("bound", "root_bound") if row[name] is not None]
    return (
        low
        or max(bounds, default=-np.inf) > energy + slack
        or (is_solved(row) and row["objective"] > energy + slack)
    )


def seconds(rows: Iterable[Row], penalty: float = 1.0) -> np.ndarray:
    """CPU seconds of runs; of unsolved ones the limit, times a penalty."""
    return np.array([row["cpu"] if is_solved(row) else penalty * row["limit"] for row in rows])


def shifted_geometric_mean(values: np.ndarray) -> np.ndarray:
    """Geometric mean of values plus one second, minus one second."""
    return np.exp(np.log(values + SHIFT).mean(axis=-1)) - SHIFT


def mean(values: np.ndarray) -> np.ndarray:
    """The mean: PAR-10 of seconds with that penalty."""
    return values.mean(axis=-1)


def interval(values: np.ndarray, statistic: Statistic) -> tuple[float, float]:
    """Percentile bootstrap interval of 95 % over instances, with a fixed seed."""
    rng = np.random.default_rng(SEED)
    chosen = values[rng.integers(0, len(values), (RESAMPLES, len(values)))]
    low, high = np.percentile(statistic(chosen), [2.5, 97.5])
    return float(low), float(high)


def gap(bound: float | None, objective: float | None) -> float:
    """Gap of a step between 0 and 1: the difference relative to the larger size; 1 without a value."""
    if bound is None or objective is None or bound * objective < 0:
        return 1.0
    largest = max(abs(bound), abs(objective))
    return min(1.0, max(0.0, objective - bound) / largest) if largest else 0.0


def integral(steps: Iterable[Step], limit: float, *, solved: bool) -> float:
    """Integral of the gap over the seconds up to the limit (Berthold, 2013): 1 before the first step.

    The last step is the end of the run: afterwards the gap is 0 if it is solved, else as it is there.
    """
    points = [(0.0, 1.0), *((min(time, limit), gap(bound, best)) for time, bound, best in steps)]
    points[-1] = points[-1][0], 0.0 if solved else points[-1][1]
    points.append((limit, 0.0))
    return sum(at * max(0.0, later - time) for (time, at), (later, _) in pairwise(points))


def best_pairs(rows: Iterable[Row], limit: float = LIMIT) -> list[tuple[str, str]]:
    """The pairs with most solved instances, then the smallest PAR-10, in cold runs without turns."""
    of: dict[tuple[str, str], list[Row]] = {pair: [] for pair in PAIRS}
    for row in rows:
        pair = row["formulation"], row["solver"]
        if pair in of and (row["start"], row["turns"], row["limit"]) == ("cold", 0, limit):
            of[pair].append(row)
    ran = {pair: mine for pair, mine in of.items() if mine}
    return sorted(ran, key=lambda pair: (-sum(map(is_solved, ran[pair])), mean(seconds(ran[pair], PENALTY))))[
        :BEST
    ]
