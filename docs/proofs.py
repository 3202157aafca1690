"""Make docs/proofs.md and the tables in docs/proofs/ from docs/proofs.json: `python docs/proofs.py`.

    python docs/proofs.py [--measure PART ...] [--names NAME ...] [--seconds S] [--sketches FOLDER]
                          [--work FOLDER]

With --measure, parts are measured first, and their rows in docs/proofs.json replaced: `samples` (size 24),
`paper` (two of them under the weights of the paper), `middle` (two at size 32), `fine` (size 48), `large`
(size 128), `sketches` (drawings of a folder, size 24), `collections` (a folder of collections of drawings,
as docs/public_drawings.py makes it, size 24), `optima` (small instances, compared with other solvers),
`solvers` (MIP solvers, cold and tightened) and `pictures`. --names selects from a part, --seconds replaces
its time limit. With --work, fields and certificates stay in that folder, but not those of collections.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import proof_pictures
import proof_solvers
from crossfield.export.solvers_table import SOLVERS
from crossfield.models.processes.limits import Limits
from crossfield.models.proof.certificate import write_certificate
from crossfield.models.proof.checkers import check_certificate
from crossfield.models.proof.descent.descent import MOST_LABELS
from crossfield.models.proof.prove import prove
from crossfield.models.samples.samples import sample
from crossfield.models.sketch.samples import SAMPLES
from drawings import PROVERS, SUFFIXES, Sketch, drawings_of, optimum, run_command, sketches, tiny_instances
from machine import machine_facts
from make import csv_text, generated_line
from studying.plots import open_panels, styles

DOCS: Final = Path(__file__).resolve().parent
KEPT: Final = DOCS / "proofs.json"
TEMPLATE: Final = DOCS / "proofs.template"
SIZE: Final = 24
MIDDLE: Final = 32
FINE: Final = 48
LARGE: Final = 128
AGREE: Final = 1e-6
"""Difference of equal optima, relative to 1 or the optimum if that is more."""
WITHIN: Final = 1e-5
"""Greatest error of a solver within its tolerances."""
PICTURED: Final = "mouse"
HARDEST: Final = ("mouse", "singular")
"""Samples of other sizes and weights."""
SKETCHES: Final = ("samples", "paper", "middle", "fine", "large", "sketches", "collections")
"""Parts with a proof of each sketch."""
MIP_SAMPLES: Final = ("bottle", "cylinder_bend", "mouse", "saddle", "singular")
SECONDS: Final = {
    "samples": 60.0, "paper": 60.0, "sketches": 60.0, "collections": 60.0, "middle": 180.0, "fine": 300.0,
    "large": 1800.0, "optima": 60.0, "solvers": 60.0, "pictures": 120.0,
}  # fmt: skip
OF_COLLECTIONS: Final = (
    "energy", "bound", "gap", "status", "pixels", "pairs", "labels", "levels", "seconds", "check", "limit"
)  # fmt: skip
"""Facts of a proof that are results for drawings of collections."""
Facts = dict[str, Any]
Results = dict[str, dict[str, Facts]]
Measurement = Callable[["Request"], Iterator[tuple[str, Facts]]]


@dataclass(frozen=True)
class Request:
    """Choices of the command line: names, time limit, and folders."""

    names: tuple[str, ...]
    seconds: float
    sketches: Path | None
    work: Path

    def wants(self, name: str) -> bool:
        """Whether that name is to be measured."""
        return not self.names or name in self.names


def prove_sketch(sketch: Sketch, size: int, request: Request, weights: Sequence[str] = ()) -> Facts:
    """Result of `crossfield prove` for a sketch, size of its certificate, and seconds of its check."""
    name = f"{sketch.name}_{size}{'_paper' if weights else ''}"
    instance, folder = request.work / f"{name}.json", request.work / f"{name}_proof"
    make = ["instance", *sketch.arguments, "--size", str(size), *weights, "-o", str(instance)]
    subprocess.run([sys.executable, "-m", "crossfield", *make], check=True, stdout=subprocess.DEVNULL)
    command = ["prove", str(instance), "--time-limit", str(request.seconds), "--json", "-o", str(folder)]
    facts = run_command(command, folder, sketch.name)
    (certificate,) = folder.glob("*.certificate.npz")
    begin = time.perf_counter()
    check = [sys.executable, str(check_certificate.__file__), str(certificate)]
    subprocess.run(check, check=True, stdout=subprocess.DEVNULL)
    taken = ("energy", "bound", "gap", "status", "seconds", "ended", "memory", "forced_jumps", "pairs")
    return {name: facts[name] for name in taken} | {
        "pixels": sketch.instance(size).grid.size,
        "labels": max(level["labels"] for level in facts["levels"]),
        "levels": len(facts["levels"]),
        "bytes": certificate.stat().st_size,
        "check": time.perf_counter() - begin,
        "limit": request.seconds,
        "whole": facts["whole"],
    }


def samples_at(size: int, names: Iterable[str] = tuple(SAMPLES)) -> Measurement:
    """The measurement of some samples at a size, under the default weights."""

    def rows(request: Request) -> Iterator[tuple[str, Facts]]:
        return (
            (name, prove_sketch(Sketch(name, name), size, request)) for name in names if request.wants(name)
        )

    return rows


def paper(request: Request) -> Iterator[tuple[str, Facts]]:
    """The hardest samples at size 24 under the coefficients of the paper, 1 and 1e-6."""
    for name in HARDEST:
        if request.wants(name):
            sketch = Sketch(name, name)
            yield name, prove_sketch(sketch, SIZE, request, sketch.weights(SIZE))


def drawings(request: Request) -> Iterator[tuple[str, Facts]]:
    """The drawings of a folder at size 24."""
    for sketch in sketches(request.sketches):
        if sketch.name not in SAMPLES and request.wants(sketch.name):
            yield sketch.name, prove_sketch(sketch, SIZE, request)


def collections(request: Request) -> Iterator[tuple[str, Facts]]:
    """The drawings of a folder of collections at size 24; certificates, which are large, are not kept."""
    for folder in sorted(request.sketches.iterdir()) if request.sketches else ():
        for sketch in drawings_of(folder, (*SUFFIXES, ".curves")):
            if request.wants(name := f"{folder.name}/{sketch.name}"):
                with tempfile.TemporaryDirectory(dir=request.work) as work:
                    facts = prove_sketch(sketch, SIZE, replace(request, work=Path(work)))
                yield name, {key: facts[key] for key in OF_COLLECTIONS}


def optima(request: Request) -> Iterator[tuple[str, Facts]]:
    """Small instances, compared with the optimum that another solver proves."""
    for instance in tiny_instances():
        if not request.wants(instance.name):
            continue
        proof = prove(instance, limits=Limits(request.seconds, gap=0))
        best, _ = optimum(instance, proof.field, (*PROVERS, "casadi"))
        yield instance.name, {
            "grid": f"{instance.grid.width} x {instance.grid.height}",
            "energy": proof.energy, "bound": proof.bound, "status": proof.status, "seconds": proof.seconds,
            "other": best.objective if best else None, "by": best.program if best else None,
            "other_seconds": best.seconds if best else None,
        }  # fmt: skip


def solvers(request: Request) -> Iterator[tuple[str, Facts]]:
    """Proofs of MIP solvers for some samples, from files as they are and tightened."""
    for name in MIP_SAMPLES:
        if request.wants(name):
            for row in proof_solvers.solver_rows(name, SIZE, request.seconds, SECONDS["samples"]):
                yield f"{name} {row['solver']}", row


def pictures(request: Request) -> Iterator[tuple[str, Facts]]:
    """The picture of the crosses left at every level."""
    proof = prove(sample(PICTURED, SIZE), limits=Limits(request.seconds, gap=0))
    certificate = write_certificate(proof, request.work / f"{PICTURED}.certificate.npz")
    proof_pictures.draw_maps(proof, certificate.proven.boxes, DOCS / "pictures" / "proof_levels.png")
    yield PICTURED, {"levels": len(proof.levels), "status": proof.status}


PARTS: Final[dict[str, Measurement]] = {
    "samples": samples_at(SIZE),
    "paper": paper,
    "middle": samples_at(MIDDLE, HARDEST),
    "fine": samples_at(FINE),
    "large": samples_at(LARGE),
    "sketches": drawings,
    "collections": collections,
    "optima": optima,
    "solvers": solvers,
    "pictures": pictures,
}


def measure(part: str, request: Request) -> None:
    """Write the rows of a part to docs/proofs.json as they come."""
    request.work.mkdir(parents=True, exist_ok=True)
    for name, facts in PARTS[part](request):
        results = read()
        results.setdefault(part, {})[name] = facts | {"machine": machine_facts()}
        print(part, name, facts, file=sys.stderr, flush=True)
        KEPT.write_text(json.dumps(results, indent=1, sort_keys=True) + "\n")


def read() -> Results:
    """Read all measured rows."""
    return dict(json.loads(KEPT.read_text())) if KEPT.exists() else {}


def draw_reach(results: Results, path: Path) -> None:
    """Plot the share of drawings that are proven optimal within some seconds, a step line per part."""
    collections = len({name.partition("/")[0] for name in results["collections"]})
    titles = {
        "samples": f"samples, {SIZE} pixels",
        "fine": f"samples, {FINE} pixels",
        "large": f"samples, {LARGE} pixels",
        "sketches": f"{len(results['sketches'])} files of drawings by others, {SIZE} pixels",
        "collections": f"{collections} public collections, {SIZE} pixels",
    }
    looks = styles(list(titles))
    with open_panels(path, 1, high=4.0, wide=4.9) as (axis,):
        for part, title in titles.items():
            rows = list(results[part].values())
            seconds = sorted(row["seconds"] for row in rows if row["status"] == "optimal")
            shares = 100 * np.arange(1, len(seconds) + 1) / len(rows)
            limits = {row["limit"] for row in rows}
            limit, within = max(limits), "in" if len(limits) == 1 else "in up to"
            look = looks[part] | {"marker": "", "drawstyle": "steps-post", "linewidth": 1.8}
            reach = f"{title}: {len(seconds)} of {len(rows)} {within} {limit:g} s"
            axis.plot([seconds[0], *seconds, limit], [0, *shares, shares[-1]], label=reach, **look)
        axis.set(xscale="log", xlabel="seconds", ylabel="proven optimal, %", ylim=(0, 102))
        axis.xaxis.set_major_formatter("{x:g}")
        axis.legend(loc="lower center", bbox_to_anchor=(0.45, 1.0))


def solver_title(solver: str) -> str:
    """The title of a solver."""
    return SOLVERS[solver].title


def difference(row: Facts) -> float:
    """Difference of both optima, relative to 1 or the optimum if that is more."""
    return float(abs(row["energy"] - row["other"]) / max(1.0, row["other"]))


def agreement(rows: dict[str, Facts]) -> str:
    """How often another solver proves the same optimum of a small instance."""
    known = [row for row in rows.values() if row["other"] is not None]
    same = sum(difference(row) <= AGREE and row["status"] == "optimal" for row in known)
    programs = " or ".join(sorted({solver_title(row["by"]) for row in known}))
    return (
        f"On {same} of {len(known)} small instances, {programs} proves the same optimum "
        "([list](proofs/optima.csv))."
    )


def memory_of_levels(results: Results) -> str:
    """The memory of the proof with the largest level."""
    rows = [row for part in SKETCHES for row in results[part].values() if row.get("memory")]
    largest = max(rows, key=lambda row: row["labels"])
    return f"{largest['labels']:,} of them took {largest['memory'] / 1e9:.1f} GB."


def open_drawings(results: Results) -> str:
    """How many drawings of the collections keep a gap, of which sizes, and under which limits."""
    rows = results["collections"].values()
    gaps = [row["gap"] for row in rows if row["status"] != "optimal"]
    sizes = ", ".join(
        f"{sum(low <= gap < high for gap in gaps)} {words}"
        for low, high, words in ((0.0, 0.01, "below 1 %"), (0.01, 0.05, "of 1 to 5 %"))
    )
    large = sorted(gap for gap in gaps if gap >= 0.05)
    limits = Counter(f"{row['limit']:g} s" for row in rows).most_common()
    return (
        f"Of {len(rows)} public drawings at {SIZE} pixels, {len(gaps)} keep gaps: {sizes}, "
        f"and {len(large)} single curves of {100 * large[0]:.0f} to {100 * large[-1]:.0f} %. "
        + " and ".join(f"{count} drawings had {limit}" for limit, count in limits)
        + "."
    )


def flatten(facts: Facts) -> Facts:
    """The facts of a row without nested ones, whose names are joined by an underscore."""
    flat: Facts = {}
    for name, value in facts.items():
        flat |= (
            {f"{name}_{key}": entry for key, entry in value.items()}
            if isinstance(value, dict)
            else {name: value}
        )
    return flat


def csv_of_parts(results: Results, parts: Sequence[str]) -> str:
    """The rows of some parts as a CSV file with a column per fact."""
    rows = [
        {"part": part, "row": name} | flatten(facts)
        for part in parts
        for name, facts in sorted(results[part].items())
    ]
    return csv_text(rows)


def files(results: Results) -> dict[str, str]:
    """The texts of docs/proofs.md and of its tables, by their paths in docs/."""
    texts = {
        "generated": generated_line("python docs/proofs.py"),
        "most": f"{MOST_LABELS:,}",
        "memory": memory_of_levels(results),
        "open": open_drawings(results),
        "agreement": agreement(results["optima"]),
    }
    page = re.sub(r"@(\w+)@", lambda match: texts[match[1]], TEMPLATE.read_text(encoding="utf-8"))
    return {
        "proofs.md": page,
        "proofs/sketches.csv": csv_of_parts(results, SKETCHES),
        "proofs/optima.csv": csv_of_parts(results, ["optima"]),
        "proofs/solvers.csv": csv_of_parts(results, ["solvers"]),
    }


def main() -> None:
    """Measure the requested parts, and write the page."""
    parser = argparse.ArgumentParser(description="Measure proofs; write docs/proofs.md and its tables.")
    parser.add_argument("--measure", nargs="*", choices=PARTS, default=[], help="Parts to measure first.")
    parser.add_argument("--names", nargs="*", default=[], help="Only these of a part.")
    parser.add_argument("--seconds", type=float, help="Time limit of each proof or solve.")
    parser.add_argument("--sketches", type=Path, help="Folder with drawings: .svg, .png, .scap.")
    parser.add_argument("--work", type=Path, help="Folder that keeps finished results.")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        for part in options.measure:
            seconds = options.seconds or SECONDS[part]
            measure(
                part, Request(tuple(options.names), seconds, options.sketches, options.work or Path(name))
            )
    (DOCS / "proofs").mkdir(exist_ok=True)
    draw_reach(read(), DOCS / "pictures" / "proof_reach.svg")
    for path, text in files(read()).items():
        (DOCS / path).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
