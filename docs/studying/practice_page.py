"""Tables and sentences on methods in practice: error and energy by size."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from . import errors, plots
from .hidden import Summary
from .rows import FAILED, Row, Table
from .wording import percent, series

RowsByPart = dict[str, list[Row]]
MILP_WAY: Final = "two-stage"
_SAME: Final = 1e-4
"""Relative difference of energies that count as equal."""


def name_of(row: Row) -> str:
    """A method and its limit."""
    return f"{row['way']}, {row['limit']:g} s" if row["limit"] else str(row["way"])


@dataclass(frozen=True)
class MethodResults:
    """Results of a method at a size.

    error: degrees to hidden curves, over drawings. excess: median relative excess of energy over the least of
    any method for the same instance. off: mean degrees from the strokes shown. optimal: number of proofs.
    """

    fields: int
    error: Summary
    excess: float
    off: float
    optimal: int

    @classmethod
    def of(cls, rows: list[Row], least: dict[Any, float]) -> MethodResults:
        """Results from the rows of one method and size."""
        excess = [row["energy_2"] / max(least[errors.case_of(row)], 1e-9) - 1 for row in rows]
        error = errors.mean_by_drawing(errors.rows_with_error(rows), lambda row: row["error"])
        if error is None:
            raise ValueError("a method without an error at hidden curves")
        off = float(np.mean([row["off"] for row in rows]))
        optimal = sum(row["status"] == "optimal" for row in rows)
        return cls(len(rows), error, float(np.median(excess)), off, optimal)


Results = dict[int, dict[str, MethodResults]]


def results(rows: list[Row]) -> Results:
    """Results of each method at each size."""
    rows = [row for row in rows if row["status"] != FAILED]
    least: dict[Any, float] = {}
    groups: dict[int, dict[str, list[Row]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        case = errors.case_of(row)
        least[case] = min(least.get(case, np.inf), row["energy_2"])
        groups[int(row["size"])][name_of(row)].append(row)
    return {
        size: {method: MethodResults.of(mine, least) for method, mine in methods.items()}
        for size, methods in sorted(groups.items())
    }


def full_table(by_size: Results) -> Table:
    """All methods at all sizes."""
    cells = [
        [
            str(size), method, str(of.error), percent(of.excess), f"{of.off:.1f}", str(of.fields),
            str(of.optimal),
        ]
        for size, methods in by_size.items()
        for method, of in methods.items()
    ]  # fmt: skip
    return (
        "pixels", "method", "hidden curves, degrees", "energy above the least, median",
        "from the strokes, degrees", "fields", "proven optimal",
    ), cells  # fmt: skip


def smallest_error(rows: list[Row]) -> str:
    """Sentence on the two methods with the smallest mean errors over all sizes."""
    by_size = results(rows)
    mean = {
        method: float(np.mean([of[method].error.mean for of in by_size.values()]))
        for method in next(iter(by_size.values()))
    }
    best, second, *_ = sorted(mean, key=mean.__getitem__)
    effect = errors.change(
        errors.rows_with_error(rows), lambda row: name_of(row) == second, lambda row: name_of(row) == best
    )
    return (
        f"On our own drawings, at {min(by_size)} to {max(by_size)} pixels, `{best}` has the smallest error, "
        f"{mean[best]:.1f} degrees, and differs from `{second}`, the next, by {effect}."
    )


def lowest_energy(rows: list[Row]) -> str:
    """Sentence on the fields that are proven optimal, and on the energies of `two-stage`."""
    proven = [
        f"{of.optimal} of {of.fields} fields at {size} pixels"
        for size, methods in results(rows).items()
        for of in methods.values()
        if of.optimal
    ]
    lower, tried = below_all_others(rows, MILP_WAY)
    return (
        f"`prove` proves {series(proven)} optimal. "
        f"`{MILP_WAY}` is below all other methods for {lower} of {tried} fields."
    )


def below_all_others(rows: list[Row], way: str) -> tuple[int, int]:
    """Number of fields for which a method has less energy than every other one, and number of all."""
    cases: dict[Any, tuple[list[float], list[float]]] = defaultdict(lambda: ([], []))
    for row in rows:
        if row["energy_2"] is not None:
            cases[errors.case_of(row)][row["way"] != way].append(row["energy_2"])
    both = [(min(own), min(others)) for own, others in cases.values() if own and others]
    return sum(own < others * (1 - _SAME) for own, others in both), len(both)


def draw(rows_of: RowsByPart, pictures: Path) -> None:
    """The plot of this part."""
    by_size = results(rows_of["practice"])
    lines = {
        method: (list(map(float, by_size)), [of[method].error.mean for of in by_size.values()])
        for method in next(iter(by_size.values()))
    }
    axes = ("pixels of the longer side", "error at hidden curves, degrees")
    plots.lines_by_value(pictures / "evidence_practice.svg", {axes: lines})


def sentences(rows_of: RowsByPart) -> dict[str, str]:
    """The sentences of this part by name."""
    rows = rows_of["practice"]
    spreads = [of.error.error for methods in results(rows).values() for of in methods.values()]
    return {
        "smallest_error": smallest_error(rows),
        "lowest_energy": lowest_energy(rows),
        "spreads": f"{min(spreads):.1f} to {max(spreads):.1f}",
    }


def tables(rows_of: RowsByPart) -> dict[str, Table]:
    """The tables of this part by name."""
    return {"practice": full_table(results(rows_of["practice"]))}
