"""docs/study.md from the rows: answers first, then the parts, then threats to validity."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
from crossfield.export.solvers_table import PROGRAMS
from make import generated

from . import errors, practice_page, quality_page, solver_page
from .instances import surfaces
from .plan import FULL, Plan, stages
from .rows import EVERY, NOT_RUN, PARTS, Row, key_of
from .rows import read as read_rows
from .solver_page import percent
from .solving import PROOF
from .words import QUESTION, ROWS, THREATS

Kept = dict[str, list[Row]]
COMMAND: Final = "python docs/study.py --page"


def counted(text: str) -> dict[str, int]:
    """Numbers of rows of each part from which a page was made, according to its end."""
    counts = text.rstrip().rpartition("from the first ")[2].rstrip(".")
    return {part: int(count) for count, part in (each.split() for each in counts.split(", "))}


def read(data: Path) -> Kept:
    """The rows of all parts; a running study may add others."""
    files = {part: data / f"{part}.csv" for part in PARTS}
    return {part: list(read_rows(path)) if path.exists() else [] for part, path in files.items()}


def ordered(kept: Kept, plan: Plan) -> Kept:
    """The rows in the order of the plan: colours and lines of tables follow it.

    Rows that are not in the plan, of other drawings, come last.
    """
    place = {run.key: number for number, run in enumerate(r for s in stages(plan, None) for r in s.runs)}
    return {
        part: sorted(rows, key=lambda row: place.get(key_of(row), len(place))) for part, rows in kept.items()
    }


def completeness(kept: Kept, plan: Plan) -> str:
    """Sentence on the completed share of the plan."""
    planned = [run for stage in stages(plan, None) for run in stage.runs]
    done = {key_of(row) for rows in kept.values() for row in rows}
    skipped = {key_of(row) for row in kept["solvers"] if row["status"] == NOT_RUN}
    have = sum(run.key in done for run in planned)
    left_out = sum((run.key[0], EVERY, *run.key[2:]) in skipped and run.key not in done for run in planned)
    rest = len(planned) - have - left_out
    text = f"Of {len(planned):,} planned runs {have:,} are done and {left_out:,} left out by the rule below"
    return f"{text}; the study is complete." if not rest else (
        f"{text}; **{rest:,} are still to come**, and all that is said here is said of those that are done. "
        "`python docs/study.py` goes on with them."
    )  # fmt: skip


def answers(kept: Kept) -> dict[str, list[str]]:
    """The answers in plain words: sentences by question, the most important one first."""
    return {
        "Can solvers prove optima?": solvable(kept),
        "Do lower energies give better fields?": matters(kept),
        "Which method should be used?": [
            quality_page.by_others("polyvector", "bend"),
            *practice_page.recommendation(kept),
        ],
    }


def paragraphs(found: dict[str, list[str]], most: int | None = None) -> str:
    """Questions and answers as paragraphs, each of that many sentences at most."""
    return "\n\n".join(f"**{question}** {' '.join(lines[:most])}" for question, lines in found.items())


def solvable(kept: Kept) -> list[str]:
    """Answer on the reach of solvers, and of `prove`."""
    found = solver_page.facts_in_short(kept)
    standing, own = found["standing"], found["prove"][2]
    if not standing:
        return ["Not measured yet."]
    free = {pair: of for pair, of in standing.items() if pair[0] != solver_page.JUMPS_GIVEN}
    parts = []
    for size in sorted({size for of in free.values() for size in of}):
        ran = {pair: of[size] for pair, of in free.items() if size in of and of[size].tried}
        if ran:
            pair, rung = max(ran.items(), key=lambda each: (each[1].share, -each[1].seconds))
            large = len(rung.runs) - len(rung.tried)
            note = f"; {large} are too large for its free edition" if large else ""
            parts.append(
                f"{rung.proven} of {len(rung.runs)} at {size} pixels ({solver_page.label(pair)}{note})"
            )
    ours = [f"{own[size].proven} of {len(own[size].runs)} at {size}" for size in sorted(own)]
    reach = found["reach"]
    last = max((size for of in free.values() for size, rung in of.items() if rung.tried), default=0)
    if reach is None:
        text = "no solver proves half of the instances of any size."
    elif reach[0] == last:
        text = f"a solver proves at least half of the instances at every size, up to {last} pixels per side."
    else:
        text = f"a solver proves half of the instances up to {reach[0]} pixels per side."
    sentences = (
        f"{HOW}, {text}",
        f"The best pair of formulation and solver proves {', '.join(parts)}.",
        f"`prove`, which is made for this problem, proves {', '.join(ours)}.",
        found["helped"],
    )
    return list(filter(None, sentences))


HOW: Final = f"In {FULL.limit:g} s per run, on one thread, from a cold start and with free editions"
"""The conditions under which solvers ran."""


def matters(kept: Kept) -> list[str]:
    """Answer on the effect of the optimum on the error, and of other changes."""
    found = quality_page.changes(kept["quality"], surfaces=False)
    optimum = found["optimum"]
    if optimum is None:
        return ["Not measured yet."]
    before = [gap for row, gap in errors.gaps(kept["quality"]) if row["way"] == "greedy"]
    mean = percent(float(np.mean(before or [0.0])))
    others = quality_page.elsewhere()
    there = others.changes[PROOF]
    verdict = "" if optimum.sure or there.sure else "No effect was found, and large ones are excluded. "
    text = (
        f"{verdict}From the greedy field to the best one found, the mean error at hidden curves changes by "
        f"{there} degrees on {others.drawings} drawings, {others.others} of them by others (95 % interval "
        f"{there.range}), and by {optimum} degrees on the study's own ({optimum.range})."
    )
    about = f"The greedy field's energy is {mean} above the proven optimum on average."
    sure = {name: each for name, each in found.items() if each is not None and each.sure and each.mean < 0}
    last = "No change that was tried lowers the error at hidden curves by more than two standard errors."
    if sure:
        most = sorted(sure, key=lambda name: sure[name].mean)[:3]
        words = "; ".join(f"{quality_page.CHANGES[name][0]} ({sure[name]})" for name in most)
        last = f"These changes lower the error at hidden curves, in degrees: {words}."
    return [*filter(None, (text, about, quality_page.harmless(kept["quality"]))), last]


def threats(kept: Kept) -> str:
    """Threats to validity, with the editions and the machine."""
    free = [f"{p.title}: {p.free}" for p in PROGRAMS.values() if p.free]
    rows = [row for part in kept.values() for row in part if row["machine"]]
    machines = ", ".join(sorted({row["machine"] for row in rows}))
    loads = [row["load"] for row in rows] or [0.0]
    machine = (
        f"{machines}; load average while measuring {min(loads):.1f} to {max(loads):.1f}, "
        f"{float(np.median(loads)):.1f} in the median. Other work ran beside, and seconds are too many by "
        "what it took."
    )
    fields = [row for part in ("quality", "practice") for row in kept[part]]
    known = {row["instance"] for row in fields if row["instance"] in surfaces()}
    drawings = {row["instance"] for row in fields} - known
    return THREATS.format(
        drawings=len(drawings), surfaces=len(known), free="; ".join(free) + ".", machine=machine
    )


def page(kept: Kept, plan: Plan) -> str:
    """The text of the page."""
    kept = ordered(kept, plan)
    parts = [
        "# Are the formulations useful in practice?",
        generated(COMMAND),
        QUESTION,
        paragraphs(answers(kept)),
        completeness(kept, plan),
    ]
    parts += [*solver_page.section(kept), *quality_page.section(kept), *practice_page.section(kept)]
    counts = ", ".join(f"{len(rows)} {part}" for part, rows in kept.items())
    parts += [threats(kept).rstrip(), f"{ROWS} This page is made from the first {counts}."]
    return "\n\n".join(filter(None, parts)) + "\n"


def write_page(data: Path, target: Path, plan: Plan) -> None:
    """Make study.md in a folder, and its plots in the folder `pictures` there."""
    kept = ordered(read(data), plan)
    for part in (solver_page, quality_page, practice_page):
        part.draw(kept, target / "pictures")
    (target / "study.md").write_text(page(kept, plan))


def in_short(kept: Kept, plan: Plan) -> str:
    """The first two sentences of each answer, for the index of all pages."""
    return paragraphs(answers(ordered(kept, plan)), most=2)
