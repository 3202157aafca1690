"""Errors of fields on hidden curves and true crosses: paired differences, by drawing, and gaps."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np
from crossfield.models.instance.instance import SKEW_WEIGHT, STROKE_WEIGHT
from scipy.stats import spearmanr

from .hidden import Summary, summary
from .rows import Row

CLOSE: Final = 1e-3
"""Relative gap of a proof up to which its field counts as the optimum."""
Kind = Callable[[Row], bool]


def case_of(row: Row) -> tuple[Any, ...]:
    """The instance of a field, without its weights: drawing, size, curve, noise and its seed."""
    noise = (row["noise"], row["seed"]) if row["hidden"] < 0 else ()
    return (row["instance"], row["size"], row["hidden"], *noise)


def is_surface(row: Row) -> bool:
    """Whether the row is about a surface with a known answer."""
    return bool(row["hidden"] < 0)


def is_default(row: Row) -> bool:
    """Whether the row has the default weights."""
    return bool(row["w_strokes"] == STROKE_WEIGHT and row["w_beta"] == SKEW_WEIGHT)


def rows_with_error(rows: Iterable[Row]) -> list[Row]:
    """The rows with a field and its error."""
    return [row for row in rows if row["error"] is not None]


def mean_by_drawing(rows: Iterable[Row], value: Callable[[Row], float]) -> Summary | None:
    """Count of drawings, mean over them, and its standard error."""
    of: dict[str, list[float]] = defaultdict(list)
    for row in rows:
        of[row["instance"]].append(value(row))
    return summary(np.array([np.mean(errors) for errors in of.values()]))


@dataclass(frozen=True)
class Change:
    """Effect of a change on the error: degrees, mean over drawings and standard error, and pairs."""

    mean: float
    error: float
    drawings: int
    pairs: int

    @property
    def sure(self) -> bool:
        """Whether the effect exceeds two standard errors."""
        return abs(self.mean) > 2 * self.error

    def __str__(self) -> str:
        return f"{self.mean:+.2f} ± {self.error:.2f}"

    @property
    def cell(self) -> str:
        """The effect in a table, bold beyond two standard errors."""
        return f"**{self}**" if self.sure else str(self)

    @property
    def range(self) -> str:
        """The interval of two standard errors around the mean, of 95 % confidence."""
        return f"{self.mean - 2 * self.error:+.1f} to {self.mean + 2 * self.error:+.1f}"


def change(rows: Iterable[Row], before: Kind, after: Kind) -> Change | None:
    """The error after minus the error before, for the same cases; None for fewer than three drawings."""
    old, new = defaultdict[Any, list[float]](list), defaultdict[Any, list[float]](list)
    for row in rows:
        for kind, errors in ((before, old), (after, new)):
            if kind(row):
                errors[case_of(row)].append(row["error"])
    of: dict[str, list[float]] = defaultdict(list)
    for case in old.keys() & new.keys():
        of[case[0]].append(float(np.mean(new[case]) - np.mean(old[case])))
    effect = summary(np.array([np.mean(of[name]) for name in sorted(of)]))
    if effect is None or effect.count < 3:
        return None
    return Change(effect.mean, effect.error, effect.count, sum(map(len, of.values())))


def best_energies(rows: Iterable[Row]) -> dict[tuple[Any, ...], tuple[float, bool]]:
    """Least 2-norm energy of every case with default weights, and whether it is the proven optimum."""
    rows = list(rows)
    least: dict[tuple[Any, ...], float] = {}
    for row in rows:
        case = case_of(row)
        least[case] = min(least.get(case, np.inf), row["energy_2"])
    bound = proven_bounds(rows)
    return {
        case: (energy, energy - bound.get(case, -np.inf) <= CLOSE * energy) for case, energy in least.items()
    }


def proven_bounds(rows: Iterable[Row]) -> dict[tuple[Any, ...], float]:
    """Greatest lower bound of the 2-norm energy of every case that `prove` found."""
    bound: dict[tuple[Any, ...], float] = {}
    for row in rows:
        if row["way"] == "prove" and row["norm"] == 2 and row["bound"] is not None:
            bound[case_of(row)] = max(bound.get(case_of(row), -np.inf), row["bound"])
    return bound


def gaps_to_bounds(rows: Iterable[Row], way: str) -> list[float]:
    """Relative excess of each field of a way, with default weights, over the proven bound of its case."""
    usual = [row for row in rows_with_error(rows) if is_default(row)]
    bound = proven_bounds(usual)
    return [row["energy_2"] / bound[case_of(row)] - 1 for row in usual if row["way"] == way]


def gaps(rows: Iterable[Row]) -> list[tuple[Row, float]]:
    """Each field with default weights, for cases with a proven optimum, with its relative gap to it."""
    usual = [row for row in rows_with_error(rows) if is_default(row)]
    best = best_energies(usual)
    return [
        (row, (row["energy_2"] - best[case_of(row)][0]) / max(best[case_of(row)][0], 1e-9))
        for row in usual
        if best[case_of(row)][1]
    ]


def differences(gaps: list[tuple[Row, float]]) -> list[tuple[Row, float, float]]:
    """Each field with its gap, and its error minus that of its instance's field with the lowest energy."""
    least: dict[Any, Row] = {}
    for row, _ in gaps:
        case = case_of(row)
        if case not in least or row["energy_2"] < least[case]["energy_2"]:
            least[case] = row
    return [(row, gap, row["error"] - least[case_of(row)]["error"]) for row, gap in gaps]


def quartiles(x: Any, y: Any, bins: int = 12) -> tuple[list[float], ...]:
    """Medians of x, and quartiles of y, in bins of x of FEW points or more.

    The first bin has no gap, others are logarithmic. x: gaps, not negative.
    """
    x, y = np.asarray(x, float), np.asarray(y, float)
    if not len(x):
        return [], [], [], []
    ends = np.concatenate(
        [[0.0, _NO_GAP], np.geomspace(5 * _NO_GAP, max(1.01 * x.max(), 10 * _NO_GAP), bins)]
    )
    parts = [(x >= a) & (x < b) for a, b in pairwise(ends)]
    inside = [part for part in parts if part.sum() >= FEW]
    low, middle, high = ([float(np.percentile(y[part], share)) for part in inside] for share in (25, 50, 75))
    return [float(np.median(x[part])) for part in inside], low, middle, high


FEW: Final = 5
_NO_GAP: Final = 1e-4


def correlation(gaps: list[tuple[Row, float]]) -> Summary | None:
    """Rank correlation of gap and error within a case: its mean over drawings, with standard error."""
    cases: dict[Any, list[tuple[float, float]]] = defaultdict(list)
    for row, gap in gaps:
        cases[case_of(row)].append((round(gap, 6), row["error"]))
    of: dict[str, list[float]] = defaultdict(list)
    for case, points in sorted(cases.items(), key=lambda item: str(item[0])):
        gap, error = np.array(points).T
        if len(set(gap)) > 2 and len(set(error)) > 2:
            of[case[0]].append(float(spearmanr(gap, error).statistic))
    return summary(np.array([np.mean(values) for values in of.values()]))
