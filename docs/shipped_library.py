"""Replace the counts of the library that ships in docs/library.md and docs/guides/libraries.md.

    python docs/shipped_library.py [--measure]

Counts are those of its table and points. With --measure, its build is timed first and
docs/library.json replaced.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any, Final

import crossfield as cf
from crossfield.export.library.plan.spec import DEFAULT, RUNGS, default_spec
from machine import processor_name
from make import markdown, replace_between

DOCS: Final = Path(__file__).resolve().parent
MEASURED: Final = DOCS / "library.json"
POINTS: Final = DEFAULT.parent / "known" / "points"
PURPOSES: Final = {
    "tiny": "all solvers, in seconds; both gauges, both facets",
    "small": "proofs of optimality",
    "medium": "`crossfield prove` closes most in minutes",
    "large": "presolve, relaxations, heuristics",
    "mesh": "orthogonal crosses",
}
Facts = list[dict[str, Any]]


def measure() -> None:
    """Build the library and keep the processor seconds."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "crossfield", "library", "build", "default", "-q", "-o"]
        before = os.times()
        subprocess.run([*command, f"{folder}/library"], check=True)
        after = os.times()
    spent = sum(after[2:4]) - sum(before[2:4])
    facts = {"processor_seconds": round(spent), "processor": processor_name()}
    MEASURED.write_text(json.dumps(facts, indent=1) + "\n")


def rungs(entries: Facts) -> str:
    """The rungs, with sizes and counts."""
    rows = []
    for rung in RUNGS:
        mine = [facts for facts in entries if facts["rung"] == rung]
        instances = {facts["instance"]: facts for facts in mine}.values()
        points = span([facts["pixels"] or facts["faces"] for facts in instances])
        rows.append([rung, points, str(len(instances)), str(len(mine)), PURPOSES[rung]])
    heads = ("rung", "pixels or faces", "instances", "entries", "purpose")
    return markdown(heads, rows)


def span(values: list[int]) -> str:
    """The least and the largest of some numbers."""
    return str(min(values)) if min(values) == max(values) else f"{min(values)} to {max(values)}"


def minutes() -> str:
    """The measured time of a build."""
    facts = json.loads(MEASURED.read_text())
    return f"about {facts['processor_seconds'] / 60:.1f} minutes of processor time ({facts['processor']})"


def counts(entries: Facts) -> str:
    """Sentences that count entries, instances and certificates."""
    instances = len({facts["instance"] for facts in entries})
    status = Counter(facts["status"] for facts in entries)
    tightened = sum(facts["tightened"] for facts in entries)
    certificates = len(list(POINTS.glob("*.certificate.npz")))
    return (
        f"{len(entries)} entries of {instances} instances: {status['optimal']} proven optimal, "
        f"{status['claimed']} claimed and {status['open']} open; {tightened} "
        f"[tightened](#tightened-entries). They come with {certificates} certificates."
    )


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


def main() -> None:
    """Replace the counts; measure first if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--measure", action="store_true", help="build the library and measure the time")
    if parser.parse_args().measure:
        measure()
    entries = [dict(entry.facts) for entry in cf.entries()]
    page = DOCS / "library.md"
    replace_between(page, "shipped", f"{rungs(entries)}\n\n{counts(entries)}")
    replace_between(page, "names", names())
    instances = {facts["instance"] for facts in entries}
    replace_between(
        DOCS / "guides" / "libraries.md",
        "shipped",
        f"The specification `default` builds the library that ships: {len(entries)} entries of "
        f"{len(instances)} instances, in {minutes()}.",
    )


if __name__ == "__main__":
    main()
