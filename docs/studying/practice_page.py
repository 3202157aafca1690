"""What the page says of ways to a field in practice: quality and time by size, and what to take."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from crossfield.models.evaluation.hidden import Summary
from make import markdown

from . import errors, plots, solver_page
from .rows import Row
from .solving import FAILED
from .words import PRACTICE_TEXT

Kept = dict[str, list[Row]]
QUICK: Final = 1.0
"""Seconds that somebody who draws waits."""
MILP_WAY: Final = "two-stage"


def name_of(row: Row) -> str:
    """A way and its limit."""
    return f"{row['way']}, {row['limit']:g} s" if row["limit"] else str(row["way"])


@dataclass(frozen=True)
class Fare:
    """How a way fares at a size.

    seconds: median. error: degrees to hidden curves, over drawings. over: median share of energy above the
    least that any way found of the same instance. off: mean degrees from the strokes shown.
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
        """That of rows of one way and size."""
        good = [row for row in rows if row["status"] != FAILED]
        over = [row["energy_2"] / max(least[errors.case_of(row)], 1e-9) - 1 for row in good]
        return cls(
            len(rows),
            float(np.median([row["seconds"] for row in rows])),
            errors.mean_by_drawing(errors.usable(good), lambda row: row["error"]),
            float(np.median(over)) if good else float("nan"),
            float(np.mean([row["off"] for row in good])) if good else float("nan"),
            len(rows) - len(good),
            sum(row["status"] == "optimal" for row in rows),
        )

    def cells(self) -> list[str]:
        """Its cells of the table."""
        mean = "" if self.error is None else f"{self.error.mean:.1f}"
        spread = "" if self.error is None or self.error.error is None else f" +- {self.error.error:.1f}"
        notes = [f"{self.failed} without a field"] * bool(self.failed)
        notes += [f"{self.optimal} proven optimal"] * bool(self.optimal)
        return [
            f"{self.seconds:.2g}", mean + spread, solver_page.percent(self.over), f"{self.off:.1f}",
            str(self.runs), ", ".join(notes),
        ]  # fmt: skip


Fares = dict[int, dict[str, Fare]]


def fares(rows: list[Row]) -> Fares:
    """How each way fares at each size: on the instances of which every way has a row."""
    ways = {name_of(row) for row in rows}
    have: dict[Any, set[str]] = {}
    least: dict[Any, float] = {}
    for row in rows:
        case = errors.case_of(row)
        have.setdefault(case, set()).add(name_of(row))
        if row["energy_2"] is not None:
            least[case] = min(least.get(case, np.inf), row["energy_2"])
    whole = [row for row in rows if have[errors.case_of(row)] == ways]
    found: Fares = {}
    for size in sorted({int(row["size"]) for row in whole}):
        here = [row for row in whole if row["size"] == size]
        found[size] = {
            way: Fare.of([row for row in here if name_of(row) == way], least)
            for way in dict.fromkeys(map(name_of, whole))
        }
    return found


def table(found: Fares) -> str:
    """All ways at all sizes."""
    cells = [
        [str(size), f"`{way}`", *fare.cells()] for size, ways in found.items() for way, fare in ways.items()
    ]
    heads = (
        "pixels", "way", "s, median", "hidden curves, degrees", "energy above the least, median",
        "off the strokes, degrees", "fields", "",
    )  # fmt: skip
    return markdown(heads, cells)


def _mean_error(found: Fares, way: str, sizes: Iterable[int]) -> float:
    return float(np.mean([error.mean for size in sizes if (error := found[size][way].error) is not None]))


def compared(found: Fares, ways: Iterable[str]) -> list[int]:
    """The sizes at which all of these ways have an error."""
    return [size for size in found if all(way in found[size] and found[size][way].error for way in ways)]


def nearest(found: Fares, ways: list[str]) -> list[tuple[float, str]]:
    """Ways by their mean error over the sizes at which all of them have one, best first."""
    sizes = compared(found, ways)
    return sorted((_mean_error(found, way, sizes), way) for way in ways) if sizes else []


def quick_ways(found: Fares) -> list[str]:
    """The ways that take at most QUICK at the largest size."""
    last = found[max(found)]
    return [way for way, fare in last.items() if fare.seconds <= QUICK and not fare.failed]


