"""Tables and sentences on the errors of fields, from data/fields.csv."""

from __future__ import annotations

import csv
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from crossfield.models.instance.instance import STROKE_WEIGHT
from crossfield.models.sketch.samples import SAMPLES
from drawings import subject_of

from . import plots
from .errors import Change, change
from .hidden import summary
from .rows import DATA, Row, Table
from .wording import series

OWN: Final = "of crossfield"
OTHERS: Final = "by others"
COMPARED: Final = (
    ("polyvector", "bend"),
    ("greedy", "bend"),
    ("greedy", "polyvector"),
    ("greedy", "search"),
    ("greedy", "prove"),
)
"""Methods whose errors are compared: before, after."""


@cache
def read() -> list[Row]:
    """The rows, each with the origin of its drawing and what it shows.

    Files of one drawing are one subject: as independent drawings they would make errors look too small.
    """
    with (DATA / "fields.csv").open(newline="") as file:
        rows: list[Row] = list(csv.DictReader(file))
    for row in rows:
        row |= {name: float(row[name]) for name in ("noise", "weight", "value")}
        row |= {"size": int(row["size"]), "origin": OWN if row["name"] in SAMPLES else OTHERS}
        row["subject"] = subject_of(row["name"])
    return rows


def rows_with(**facts: Any) -> list[Row]:
    """The rows with these facts."""
    return [row for row in read() if all(row[name] == value for name, value in facts.items())]


def values(name: str, **facts: Any) -> list[Any]:
    """The different values of a column in the rows with these facts, in their order."""
    return list(dict.fromkeys(row[name] for row in rows_with(**facts)))


def over_drawings(rows: list[Row]) -> str:
    """Mean over drawings of the means over their curves, with its standard error."""
    of: dict[str, list[float]] = {}
    for row in rows:
        of.setdefault(row["subject"], []).append(row["value"])
    mean_of_drawings = summary(np.array([np.mean(values) for values in of.values()]))
    return str(mean_of_drawings or "-")


def by_origin(cell: Callable[..., str]) -> tuple[tuple[str, ...], list[str]]:
    """Heads and cells for drawings by others, then for crossfield's, at each size."""
    cases = [(origin, size) for origin in (OTHERS, OWN) for size in values("size", measure="hidden")]
    heads = tuple(f"{origin}, {size} pixels" for origin, size in cases)
    return heads, [cell(origin=origin, size=size) for origin, size in cases]


def hidden_table() -> Table:
    """Error at hidden curves: a row for each method."""
    facts: dict[str, Any] = {"measure": "hidden", "weight": STROKE_WEIGHT}
    heads: tuple[str, ...] = ()
    cells = []
    for method in values("method", **facts):
        heads, line = by_origin(lambda m=method, **case: over_drawings(rows_with(method=m, **facts, **case)))
        cells.append([method, *line])
    return ("method", *heads), cells


def compared(before: str, after: str, **case: Any) -> Change | None:
    """The change of the error at hidden curves from one method to another."""
    rows = [
        {"instance": r["subject"], "size": (r["name"], r["size"]), "hidden": int(r["curve"]),
         "way": r["method"], "error": r["value"]}
        for r in rows_with(measure="hidden", weight=STROKE_WEIGHT, **case)
    ]  # fmt: skip
    return change(rows, lambda row: row["way"] == before, lambda row: row["way"] == after)


def compared_table() -> Table:
    """Differences of errors at hidden curves between methods."""
    heads: tuple[str, ...] = ()
    cells = []
    for before, after in COMPARED:
        heads, line = by_origin(lambda b=before, a=after, **case: str(compared(b, a, **case) or "-"))
        cells.append([f"{after} minus {before}", *line])
    return ("difference", *heads), cells


def by_drawing_table() -> Table:
    """Error at hidden curves of every drawing: a row for each drawing, size and method."""
    values_by_case: dict[tuple[str, ...], list[float]] = {}
    for row in rows_with(measure="hidden", weight=STROKE_WEIGHT):
        key = (row["origin"], row["name"], str(row["size"]), row["method"])
        values_by_case.setdefault(key, []).append(row["value"])
    heads = ("origin", "drawing", "pixels", "method", "curves", "mean", "median")
    return heads, [
        [*key, str(len(of)), f"{np.mean(of):.2f}", f"{np.median(of):.2f}"]
        for key, of in values_by_case.items()
    ]


def counts() -> dict[str, int]:
    """Numbers of drawings by others and of crossfield's, and of their curves at the middle size."""
    middle = sorted(values("size", measure="hidden"))[1]
    numbers = {}
    for origin, name in ((OTHERS, "others"), (OWN, "own")):
        rows = rows_with(measure="hidden", weight=STROKE_WEIGHT, origin=origin, method="greedy", size=middle)
        numbers |= {
            f"{name}_drawings": len({row["subject"] for row in rows}),
            f"{name}_files": len({row["name"] for row in rows}),
            f"{name}_curves": len(rows),
        }
    return numbers


