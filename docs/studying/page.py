"""docs/evidence.md, its plots, and its tables as CSV files, from the rows."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any, Final

import numpy as np
from make import generated_line, markdown

from . import errors, fields_page, practice_page, quality_page
from .instances import surfaces
from .plan import FULL as FIELDS
from .plan import stages
from .rows import DATA, PARTS, Row, Table, key_of
from .rows import read as read_rows
from .solvers import page as solvers_page
from .solvers.plan import DATA as SOLVER_ROWS
from .solvers.plan import FULL
from .solvers.plan import table as solvers_table
from .wording import percent, series

RowsByPart = dict[str, list[Row]]
TEMPLATE: Final = Path(__file__).with_name("evidence.template")
COMMAND: Final = "python docs/study.py --page"
SHOWN: Final = {"surfaces", "solved"}
"""Tables in the page; the others are CSV files."""


def read() -> RowsByPart:
    """The rows of all parts, in the order of the plan, which colours and lines of tables follow."""
    place = {run.key: number for number, run in enumerate(r for s in stages(FIELDS, None) for r in s.runs)}
    rows_of = {
        part: sorted(read_rows(DATA / f"{part}.csv"), key=lambda row: place.get(key_of(row), len(place)))
        for part in PARTS
    }
    return rows_of | {"solvers": solvers_table(SOLVER_ROWS).rows}


def difference_by_others() -> dict[str, str]:
    """The difference between the two best methods on drawings by others, and what of it is significant."""
    sizes = sorted(fields_page.values("size", measure="hidden"))
    changes = {
        size: fields_page.compared("polyvector", "bend", origin=fields_page.OTHERS, size=size)
        for size in sizes
    }
    sure = sum(change is not None and change.sure for change in changes.values())
    return {
        "by_others": series(f"{change and change.cell} at {size} pixels" for size, change in changes.items()),
        "sure": f"{sure or 'None'} of these {len(sizes)} differences exceed{'s' * (sure < 2)} two "
        "standard errors.",
    }


def effect_of_energy(rows_of: RowsByPart) -> dict[str, Any]:
    """Effects of lower energies on the error, and the excess of greedy fields."""
    size = fields_page.values("size", measure="hidden", method="prove")[0]
    closed = [gap for row, gap in errors.gaps(rows_of["quality"]) if row["way"] == "greedy"]
    return {
        "proved": fields_page.compared("greedy", "prove", size=size),
        "searched": fields_page.compared("greedy", "search", size=size),
        "optimum": quality_page.changes(rows_of["quality"], surfaces=False)[quality_page.BEST],
        "greedy_excess": percent(float(np.mean(closed))),
        "greedy_median": percent(float(np.median(closed))),
        "greedy_gap": percent(float(np.mean(errors.gaps_to_bounds(rows_of["quality"], "greedy")))),
    }


def counts(rows_of: RowsByPart) -> dict[str, Any]:
    """Numbers of drawings and surfaces, and the machine."""
    fields = [row for part in PARTS for row in rows_of[part]]
    known = {row["instance"] for row in fields if row["instance"] in surfaces()}
    return {
        "drawings": len({row["instance"] for row in fields} - known),
        "surfaces_count": len(known),
        "machine": ", ".join(sorted({row["machine"] for row in fields})),
        "version": ", ".join(sorted({row["version"] for row in fields})),
    }


def tables(rows_of: RowsByPart) -> dict[str, Table]:
    """All tables by name."""
    return (
        fields_page.tables()
        | quality_page.tables(rows_of)
        | practice_page.tables(rows_of)
        | solvers_page.tables(rows_of["solvers"], FULL)
    )


def write_page(target: Path) -> None:
    """Make evidence.md in a folder, its tables in `evidence` and its plots in `pictures` there."""
    rows_of = read()
    all_tables = tables(rows_of)
    fields_page.draw(target / "pictures")
    for part in (quality_page, practice_page):
        part.draw(rows_of, target / "pictures")
    (target / "evidence").mkdir(exist_ok=True)
    for name in all_tables.keys() - SHOWN:
        heads, lines = all_tables[name]
        with (target / "evidence" / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([heads, *lines])
    text = TEMPLATE.read_text(encoding="utf-8").format(
        generated=generated_line(COMMAND),
        **difference_by_others(),
        missed=fields_page.missed_sentence(),
        **fields_page.counts(),
        **solvers_page.sentences(rows_of["solvers"], FULL),
        **quality_page.sentences(rows_of),
        **practice_page.sentences(rows_of),
        **effect_of_energy(rows_of),
        **counts(rows_of),
        **{name: markdown(*all_tables[name]) for name in SHOWN},
    )
    (target / "evidence.md").write_text(text)
