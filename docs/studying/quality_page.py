"""Tables and sentences on energies and errors of fields."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
from crossfield.models.instance.instance import SKEW_WEIGHT, STROKE_WEIGHT

from . import errors, plots
from .errors import Change, Kind, change, is_default, is_surface, rows_with_error
from .rows import Row, Table
from .wording import percent

RowsByPart = dict[str, list[Row]]


def made_by(way: str, *, norm: int = 2, strokes: float = STROKE_WEIGHT, skew: float = SKEW_WEIGHT) -> Kind:
    """Return a test for rows of that way, norm and weights; of several searches, the longest is meant."""

    def is_it(row: Row) -> bool:
        same = (row["w_strokes"], row["w_beta"], row["norm"]) == (strokes, skew, norm)
        return same and row["way"] == way and not (way == "search" and row["limit"] < _LONGER)

    return is_it


_LONGER: Final = 2.0
NEAR: Final = 0.2
"""Gap up to which a field is near the optimum."""

CHANGES: Final[dict[str, tuple[str, Kind, Kind]]] = {
    "improve": ("greedy, then improved", made_by("greedy"), made_by("improved")),
    "search": ("greedy, then the search of 3 s", made_by("greedy"), made_by("search")),
    "optimum": ("greedy, then the best that `prove` finds", made_by("greedy"), made_by("prove")),
    "norm": ("the best in the 2-norm, then in the 1-norm", made_by("prove"), made_by("prove", norm=1)),
    "strokes": (
        "the best at weight 1 of the strokes, then 20", made_by("prove", strokes=1.0), made_by("prove"),
    ),
    "strokes greedy": (
        "greedy at weight 1 of the strokes, then 20", made_by("greedy", strokes=1.0), made_by("greedy"),
    ),
    "more strokes": (
        "the best at weight 20 of the strokes, then 80", made_by("prove"), made_by("prove", strokes=80.0),
    ),
    "skew": ("the best at weight 1e-6 of the skew, then 1", made_by("prove"), made_by("prove", skew=1.0)),
    "power": ("greedy, then the power field", made_by("greedy"), made_by("power")),
    "polyvector": ("greedy, then the PolyVector field", made_by("greedy"), made_by("polyvector")),
    "bend": ("greedy, then the bend field", made_by("greedy"), made_by("bend")),
}  # fmt: skip
"""Changes that may improve a field: in words, before, after."""


def changes(rows: list[Row], *, surfaces: bool) -> dict[str, Change | None]:
    """Effect of each change on the error, of drawings or of surfaces."""
    chosen = [row for row in rows_with_error(rows) if is_surface(row) == surfaces]
    return {name: change(chosen, before, after) for name, (_, before, after) in CHANGES.items()}


def changes_table(rows: list[Row]) -> Table:
    """All changes, for hidden curves and surfaces; those beyond two standard errors are bold."""
    drawn, known = changes(rows, surfaces=False), changes(rows, surfaces=True)
    cells = [[words, _cell(drawn[name]), _cell(known[name])] for name, (words, *_) in CHANGES.items()]
    cells = [line for line in cells if any(line[1:])]
    return ("change", "hidden curves, degrees", "surfaces, degrees"), cells


def _cell(effect: Change | None) -> str:
    if effect is None:
        return ""
    return f"{effect.cell} ({effect.pairs} pairs)"


def kind_of(row: Row) -> str:
    """Name of a field in the plot."""
    if row["way"] == "prove":
        return f"best, {row['norm']:.0f}-norm"
    return "perturbed" if row["way"].startswith("perturbed") else str(row["way"])


def ways_table(rows: list[Row]) -> Table:
    """Gap and error of every kind of field under default weights."""
    fields = errors.gaps(rows)
    cells = []
    for kind in dict.fromkeys(kind_of(row) for row, _ in fields):
        mine = [(row, gap) for row, gap in fields if kind_of(row) == kind]
        line = [kind, str(len(mine)), percent(float(np.median([gap for _, gap in mine])))]
        for surfaces in (False, True):
            part = [row for row, _ in mine if is_surface(row) == surfaces]
            mean = errors.mean_by_drawing(part, lambda row: row["error"])
            line.append(
                "" if mean is None else f"{mean.mean:.1f}" + (f" ± {mean.error:.1f}" if mean.error else "")
            )
        cells.append(line)
    return (
        "field",
        "fields",
        "energy above the optimum, median",
        "hidden curves, degrees",
        "surfaces, degrees",
    ), cells


def proven_text(rows: list[Row]) -> str:
    """Sentence on the number of instances with a known optimum."""
    best = errors.best_energies([row for row in rows_with_error(rows) if is_default(row)])
    closed = sum(proven for _, proven in best.values())
    return (
        f"`prove` closes {closed} of the {len(best)} instances to a gap of {100 * errors.CLOSE:g} %. The "
        "plot and the table cover these instances."
    )


def correlation_text(rows: list[Row]) -> str:
    """Sentence on the correlation of energy and error within an instance."""
    parts = []
    for surfaces, words in ((False, "drawings"), (True, "surfaces")):
        for most, which in ((np.inf, "all fields"), (NEAR, f"those within {percent(NEAR)} of the optimum")):
            mine = [(r, gap) for r, gap in errors.gaps(rows) if is_surface(r) == surfaces and gap <= most]
            effect = errors.correlation(mine)
            if effect is not None and effect.error is not None:
                parts.append(f"{effect.mean:+.2f} ± {effect.error:.2f} over {effect.count} {words}, {which}")
    return (
        "Rank correlation of energy and error between the fields of one instance (1: less energy always "
        f"means less error): {'; '.join(parts)}."
        if parts
        else ""
    )


def harmless_gaps(rows: list[Row]) -> str:
    """Sentence on the gaps between which fields of drawings become worse than the optimum."""
    fields = [field for field in errors.differences(errors.gaps(rows)) if not is_surface(field[0])]
    gap, more = errors.medians([field[1] for field in fields], [field[2] for field in fields])
    if not gap:
        return ""
    after = max((place + 1 for place, field in enumerate(more) if field <= HARM), default=0)
    worse = f"more than {HARM:g} degrees worse than the minimum-energy field, in the median of a bin,"
    if after == len(gap):
        return f"No bin up to {percent(gap[-1])} above the optimum's energy is {worse[:-1]}."
    if not after:
        return f"Fields with more energy than the optimum are {worse[:-1]}."
    return (
        f"Fields are {worse} only from somewhere between {percent(gap[after - 1])} and "
        f"{percent(gap[after])} above its energy."
    )


HARM: Final = 0.5
"""Degrees from which a field counts as worse."""


def weight_lines(rows: list[Row], which: str) -> dict[str, plots.Bars]:
    """Error by one of the weights: greedy and best field, drawings and surfaces, those with all weights."""
    other, usual = ("w_beta", SKEW_WEIGHT) if which == "w_strokes" else ("w_strokes", STROKE_WEIGHT)
    lines = {}
    for surfaces, words in ((False, "hidden curves"), (True, "surfaces")):
        for way, name in (("greedy", "greedy"), ("prove", "best")):
            mine = [
                r for r in rows_with_error(rows) if r["way"] == way and r["norm"] == 2 and r[other] == usual
            ]
            mine = [r for r in mine if is_surface(r) == surfaces]
            values = sorted({row[which] for row in mine})
            have = [{errors.case_of(r) for r in mine if r[which] == value} for value in values]
            common = set.intersection(*have) if have else set()
            line: plots.Bars = ([], [], [])
            for value in values:
                part = [r for r in mine if r[which] == value and errors.case_of(r) in common]
                mean = errors.mean_by_drawing(part, lambda row: row["error"])
                if mean is not None:
                    for column, number in zip(line, (value, mean.mean, mean.error or 0.0), strict=True):
                        column.append(number)
            if len(line[0]) > 1:
                lines[f"{name}, {words}"] = line
    return lines


def draw(rows_of: RowsByPart, pictures: Path) -> None:
    """The plots of this part."""
    fields = errors.differences(errors.gaps(rows_of["quality"]))
    panels: dict[str, dict[str, plots.Line]] = {}
    for surfaces, title in ((False, "hidden curves of drawings"), (True, "surfaces with a known answer")):
        panels[title] = {}
        for kind in dict.fromkeys(kind_of(entry[0]) for entry in fields):
            mine = [
                entry for entry in fields if kind_of(entry[0]) == kind and is_surface(entry[0]) == surfaces
            ]
            panels[title][kind] = ([100 * gap for _, gap, _ in mine], [more for _, _, more in mine])
    plots.error_by_gap(pictures / "evidence_quality.svg", panels)
    lines = {name: weight_lines(rows_of["quality"], name) for name in ("w_strokes", "w_beta")}
    titles = {"w_strokes": "weight of the strokes", "w_beta": "weight of the skew"}
    plots.error_by_weight(
        pictures / "evidence_weights.svg", {titles[name]: entry for name, entry in lines.items()}
    )


def tables(rows_of: RowsByPart) -> dict[str, Table]:
    """The tables of this part by name."""
    return {"changes": changes_table(rows_of["quality"]), "energies": ways_table(rows_of["quality"])}


def sentences(rows_of: RowsByPart) -> dict[str, str]:
    """The sentences of this part by name."""
    rows = rows_of["quality"]
    return {
        "proven": proven_text(rows),
        "correlation": correlation_text(rows),
        "harmless": harmless_gaps(rows),
    }