def surface_table() -> Table:
    """Mean cross error over all surfaces on the finest grid: a row for each method."""
    facts: dict[str, Any] = {"measure": "surface", "weight": STROKE_WEIGHT}
    facts["size"] = max(values("size", **facts))
    noises = values("noise", **facts)
    cells = [
        [f"`{m}`", *(f"{mean(rows_with(method=m, noise=n, **facts)):.1f}" for n in noises)]
        for m in values("method", **facts)
    ]
    return (f"{facts['size']} pixels", *(f"noise {noise:g}" for noise in noises)), cells


def by_surface_table() -> Table:
    """Mean cross error of every surface, method and weight."""
    heads = ("surface", "pixels", "noise", "weight", "method", "degrees")
    return heads, [
        [r["name"], str(r["size"]), f"{r['noise']:g}", f"{r['weight']:g}", r["method"], f"{r['value']:.2f}"]
        for r in rows_with(measure="surface")
    ]


def weight_table() -> Table:
    """Greedy fields under each weight of the strokes."""
    sizes = sorted(values("size", measure="hidden"))
    fine, noises = max(values("size", measure="surface")), sorted(values("noise", measure="surface"))
    cells = []
    for weight in sorted(values("weight")):
        facts = {"weight": weight, "method": "greedy"}
        hidden = [over_drawings(rows_with(measure="hidden", size=size, **facts)) for size in sizes]
        off = [f"{mean(rows_with(measure='missed', size=size, **facts)):.1%}" for size in sizes]
        known = [
            f"{mean(rows_with(measure='surface', size=fine, noise=noise, **facts)):.2f}" for noise in noises
        ]
        cells.append([f"{weight:g}", *hidden, *off, *known])
    heads = (
        "weight",
        *(f"hidden curves, {size} pixels" for size in sizes),
        *(f"missed, {size} pixels" for size in sizes),
        *(f"surfaces, noise {noise:g}" for noise in noises),
    )
    return heads, cells


def missed_sentence() -> str:
    """Sentence on the stroke pixels that the methods miss under the default weights."""
    facts: dict[str, Any] = {"measure": "missed", "weight": STROKE_WEIGHT}
    shares = [
        mean(rows_with(method=method, size=size, **facts))
        for method in values("method", **facts)
        for size in values("size", **facts)
    ]
    worst = max(row["value"] for row in rows_with(**facts))
    methods = series(f"`{method}`" for method in values("method", **facts))
    return (
        f"Under the default weights, {methods} miss, by more than 10 degrees, at most "
        f"{max(shares):.1%} of the stroke pixels on average, and {worst:.1%} on any drawing. "
        "The other methods were not measured."
    )


def mean(rows: list[Row]) -> float:
    """The mean value of the rows."""
    return float(np.mean([row["value"] for row in rows]))


def draw(pictures: Path) -> None:
    """The plots of the tables of methods and weights, without their standard errors."""
    by_method: dict[tuple[str, str], dict[str, plots.Line]] = {}
    (_, *heads), cells = hidden_table()
    for name, *line in cells:
        for head, cell in zip(heads, line, strict=True):
            origin, size = head.removesuffix(" pixels").split(", ")
            panel = by_method.setdefault(("pixels", f"degrees, drawings {origin}"), {})
            if cell != "-":
                at, error = panel.setdefault(name, ([], []))
                at.append(float(size))
                error.append(float(cell.split()[0]))
    plots.lines_by_value(pictures / "evidence_hidden.svg", by_method)
    (_, *heads), cells = weight_table()
    weights = [float(line[0]) for line in cells]
    panels: dict[tuple[str, str], dict[str, plots.Line]] = {}
    for column, head in enumerate(heads, 1):
        measure, _, case = head.partition(", ")
        values_of_case = [float(line[column].split()[0].rstrip("%")) for line in cells]
        panels.setdefault(("weight of the strokes", PLOTTED[measure]), {})[case] = weights, values_of_case
    plots.lines_by_value(pictures / "evidence_weights.svg", panels)


PLOTTED: Final = {
    "hidden curves": "error at hidden curves, degrees",
    "missed": "missed stroke pixels, %",
    "surfaces": "error on surfaces, degrees",
}
"""Titles of the axes of the plot."""


def tables() -> dict[str, Table]:
    """The tables of this part by name."""
    return {
        "hidden-curves": hidden_table(),
        "methods-compared": compared_table(),
        "hidden-curves-by-drawing": by_drawing_table(),
        "surfaces": surface_table(),
        "surfaces-by-weight": by_surface_table(),
        "weights": weight_table(),
    }
