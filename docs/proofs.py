"""Make docs/proofs.md, the fields that are proven optimal, from docs/proofs.json: `python docs/proofs.py`.

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
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any, Final

import proof_pictures
import proof_solvers
from crossfield.export.solvers_table import SOLVERS
from crossfield.models.processes.limits import Limits
from crossfield.models.proof import check_certificate
from crossfield.models.proof.certificate import write_certificate
from crossfield.models.proof.descent import MOST_LABELS
from crossfield.models.proof.prove import prove
from crossfield.models.sketch.samples import SAMPLES, sample
from drawings import PROVERS, SUFFIXES, Sketch, drawings_of, optimum, run_command, sketches, tiny_instances
from machine import machine_facts
from make import generated_line, markdown
from public_drawings import COLLECTIONS
from studying.wording import percent

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
    """The pictures of the crosses left at every level."""
    proof = prove(sample(PICTURED, SIZE), limits=Limits(request.seconds, gap=0))
    certificate = write_certificate(proof, request.work / f"{PICTURED}.certificate.npz")
    proof_pictures.draw_maps(proof, certificate.proven.boxes, DOCS / "pictures" / "proof_levels.png")
    pixels = proof_pictures.draw_strips(proof, DOCS / "pictures" / "proof_strips.png")
    yield PICTURED, {"levels": len(proof.levels), "status": proof.status, "pixels": pixels}


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


PROOF_COLUMNS: Final = (
    "sketch", "pixels", "energy", "bound", "gap", "", "forced jumps", "levels", "labels", "s",
    "certificate, MB", "check, s", "GB",
)  # fmt: skip


ENDS: Final = {
    "time": "open: out of time",
    "labels": "open: too many labels",
    "interrupted": "open: interrupted",
    "gap": "open: requested gap reached",
    "optimal": "optimal but for rounding",
}
"""Reasons for the end of a proof without an optimum."""


def proof_table(rows: dict[str, Facts]) -> str:
    """Energy, bound and effort of proofs, in the order of the samples."""
    order = sorted(rows, key=lambda name: (list(SAMPLES).index(name) if name in SAMPLES else 99, name))
    cells = []
    for name in order:
        row = rows[name]
        cells.append(
            [
                name,
                str(row["pixels"]),
                f"{row['energy']:.6f}",
                f"{row['bound']:.6f}",
                percent(row["gap"]) if row["status"] == "gap" else "0",
                "**optimal**" if row["status"] == "optimal" else ENDS[row["ended"]],
                f"{row['forced_jumps']} of {row['pairs']}",
                str(row["levels"]),
                f"{row['labels']:,}",
                f"{row['seconds']:.1f}",
                f"{row['bytes'] / 1e6:.1f}",
                f"{row['check']:.1f}",
                f"{row['memory'] / 1e9:.2f}",
            ]
        )
    return markdown(PROOF_COLUMNS, cells)


def collections_table(rows: dict[str, Facts]) -> str:
    """How many drawings of each collection are proven optimal, the gaps, and the times."""
    columns = (
        "collection", "repository", "drawings", "optimal", "gap at most 3 %", "greatest gap",
        "s, median", "check, s, median", "check, s, at most",
    )  # fmt: skip
    cells = []
    for name, collection in COLLECTIONS.items():
        mine = [row for key, row in rows.items() if key.startswith(f"{name}/")]
        cells.append([name, collection.repository, *_counts(mine)])
    return markdown(columns, [*cells, ["all", "", *_counts(list(rows.values()))]])


def _counts(rows: list[Facts]) -> list[str]:
    return [
        str(len(rows)),
        str(sum(row["status"] == "optimal" for row in rows)),
        str(sum(row["gap"] <= 0.03 for row in rows)),
        percent(max(row["gap"] for row in rows)),
        f"{median(row['seconds'] for row in rows):.0f}",
        f"{median(row['check'] for row in rows):.1f}",
        f"{max(row['check'] for row in rows):.1f}",
    ]


def open_drawings(rows: dict[str, Facts]) -> str:
    """The drawings that are left open, and their gaps."""
    left = sorted((row["gap"], name) for name, row in rows.items() if row["status"] == "gap")
    return ", ".join(f"{name.partition('/')[2]} {percent(gap)}" for gap, name in left)


def optima_table(rows: dict[str, Facts]) -> str:
    """Proven optima here and elsewhere."""
    cells = [
        [
            name,
            row["grid"],
            f"{row['energy']:.9f}",
            f"{row['bound']:.9f}",
            row["status"],
            f"{row['seconds']:.1f}",
            f"{row['other']:.9f}" if row["other"] is not None else "none in the time",
            f"{solver_title(row['by'])}, {row['other_seconds']:.1f} s" if row["by"] else "",
            f"{difference(row):.0e}" if row["other"] is not None else "",
        ]
        for name, row in rows.items()
    ]
    columns = (
        "instance",
        "grid",
        "energy",
        "bound",
        "",
        "s",
        "optimum of another solver",
        "by",
        "difference",
    )
    return markdown(columns, sorted(cells, key=lambda row: (row[0].startswith("random"), row[0])))


def solver_title(solver: str) -> str:
    """The title of a solver."""
    return SOLVERS[solver].title


def difference(row: Facts) -> float:
    """Difference of both optima, relative to 1 or the optimum if that is more."""
    return float(abs(row["energy"] - row["other"]) / max(1.0, row["other"]))


def solvers_table(rows: dict[str, Facts]) -> str:
    """The table of proofs of MIP solvers."""
    cells = [
        [
            solver_title(row["solver"]),
            f"`{row['formulation']}`",
            row["name"],
            f"{row['width']} x {row['height']}",
            f"{row['free_jumps']} of {row['pairs']}",
            *solver_cells(row, "cold"),
            *solver_cells(row, "tightened"),
            *solver_cells(row, "here"),
        ]
        for row in sorted(rows.values(), key=lambda row: (row["formulation"], row["solver"], row["name"]))
    ]
    columns = (
        "solver", "formulation", "sample", "grid", "free jumps", "cold: best", "bound", "s",
        "tightened: best", "bound", "s", "`prove`: best", "bound", "s",
    )  # fmt: skip
    return markdown(columns, cells)


def solver_cells(row: Facts, kind: str) -> list[str]:
    """Cells of a solver: the best point, the bound and the seconds."""
    answer = row[kind]
    best, bound = (
        "none" if answer[name] is None else f"{round(answer[name], 5) + 0.0:.5f}"
        for name in ("objective", "bound")
    )
    return [best, f"**{bound}**" if answer["proven"] else bound, f"{answer['seconds']:.1f}"]


def short_summary(results: Results) -> str:
    """Summary: the reach of proofs, agreement with other solvers, and the reach of those."""
    rows, small, mip = results["samples"], results["optima"], results["solvers"]
    closed = [row for row in rows.values() if row["status"] == "optimal"]
    open_gaps = ", ".join(
        f"{name}, gap {percent(row['gap'])}" for name, row in rows.items() if row["status"] != "optimal"
    )
    rest = f" (not closed: {open_gaps})" if open_gaps else ""
    known = [row for row in small.values() if row["other"] is not None]
    same = sum(difference(row) <= AGREE and row["status"] == "optimal" for row in known)
    exact = [row for row in mip.values() if row["formulation"] == "miqp-exact"]
    large = [row for row in mip.values() if row["solver"] in {"highs", "scip"}]
    cold = sum(row["cold"]["proven"] for row in large)
    narrow = sum(row["tightened"]["proven"] for row in large)
    here = sum(row["here"]["proven"] for row in large)
    seconds = max(row["seconds"] for row in exact)
    return (
        f"At {SIZE} pixels and under the default weights, `crossfield prove` closes {len(closed)} of "
        f"{len(rows)} samples, each within {max(row['seconds'] for row in closed):.0f} s on two threads"
        f"{rest}. Another solver proves the optimum of {len(known)} small instances; in {same} of them both "
        f"optima agree to {AGREE:g}. HiGHS and SCIP close {cold} of {len(large)} files of this size in "
        f"{seconds:g} s, and {narrow} of {len(large)} in the windows that proofs leave. `crossfield prove` "
        f"closes {here} of them, the MILPs in the 1-norm."
    )


def describe_machines(rows: dict[str, Facts]) -> str:
    """The machine of most measurements, and the other ones with their rows."""
    by_machine = defaultdict[str, list[str]](list)
    for name, row in rows.items():
        facts = row["machine"]
        machine = f"{facts['processor']}, {count_cores(facts['cores'])}, Python {facts['python']}, 2 threads"
        by_machine[machine].append(name)
    first, *others = sorted(by_machine, key=lambda machine: -len(by_machine[machine]))
    named = "".join(f" {', '.join(by_machine[other])}: {other}." for other in others)
    loads = [row["machine"]["load"] for row in rows.values()]
    return (
        f"{first}.{named} The load average of the machine was {min(loads):.1f} to {max(loads):.1f}; above "
        "the number of its cores, seconds are too long."
    )


def count_cores(cores: int) -> str:
    """The number of cores in words."""
    return "one core" if cores == 1 else f"{cores} cores"


def page(results: Results) -> str:
    """The text of docs/proofs.md."""
    tables = ("samples", "paper", "middle", "sketches", "fine", "large")
    parts = {part: results[part] for part in (*tables, "collections", "solvers")}
    texts = {
        "generated": generated_line("python docs/proofs.py"),
        "short": short_summary(results),
        "most": f"{MOST_LABELS:,}",
        "optima": optima_table(results["optima"]),
        "solvers": solvers_table(results["solvers"]),
        **{
            f"{part}_limit": f"{max(row['limit'] for row in results[part].values()):g}"
            for part in (*tables, "collections")
        },
        "solvers_limit": f"{SECONDS['solvers']:g}",
    }
    texts |= {
        "collections": collections_table(results["collections"]),
        "collections_open": open_drawings(results["collections"]),
    }
    texts |= {part: proof_table(results[part]) for part in tables}
    texts |= {f"{part}_machine": describe_machines(rows) for part, rows in parts.items()}
    return re.sub(r"@(\w+)@", lambda match: texts[match[1]], TEMPLATE.read_text(encoding="utf-8"))


def main() -> None:
    """Measure the requested parts, and write the page."""
    parser = argparse.ArgumentParser(description="Measure proofs and write docs/proofs.md.")
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
    (DOCS / "proofs.md").write_text(page(read()))


if __name__ == "__main__":
    main()
