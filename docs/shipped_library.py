"""Counts of the library that ships, in its page (`python docs/make.py library`)."""

from __future__ import annotations

from collections import Counter, defaultdict
from pathlib import Path
from typing import Any, Final

import crossfield as cf
from crossfield.export.library.ledger.grades import is_proven
from crossfield.export.library.ledger.ledger import read_ledger
from crossfield.export.library.plan.recipe import norm_minimised
from crossfield.export.library.plan.spec import DEFAULT, RUNGS, default_spec
from make import markdown, replace_between

DOCS: Final = Path(__file__).resolve().parent
POINTS: Final = DEFAULT.parent / "known" / "points"
CONTENTS: Final = {
    "tiny": "both gauges, both facets",
    "small": "certificates in every norm",
    "medium": "certificates in every norm",
    "large": "certificates of more than 2 MB, or none; presolve, relaxations, heuristics",
    "mesh": "orthogonal crosses in the 2-norm",
}
STATES: Final = ("optimal", "agreed", "claimed", "open")
Facts = list[dict[str, Any]]


def rungs(entries: Facts) -> str:
    """The rungs, with sizes and counts."""
    rows = []
    for rung in RUNGS:
        mine = [facts for facts in entries if facts["rung"] == rung]
        instances = {facts["instance"]: facts for facts in mine}.values()
        points = span([facts["pixels"] or facts["faces"] for facts in instances])
        states = Counter(facts["status"] for facts in mine)
        easy = sum(facts["difficulty"] == "easy" for facts in mine)
        counted = [len(instances), len(mine), *(states[state] for state in STATES), easy]
        rows.append([rung, points, *map(str, counted), CONTENTS[rung]])
    heads = ("rung", "pixels or faces", "instances", "entries", "proven", *STATES[1:], "easy", "contents")
    return markdown(heads, rows)


def span(values: list[int]) -> str:
    """The least and the largest of some numbers."""
    return str(min(values)) if min(values) == max(values) else f"{min(values)} to {max(values)}"


def counts(entries: Facts) -> str:
    """Sentences on what the statuses of the entries rest on."""
    instances = len({facts["instance"] for facts in entries})
    proven = Counter(facts["solved"] for facts in entries)
    certificates = len(list(POINTS.glob("*.certificate.npz")))
    tightened = sum(facts["tightened"] for facts in entries)
    return (
        f"Of the {len(entries)} entries of {instances} instances, {tightened} are tightened. "
        f"{certificates} certificates prove {proven['certificate']} entries, and the tangent "
        f"{proven['tangent']} QPs with fixed jumps. {own_claims(entries)} of the claims rest on one run of "
        "`crossfield prove`, whose certificate is not kept."
    )


def own_claims(entries: Facts) -> int:
    """Number of claimed entries whose only claim is a run of crossfield itself."""
    known = {facts["name"]: facts for facts in entries}
    programs: dict[Any, set[str]] = defaultdict(set)
    for record in read_ledger(POINTS.parent).records:
        facts = known.get(record.entry)
        if facts is None or record.bound is None:
            continue
        if is_proven(facts["objective"], record.bound):
            programs[optimum_of(facts)].add(record.solver)
    claimed = [facts for facts in entries if facts["status"] == "claimed"]
    return sum(programs[optimum_of(facts)] == {"crossfield"} for facts in claimed)


def optimum_of(facts: dict[str, Any]) -> tuple[Any, ...]:
    """The facts that entries with the same optimum have in common."""
    norm = norm_minimised(facts["formulation"], facts["facet"])
    return facts["instance"], norm or (facts["formulation"], facts["facet"])


def names() -> str:
    """Sentence on the sketches whose names differ from those of their samples."""
    short = [
        f"`{sketch.name}` is `{sketch.what}`"
        for sketch in default_spec().sketches
        if sketch.kind == "sample" and sketch.name != sketch.what
    ]
    return (
        "Sketches of the library that ships are [samples](gallery.md), some with a shorter name: "
        f"{', '.join(short)}."
    )


def replace_counts() -> None:
    """Replace the counts in the page."""
    entries = [dict(entry.facts) for entry in cf.entries()]
    page = DOCS / "library.md"
    replace_between(page, "shipped", f"{rungs(entries)}\n\n{counts(entries)}")
    replace_between(page, "names", names())
