"""Tables and sentences on energies and errors of fields."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
from crossfield.models.instance.instance import SKEW_WEIGHT, STROKE_WEIGHT

from . import errors, plots
from .errors import Change, Kind, change, is_default, is_surface, rows_with_error
from .rows import Row, Table
from .wording import percent, series

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

CHANGES: Final[dict[str, tuple[Kind, Kind]]] = {
    "greedy to improved": (made_by("greedy"), made_by("improved")),
    "greedy to a search of 3 s": (made_by("greedy"), made_by("search")),
    "greedy to best": (made_by("greedy"), made_by("prove")),
    "2-norm to 1-norm of best fields": (made_by("prove"), made_by("prove", norm=1)),
    "stroke weight 1 to 20 of best fields": (made_by("prove", strokes=1.0), made_by("prove")),
    "stroke weight 1 to 20 of greedy fields": (made_by("greedy", strokes=1.0), made_by("greedy")),
    "stroke weight 20 to 80 of best fields": (made_by("prove"), made_by("prove", strokes=80.0)),
    "skew weight 1e-6 to 1 of best fields": (made_by("prove"), made_by("prove", skew=1.0)),
    "greedy to power": (made_by("greedy"), made_by("power")),
    "greedy to polyvector": (made_by("greedy"), made_by("polyvector")),
    "greedy to bend": (made_by("greedy"), made_by("bend")),
}
"""Changes that may improve a field: before, after. The best fields are those of `prove`."""
BEST: Final = "greedy to best"


def changes(rows: list[Row], *, surfaces: bool) -> dict[str, Change | None]:
    """Effect of each change on the error, of drawings or of surfaces."""
    chosen = [row for row in rows_with_error(rows) if is_surface(row) == surfaces]
    return {name: change(chosen, *kinds) for name, kinds in CHANGES.items()}


def changes_table(rows: list[Row]) -> Table:
    """All changes, for hidden curves and surfaces."""
    effects = [changes(rows, surfaces=surfaces) for surfaces in (False, True)]
    cells = [
        [name, *(f"{effect} ({effect.pairs} pairs)" if (effect := of[name]) else "" for of in effects)]
        for name in CHANGES
    ]
    return ("change", "hidden curves, degrees", "surfaces, degrees"), cells


def kind_of(row: Row) -> str:
    """Name of a field in the plot."""
    if row["way"] == "prove":
        return f"best, {row['norm']:.0f}-norm"
    return "perturbed" if row["way"].startswith("perturbed") else str(row["way"])


def sure_changes(rows: list[Row]) -> str:
    """Sentence on the changes beyond two standard errors and one degree."""
    sure = [
        f"{name} ({effect}, {where})"
        for surfaces, where in ((False, "hidden curves"), (True, "surfaces"))
        for name, effect in changes(rows, surfaces=surfaces).items()
        if effect and effect.sure and abs(effect.mean) > 1
    ]
    return f"Beyond two standard errors and one degree are {series(sure)}."


def correlation_text(rows: list[Row]) -> str:
    """Sentence on the correlation of energy and error within an instance."""
    parts = []
    for most in (np.inf, NEAR):
        effects = []
        for surfaces, words in ((False, "drawings"), (True, "surfaces")):
            fields = [(r, gap) for r, gap in errors.gaps(rows) if gap <= most and is_surface(r) == surfaces]
            if (effect := errors.correlation(fields)) is not None:
                effects.append(f"{effect.mean:+.2f} ± {effect.error:.2f} ({effect.count} {words})")
        parts.append(" and ".join(effects))
    return (
        "Within an instance, the rank correlation of energy and error is "
        f"{parts[0]}; among fields within {percent(NEAR)} of the optimum, it is {parts[1]}."
    )


def harmless_gaps(rows: list[Row]) -> str:
    """Sentence on the gaps between which fields of drawings become worse than the optimum."""
    fields = [field for field in errors.differences(errors.gaps(rows)) if not is_surface(field[0])]
    gap, _, more, _ = errors.quartiles([field[1] for field in fields], [field[2] for field in fields])
    after = max(place + 1 for place, field in enumerate(more) if field <= HARM)
    return (
        f"The median error rises by more than {HARM:g} degrees only above "
        f"{percent(gap[after - 1])} to {percent(gap[after])} more energy than the optimum."
    )


HARM: Final = 0.5
"""Degrees from which a field counts as worse."""


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
    plots.error_by_gap(pictures / "evidence_quality.svg", panels, ("bend", "best, 1-norm"))


def tables(rows_of: RowsByPart) -> dict[str, Table]:
    """The tables of this part by name."""
    return {"changes": changes_table(rows_of["quality"])}


def sentences(rows_of: RowsByPart) -> dict[str, Any]:
    """The sentences and numbers of this part by name."""
    rows = rows_of["quality"]
    best = errors.best_energies([row for row in rows_with_error(rows) if is_default(row)])
    return {
        "closed": sum(proven for _, proven in best.values()),
        "instances": len(best),
        "correlation": correlation_text(rows),
        "harmless": harmless_gaps(rows),
        "sure_changes": sure_changes(rows),
    }
