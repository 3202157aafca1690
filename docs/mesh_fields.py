"""Compare greedy fields of the built-in meshes with the best known fields and with bounds.

    python docs/mesh_fields.py [--measure] [--names NAME ...] [--seconds S]

With --measure, the meshes are measured first, one after the other, and their rows in docs/meshes.json
replaced. --seconds limits the processor time of each proof without its check, 60 by default. Then the tables
of docs/meshes.md and the plot docs/pictures/meshes.svg are written from the rows.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import crossfield as cf
import numpy as np
from crossfield.export.pictures.draw import fixed_settings
from crossfield.models.mesh.shapes import MESHES
from machine import machine_facts
from make import csv_text, replace_between
from matplotlib.figure import Figure

DOCS: Final = Path(__file__).resolve().parent
MEASURED: Final = DOCS / "meshes.json"
PAGE: Final = DOCS / "meshes.md"
ROUNDS: Final = 60
"""Rounds of a search."""
SAME: Final = 1e-6
"""Gap within which a bound proves an optimum, relative to 1 or the energy if that is more."""
Row = dict[str, Any]


def measure(name: str, seconds: float, rounds: int = ROUNDS) -> Row:
    """Greedy field, search and proof of a mesh: energies, singularities, bound, and processor seconds."""
    instance = cf.sample(name)
    greedy, of_greedy = clock(lambda: cf.greedy_field(instance))
    best, of_search = clock(lambda: cf.search(instance, rounds=rounds, jobs=1).field)
    bound, of_proof = None, None
    if seconds > 0:
        end = time.process_time() + seconds
        stop = lambda: time.process_time() > end  # noqa: E731 - other programs do not change such a limit
        proof, of_proof = clock(lambda: cf.prove(instance, start=best, stop=stop, jobs=1))
        best, bound = min(best, proof.field, key=lambda field: field.energy().total), proof.bound
    return {
        "faces": instance.domain.size,
        "strokes": len(instance.theta),
        "greedy": field_facts(greedy),
        "best": field_facts(best),
        "bound": bound,
        "seconds": {"greedy": of_greedy, "search": of_search, "proof": of_proof},
    }


def clock(work: Callable[[], Any]) -> tuple[Any, float]:
    """Result of the work, and its processor seconds, which other programs hardly change."""
    began = time.process_time()
    return work(), round(time.process_time() - began, 2)


def field_facts(field: cf.CrossField) -> Row:
    """Energy and number of singularities."""
    return {"energy": field.energy().total, "singularities": len(field.singularities.index)}


def excess(row: Row) -> float:
    """How much the greedy energy is above the best one, in percent of it; 0 where both are 0."""
    greedy, best = row["greedy"]["energy"], row["best"]["energy"]
    return 100 * (greedy - best) / best if greedy - best > SAME * max(1.0, best) else 0.0


def is_optimal(row: Row) -> bool:
    """Whether the bound proves the best energy."""
    best = row["best"]["energy"]
    return row["bound"] is not None and best - row["bound"] <= SAME * max(1.0, best)


def table_row(name: str, row: Row) -> dict[str, str]:
    """The cells of a mesh."""
    greedy, best, bound = row["greedy"]["energy"], row["best"]["energy"], row["bound"]
    gap = "0, proven" if is_optimal(row) else "-" if bound is None else f"{100 * (1 - bound / best):.2g} %"
    greedy, best, bound = ("-" if value is None else f"{value:.3f}" for value in (greedy, best, bound))
    return {
        "mesh": name,
        "faces": f"{row['faces']:,}",
        "strokes": str(row["strokes"]),
        "greedy energy": greedy,
        "best energy": best,
        "greedy above best": f"{excess(row):.1f} %",
        "bound": bound,
        "gap": gap,
        **{f"singularities, {kind}": str(row[kind]["singularities"]) for kind in ("greedy", "best")},
        **{
            f"s, {part}": "-" if s is None else f"{s:.2g}" if s < 100 else f"{s:.0f}"
            for part, s in row["seconds"].items()
        },
    }


def sentence(rows: dict[str, Row]) -> str:
    """Sentences on the findings of the table, with its numbers."""
    above = {name: excess(row) for name, row in rows.items()}
    worse = [name for name in above if above[name] > 0]
    most = max(above, key=lambda name: above[name])
    other = [
        name for name in rows if rows[name]["greedy"]["singularities"] != rows[name]["best"]["singularities"]
    ]
    proven = sum(map(is_optimal, rows.values()))
    known = f"{proven} of the best fields are proven optimal" if proven else "No bound is known yet"
    numbers = "; ".join(
        f"`{name}` {rows[name]['greedy']['singularities']} instead of {rows[name]['best']['singularities']}"
        for name in other
    )
    return (
        f"On {len(worse)} of {len(rows)} meshes the greedy field is above the best known field, by "
        f"{min(above[name] for name in worse):.1f} to {above[most]:.1f} % of its energy (`{most}`). {known}. "
        f"The numbers of singularities differ on {len(other)} meshes: {numbers}."
    )


def draw(rows: dict[str, Row], path: Path) -> None:
    """Plot how much greedy fields are above the best ones, the proven ones dark."""
    order = sorted(rows, key=lambda name: excess(rows[name]))
    values = np.array([excess(rows[name]) for name in order])
    with fixed_settings({"font.family": "DejaVu Sans", "font.size": 10}):
        figure = Figure(figsize=(4.9, 3.8), layout="constrained")
        axes = figure.add_subplot()
        colours = ["#1a6f83" if is_optimal(rows[name]) else "#9fc4cd" for name in order]
        bars = axes.barh([f"{name} ({rows[name]['faces']:,})" for name in order], values, color=colours)
        axes.bar_label(bars, [f"{value:.1f}" for value in values], padding=3)
        axes.set_xlabel("greedy energy above the best known, %")
        axes.spines[["top", "right"]].set_visible(False)
        axes.margins(x=0.08)
        figure.savefig(path, metadata={"Date": None, "Creator": None})


def main() -> None:
    """Measure if asked, then write tables and plot."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--measure", action="store_true", help="measure first")
    parser.add_argument("--names", nargs="*", default=list(MESHES), help="meshes to measure")
    parser.add_argument("--seconds", type=float, default=60.0, help="processor time of a proof; 0 for none")
    asked = parser.parse_args()
    kept = json.loads(MEASURED.read_text()) if MEASURED.exists() else {"meshes": {}}
    if asked.measure:
        for name in asked.names:
            kept["meshes"][name] = measure(name, asked.seconds)
            print(name, kept["meshes"][name], flush=True)
        rows = {name: kept["meshes"][name] for name in MESHES}
        kept = {"machine": machine_facts(), "proof_limit": asked.seconds, "meshes": rows}
        MEASURED.write_text(json.dumps(kept, indent=1) + "\n")
    rows = kept["meshes"]
    (DOCS / "meshes" / "energies.csv").write_text(csv_text([table_row(*entry) for entry in rows.items()]))
    replace_between(PAGE, "findings", sentence(rows))
    machine = kept["machine"]
    conditions = (
        f"Processor: {machine['processor']}, Python {machine['python']}, load {machine['load']:.1f}. A proof "
        f"had a limit of {kept['proof_limit']:g} s of processor time, without its check."
    )
    replace_between(PAGE, "machine", conditions)
    draw(rows, DOCS / "pictures" / "meshes.svg")


if __name__ == "__main__":
    main()
