"""Tables and sentences on methods in practice: error, energy and time by size, and recommendations."""

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
QUICK: Final = 1.0
"""Seconds for which somebody who draws is willing to wait."""
MILP_WAY: Final = "two-stage"


def name_of(row: Row) -> str:
    """A way and its limit."""
    return f"{row['way']}, {row['limit']:g} s" if row["limit"] else str(row["way"])


@dataclass(frozen=True)
class Fare:
    """Results of a way at a size.

    seconds: median. error: degrees to hidden curves, over drawings. over: median relative excess of energy
    over the least of any way for the same instance. off: mean degrees from the strokes shown.
    """

    runs: int
    seconds: float
    error: Summary | None
    over: float
    off: float
    failed: int
    optimal: int

    @classmethod
    def of(cls, rows: list[Row], least: dict[Any, float]) -> Fare:
        """Results from the rows of one way and size."""
        good = [row for row in rows if row["status"] != FAILED]
        over = [row["energy_2"] / max(least[errors.case_of(row)], 1e-9) - 1 for row in good]
        return cls(
            len(rows),
            float(np.median([row["seconds"] for row in rows])),
            errors.mean_by_drawing(errors.rows_with_error(good), lambda row: row["error"]),
            float(np.median(over)) if good else float("nan"),
            float(np.mean([row["off"] for row in good])) if good else float("nan"),
            len(rows) - len(good),
            sum(row["status"] == "optimal" for row in rows),
        )

    def cells(self) -> list[str]:
        """Its cells of the table."""
        mean = "" if self.error is None else f"{self.error.mean:.1f}"
        spread = "" if self.error is None or self.error.error is None else f" ± {self.error.error:.1f}"
        notes = [f"{self.failed} without a field"] * bool(self.failed)
        notes += [f"{self.optimal} proven optimal"] * bool(self.optimal)
        return [
            f"{self.seconds:.2g}", mean + spread, percent(self.over), f"{self.off:.1f}",
            str(self.runs), ", ".join(notes),
        ]  # fmt: skip


Fares = dict[int, dict[str, Fare]]


def fares(rows: list[Row]) -> Fares:
    """Results of each way at each size, on the instances for which every way has a row."""
    ways = {name_of(row) for row in rows}
    have: dict[Any, set[str]] = {}
    least: dict[Any, float] = {}
    for row in rows:
        case = errors.case_of(row)
        have.setdefault(case, set()).add(name_of(row))
        if row["energy_2"] is not None:
            least[case] = min(least.get(case, np.inf), row["energy_2"])
    whole = [row for row in rows if have[errors.case_of(row)] == ways]
    by_size: Fares = {}
    for size in sorted({int(row["size"]) for row in whole}):
        here = [row for row in whole if row["size"] == size]
        by_size[size] = {
            way: Fare.of([row for row in here if name_of(row) == way], least)
            for way in dict.fromkeys(map(name_of, whole))
        }
    return by_size


def full_table(by_size: Fares) -> Table:
    """All methods at all sizes."""
    cells = [
        [str(size), f"`{way}`", *fare.cells()] for size, ways in by_size.items() for way, fare in ways.items()
    ]
    return (
        "pixels", "method", "s, median", "hidden curves, degrees", "energy above the least, median",
        "from the strokes, degrees", "fields", "notes",
    ), cells  # fmt: skip


def short_table(by_size: Fares) -> Table:
    """Error and seconds: a row for each method, a column for each size."""
    ways = list(dict.fromkeys(way for of in by_size.values() for way in of))
    cells = []
    for way in ways:
        fares = [of[way] for of in by_size.values()]
        cells.append([f"`{way}`", *(f"{fare.cells()[1]}; {fare.seconds:.2g} s" for fare in fares)])
    return ("method", *(f"{size} pixels" for size in by_size)), cells


def ranking(ways: dict[str, Fare], seconds: tuple[float, float] = (0.0, np.inf)) -> list[str]:
    """Ways that take more than the first and at most the second seconds, smallest error first."""
    candidates = [
        (fare.error.mean, way)
        for way, fare in ways.items()
        if fare.error is not None and not fare.failed and seconds[0] < fare.seconds <= seconds[1]
    ]
    return [way for _, way in sorted(candidates)]


def recommendation(rows_of: RowsByPart) -> list[str]:
    """Two sentences: methods for drawing, and for the least energy."""
    by_size = fares(rows_of["practice"])
    if not by_size:
        return ["The methods are not measured yet."]
    return [_for_drawing(by_size, rows_of["practice"]), _for_energy(by_size)]