def recommendation(kept: Kept) -> list[str]:
    """Three sentences: what to draw with, what to take for the least energy, what to leave."""
    found = fares(kept["practice"])
    if not found:
        return ["The ways to a field are not measured yet."]
    return [_for_drawing(found, kept["practice"]), _for_energy(found), _for_solvers(found, kept)]


def _for_drawing(found: Fares, rows: list[Row]) -> str:
    quick = quick_ways(found)
    if not quick:
        return f"No way takes {QUICK:g} s or less at {max(found)} pixels."
    at = compared(found, quick)
    if not at:
        return "How near the ways come to hidden curves is not measured yet."
    (error, best), *others = nearest(found, quick)
    text = (
        f"While drawing, take `{best}`: of the ways that take {QUICK:g} s or less at {max(found)} pixels it "
        f"comes nearest to hidden curves, {error:.1f} degrees on average at {_sizes(at)} pixels"
    )
    if others:
        text += f" ({others[0][0]:.1f} for `{others[0][1]}`{_paired(rows, others[0][1], best)})"
    slower = [way for way in found[max(found)] if way not in quick]
    ahead = nearest(found, [best, *slower])
    if not slower or not ahead:
        return f"{text}."
    if ahead[0][1] == best:
        return f"{text}; no slower way comes nearer."
    return f"{text}; slower, `{ahead[0][1]}` comes nearer{_paired(rows, best, ahead[0][1])}."


def _paired(rows: list[Row], before: str, after: str) -> str:
    found = errors.change(
        errors.usable(rows), lambda row: name_of(row) == before, lambda row: name_of(row) == after
    )
    if found is None:
        return ""
    return f", difference {found}{'' if found.sure else ', which may be chance'}"


def _for_energy(found: Fares) -> str:
    best = {
        size: min(ways, key=lambda way: (round(ways[way].over, 4), ways[way].seconds))
        for size, ways in found.items()
    }
    parts = [
        f"`{way}` at {_sizes(size for size in best if best[size] == way)} pixels"
        for way in dict.fromkeys(best.values())
    ]
    proven = [
        f"{fare.optimal} of {fare.runs} fields at {size}"
        for size, ways in found.items()
        for way, fare in ways.items()
        if way.startswith("prove") and fare.optimal
    ]
    text = f"For the least energy take {', '.join(parts)}"
    return f"{text}; `prove` shows {', '.join(proven)} to be optimal in its time." if proven else f"{text}."


def _for_solvers(found: Fares, kept: Kept) -> str:
    reach = solver_page.facts_in_short(kept)["reach"]
    if reach is None:
        return "No solver proves half of any rung from the file of a formulation with free jumps."
    size, pair = reach
    text = (
        "Hand files to solvers to prove optima of small grids and to compare solvers: the largest rung of "
        f"which one proves half is that of {size} pixels ({solver_page.label(pair)})"
    )
    milp = {s: fare for s, ways in found.items() for way, fare in ways.items() if way.startswith(MILP_WAY)}
    least = {s: min(fare.over for fare in found[s].values()) for s in milp}
    worse = [s for s, fare in milp.items() if np.isnan(fare.over) or fare.over > least[s] + _SAME]
    without = [s for s, fare in milp.items() if fare.failed]
    two = "the paper's two stages, begun at a field that is improved already, "
    two += f"give no field in time of some drawings at {_sizes(without)} pixels, and " if without else ""
    two += f"are above the least energy at {_sizes(worse)} pixels" if worse else (
        f"reach the least energy at {_sizes(milp)} pixels"
    )  # fmt: skip
    return f"{text}; {two}." if milp else f"{text}."


_SAME: Final = 0.005
"""Difference of median shares of energy that are the same."""


def _sizes(sizes: Iterable[int]) -> str:
    words = [str(size) for size in sizes]
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def draw(kept: Kept, pictures: Path) -> None:
    """The plot of this part."""
    panels = {
        f"{size} pixels": {
            way: (fare.seconds, fare.error.mean, fare.error.error or 0.0)
            for way, fare in ways.items()
            if fare.error is not None
        }
        for size, ways in fares(kept["practice"]).items()
    }
    if panels:
        plots.error_by_seconds(pictures / "study_practice.svg", panels)


def section(kept: Kept) -> list[str]:
    """The part of the page."""
    found = fares(kept["practice"])
    return [PRACTICE_TEXT["head"], *([table(found), PRACTICE_TEXT["plot"]] if found else [])]
