"""docs/evidence.md and its tables as CSV files, from the rows."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any, Final

import numpy as np
from crossfield.export.solvers_table import PROGRAMS
from make import generated_line, markdown

from . import errors, fields_page, practice_page, quality_page
from .instances import surfaces
from .plan import Plan, stages
from .rows import PARTS, Row, Table, key_of
from .rows import read as read_rows
from .solvers import page as solvers_page
from .solvers.plan import DATA as SOLVER_ROWS
from .solvers.plan import FULL
from .solvers.plan import table as solvers_table
from .wording import percent, series

RowsByPart = dict[str, list[Row]]
SOLVERS: Final = SOLVER_ROWS.stem
TEMPLATE: Final = Path(__file__).with_name("evidence.template")
COMMAND: Final = "python docs/study.py --page"
MADE_BY: Final = {
    **dict.fromkeys(PARTS, "python docs/study.py"),
    "fields": "python docs/fields.py hidden missed surface --sketches FOLDER",
    SOLVERS: "python docs/solver_study.py",
}


def read(data: Path) -> RowsByPart:
    """The rows of all parts."""
    files = {part: data / f"{part}.csv" for part in PARTS}
    rows_of = {part: list(read_rows(path)) if path.exists() else [] for part, path in files.items()}
    return rows_of | {SOLVERS: solvers_table(data / SOLVER_ROWS.name).rows}


def rows_in_order(rows_of: RowsByPart, plan: Plan) -> RowsByPart:
    """The rows in the order of the plan, which colours and lines of tables follow; others come last."""
    place = {run.key: number for number, run in enumerate(r for s in stages(plan, None) for r in s.runs)}
    return {
        part: sorted(rows, key=lambda row: place.get(key_of(row), len(place))) if part in PARTS else rows
        for part, rows in rows_of.items()
    }


def completeness(rows_of: RowsByPart, plan: Plan) -> str:
    """Sentence on the completed share of the plan."""
    planned = [run for stage in stages(plan, None) for run in stage.runs]
    done = {key_of(row) for part in PARTS for row in rows_of[part]}
    have = sum(run.key in done for run in planned)
    rest = len(planned) - have
    text = f"{have:,} of the {len(planned):,} planned runs on fields are done"
    return f"{text}." if not rest else f"{text}; **{rest:,} are still missing**."


def findings(rows_of: RowsByPart) -> dict[str, list[str]]:
    """Sentences by question, the most important one first."""
    return {
        "Which method has the smallest error?": [
            difference_by_others(),
            *practice_page.recommendation(rows_of),
        ],
        "Do lower energies give better fields?": effect_of_energy(rows_of),
        "Can solvers prove optima?": solvers_page.answer(rows_of[SOLVERS], FULL),
    }


def paragraphs(sentences: dict[str, list[str]]) -> str:
    """Questions and answers as paragraphs."""
    return "\n\n".join(f"**{question}** {' '.join(lines)}" for question, lines in sentences.items())


def difference_by_others() -> str:
    """The difference between the two best methods on drawings by others."""
    sizes = sorted(fields_page.values("size", measure="hidden"))
    changes = {
        size: fields_page.compared("polyvector", "bend", origin=fields_page.OTHERS, size=size)
        for size in sizes
    }
    parts = [f"{change} degrees at {size} pixels" for size, change in changes.items() if change is not None]
    sure = [str(size) for size, change in changes.items() if change is not None and change.sure]
    beyond = f"only the difference at {series(sure)} pixels" if sure else "no difference"
    return (
        f"On {fields_page.counts()['others_drawings']} drawings by others, `bend` changes the mean error at "
        f"hidden curves, compared with `polyvector`, by {', '.join(parts)}; {beyond} exceeds two standard "
        "errors."
    )


def effect_of_energy(rows_of: RowsByPart) -> list[str]:
    """Answer on the effect of the optimum on the error."""
    own = quality_page.changes(rows_of["quality"], surfaces=False)["optimum"]
    sizes = fields_page.values("size", measure="hidden", method="prove")
    there = fields_page.compared("greedy", "prove", size=sizes[0])
    search = fields_page.compared("greedy", "search", size=sizes[0])
    if own is None or there is None or search is None:
        return ["Not measured yet."]
    others = fields_page.counts()["others_drawings"]
    before = [gap for row, gap in errors.gaps(rows_of["quality"]) if row["way"] == "greedy"]
    return [
        (
            "From the greedy field to the best field of `prove`, the mean error at hidden curves changes by "
            f"{there} degrees on {there.drawings} drawings, {others} of them by others (95 % interval "
            f"{there.range}), and by {own} degrees in the study of crossfield's own drawings ({own.range})."
        ),
        f"A search of 5 s changes it by {search} degrees on the {search.drawings} drawings.",
        f"The energy of greedy fields is {percent(float(np.mean(before or [0.0])))} above the optimum.",
        quality_page.harmless_gaps(rows_of["quality"]),
    ]


def threats(rows_of: RowsByPart) -> dict[str, Any]:
    """Numbers of drawings and surfaces, editions, and machine."""
    free = [f"{p.title}: {p.free}" for p in PROGRAMS.values() if p.free]
    rows = [row for part in PARTS for row in rows_of[part] if row["machine"]]
    machines = ", ".join(sorted({row["machine"] for row in rows}))
    loads = [row["load"] for row in rows] or [0.0]
    fields = [row for part in ("quality", "practice") for row in rows_of[part]]
    known = {row["instance"] for row in fields if row["instance"] in surfaces()}
    return {
        "drawings": len({row["instance"] for row in fields} - known),
        "surfaces_count": len(known),
        "free": "; ".join(free) + ".",
        "machine": (
            f"{machines}. The load average was {min(loads):.1f} to {max(loads):.1f}, "
            f"{float(np.median(loads)):.1f} in the median: other work ran at the same time, so seconds are "
            "too long."
        ),
    }


def tables(rows_of: RowsByPart) -> dict[str, Table]:
    """All tables by name; kept: in the order of the plan."""
    tables_of_pages = fields_page.tables()
    for part in (quality_page, practice_page):
        tables_of_pages |= part.tables(rows_of)
    return tables_of_pages | solvers_page.tables(rows_of[SOLVERS], FULL)


def page(rows_of: RowsByPart, plan: Plan) -> str:
    """The text of the page; kept: in the order of the plan."""
    all_tables = tables(rows_of)
    counts = {part: len(rows) for part, rows in rows_of.items()} | {"fields": len(fields_page.read())}
    files = [f"| `{name}.csv` | {count:,} | `{MADE_BY[name]}` |" for name, count in counts.items()]
    return TEMPLATE.read_text(encoding="utf-8").format(
        generated=generated_line(COMMAND),
        findings=paragraphs(findings(rows_of)),
        completeness=completeness(rows_of, plan),
        missed=fields_page.missed_sentence(),
        files="\n".join(files),
        **fields_page.counts(),
        **solvers_page.sentences(rows_of[SOLVERS], FULL),
        **quality_page.sentences(rows_of),
        **practice_page.sentences(rows_of),
        **threats(rows_of),
        **{name: markdown(*table) if table[1] else "Not measured yet." for name, table in all_tables.items()},
    )


def write_page(data: Path, target: Path, plan: Plan) -> None:
    """Make evidence.md in a folder, its tables in `evidence` and its plots in `pictures` there."""
    rows_of = rows_in_order(read(data), plan)
    for part in (quality_page, practice_page):
        part.draw(rows_of, target / "pictures")
    (target / "evidence").mkdir(exist_ok=True)
    for name, (heads, lines) in tables(rows_of).items():
        with (target / "evidence" / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            plain = [[cell.replace("`", "").replace("**", "") for cell in line] for line in (heads, *lines)]
            csv.writer(file, lineterminator="\n").writerows(plain)
    (target / "evidence.md").write_text(page(rows_of, plan))