def _for_drawing(by_size: Fares, rows: list[Row]) -> str:
    """Recommended ways for drawing at each size, the next best, and slower ways with a smaller error."""
    order = {size: ranking(ways, (0.0, QUICK)) for size, ways in by_size.items()}
    best = {size: ways[0] for size, ways in order.items() if ways}
    if not best:
        return f"No way that takes {QUICK:g} s or less is measured yet."
    mean = float(np.mean([_error(by_size, size, way) for size, way in best.items()]))
    text = (
        f"On crossfield's own drawings, use {_grouped(best)} while drawing: of methods that take {QUICK:g} "
        f"s or less, it has the smallest mean error at hidden curves, {mean:.1f} degrees on average"
    )
    others = [way for ways in order.values() for way in ways[1:2]]
    if others:
        second = max(set(others), key=lambda way: (others.count(way), way))
        at = [size for size, way in best.items() if way != second and second in order[size]]
        text += f" ({_paired(rows, best, second, at)} compared with `{second}`)"
    slower = {size: ranking(by_size[size], (QUICK, np.inf))[:1] for size in best}
    nearer = {
        s: way
        for s, ways in slower.items()
        for way in ways
        if _error(by_size, s, way) < _error(by_size, s, best[s])
    }
    ahead = [
        f"`{nearer[size]}` at {size} pixels ({_paired(rows, nearer, best[size], [size])})" for size in nearer
    ]
    text += f"; among slower ones, {', '.join(ahead)} is better" if ahead else "; no slower method is better"
    none = {size: way for size in by_size if size not in best for way in ranking(by_size[size])[:1]}
    rest = [
        f"at {s} pixels, where all take longer, it is `{way}` with {by_size[s][way].seconds:.2g} s"
        for s, way in none.items()
    ]
    return f"{'; '.join([text, *rest])}."


def _error(by_size: Fares, size: int, way: str) -> float:
    error = by_size[size][way].error
    return np.inf if error is None else error.mean


def _grouped(best: dict[int, str]) -> str:
    """Ways by the sizes for which they are best."""
    return ", ".join(
        f"`{way}` at {series(size for size in best if best[size] == way)} pixels"
        for way in dict.fromkeys(best.values())
    )


def _paired(rows: list[Row], after: dict[int, str], before: str, sizes: list[int]) -> str:
    """The paired difference of errors at some sizes, in words."""
    chosen = [row for row in errors.rows_with_error(rows) if row["size"] in sizes]
    effect = errors.change(
        chosen, lambda row: name_of(row) == before, lambda row: name_of(row) == after[int(row["size"])]
    )
    if effect is None:
        return "not measured yet"
    return f"{effect} degrees{'' if effect.sure else ', which may be chance,'}"


def _for_energy(by_size: Fares) -> str:
    best = {
        size: min(ways, key=lambda way: (round(ways[way].over, 4), ways[way].seconds))
        for size, ways in by_size.items()
    }
    proven = [
        f"{fare.optimal} of {fare.runs} fields at {size}"
        for size, ways in by_size.items()
        for way, fare in ways.items()
        if way.startswith("prove") and fare.optimal
    ]
    text = f"For the lowest energy, use {_grouped(best)}"
    return f"{text}; `prove` proves {', '.join(proven)} optimal within its time." if proven else f"{text}."


def below_all_others(rows: list[Row], way: str) -> tuple[int, int]:
    """Number of fields for which a method has less energy than every other one, and number of all."""
    cases: dict[Any, tuple[list[float], list[float]]] = defaultdict(lambda: ([], []))
    for row in rows:
        if row["energy_2"] is not None:
            cases[errors.case_of(row)][row["way"] != way].append(row["energy_2"])
    both = [(min(own), min(others)) for own, others in cases.values() if own and others]
    return sum(own < others * (1 - _SAME) for own, others in both), len(both)


_SAME: Final = 1e-4
"""Relative difference of energies that count as equal."""


def draw(rows_of: RowsByPart, pictures: Path) -> None:
    """The plot of this part."""
    panels = {
        f"{size} pixels": {
            way: (fare.seconds, fare.error.mean, fare.error.error or 0.0)
            for way, fare in ways.items()
            if fare.error is not None
        }
        for size, ways in fares(rows_of["practice"]).items()
    }
    if panels:
        plots.error_by_seconds(pictures / "evidence_practice.svg", panels)


def sentences(rows_of: RowsByPart) -> dict[str, str]:
    """The sentences of this part by name."""
    lower, tried = below_all_others(rows_of["practice"], MILP_WAY)
    text = f"`{MILP_WAY}` finds less energy than all other methods for {lower} of {tried} fields."
    return {"two_stages": text}


def tables(rows_of: RowsByPart) -> dict[str, Table]:
    """The tables of this part by name."""
    by_size = fares(rows_of["practice"])
    return {"practice": full_table(by_size), "practice-in-short": short_table(by_size)}
