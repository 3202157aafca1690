"""Make docs/fields.md: how good the fields of each method are, against each other and against proven optima.

    python docs/fields.py [--sketches FOLDER] [--seconds S]

Takes about 2 S seconds for each sample and each sketch of the folder. Each search is a `crossfield solve --method search` of its own.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import crossfield as cf
import numpy as np
from crossfield.export.manifest import write_all
from crossfield.export.verify import verify
from crossfield.models.instance import Instance
from crossfield.models.samples import SAMPLES
from make import markdown, said
from PIL import Image

DOCS: Final = Path(__file__).resolve().parent
SIZES: Final = (24, 48)
LARGE: Final = 128
LARGE_SKETCHES: Final = 4
PICTURED: Final = ("cylinder_bend", "mouse", "singular")
SKETCHES: Final = (".svg", ".png", ".scap")
PROOF_SECONDS: Final = 30.0
RANDOM: Final = 8  # random instances of 4 x 5 pixels: more has too many columns for Gurobi's free edition


@dataclass(frozen=True)
class Sketch:
    """A sample, or a drawing in a file with its mask, if it has one."""

    name: str
    what: str
    mask: Path | None = None

    @property
    def arguments(self) -> list[str]:
        """How it is named on the command line."""
        return [self.what, *(["--mask", str(self.mask)] if self.mask else [])]

    def instance(self, size: int) -> Instance:
        """The instance of that size."""
        if self.what in SAMPLES:
            return cf.sample(self.what, size)
        return cf.read_sketch(self.what, size=size, mask=self.mask)


def sketches(folder: Path | None) -> list[Sketch]:
    """Every sample, and every drawing of a folder; a picture called NAME_mask.png is the mask of NAME.png."""
    found = [Sketch(name, name) for name in SAMPLES]
    for path in sorted(folder.iterdir()) if folder else ():
        if path.suffix in SKETCHES and not path.stem.endswith("_mask"):
            mask = path.with_name(f"{path.stem}_mask.png")
            found.append(
                Sketch(path.name, str(path), mask if path.suffix == ".png" and mask.exists() else None)
            )
    return found


@dataclass(frozen=True)
class Row:
    """What the methods made of a sketch. memory: bytes of all processes of the search together, at most."""

    sketch: Sketch
    size: int
    pixels: int
    greedy: dict[str, Any]
    power: dict[str, Any]
    search: dict[str, Any]
    memory: int

    @property
    def lower(self) -> float:
        """By which share the search is below the greedy field; 0 where both are nothing but the price of beta."""
        greedy, search = self.greedy["energy_2_norm"], self.search["energy_2_norm"]
        return float((greedy - search) / greedy) if greedy > 1e-3 else 0.0

    def cells(self) -> list[str]:
        """Its line of the table."""
        facts = (self.greedy, self.power, self.search)
        return [
            self.sketch.name,
            str(self.size),
            str(self.pixels),
            *(f"{each['energy_2_norm']:.4f}" for each in facts),
            f"{100 * self.lower:.1f} %",
            " / ".join(str(each["singularities"]) for each in facts),
            " / ".join(f"{each['mean_abs_beta_degrees']:.1f}" for each in facts),
            " / ".join(f"{each['seconds']:.1f}" for each in facts),
            f"{self.memory / 1e9:.2f}",
        ]


COLUMNS: Final = (
    "sketch", "size", "pixels", "greedy", "power + QP", "search", "lower by", "singularities", "mean abs(beta)", "seconds", "GB",
)  # fmt: skip


def solved(
    sketch: Sketch, size: int, method: str, seconds: float, folder: Path
) -> tuple[dict[str, Any], int]:
    """The facts of `crossfield solve --method`, and the most memory its processes took together, in bytes."""
    command = [
        *(sys.executable, "-m", "crossfield", "solve", *sketch.arguments),
        *("--size", str(size), "--method", method, "--time-limit", str(seconds), "--json", "-o", str(folder)),
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        most = 0
        while process.poll() is None:
            most = max(most, memory_of(process.pid))
            time.sleep(0.25)
        answer = process.communicate()[0]
    if process.returncode:
        raise SystemExit(f"{sketch.name}: exit code {process.returncode}")
    return dict(json.loads(answer)), most


def memory_of(session: int) -> int:
    """Bytes of memory that the processes of a session hold, shared pages counted once for each."""
    total = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        total += int(fields[21]) * os.sysconf("SC_PAGE_SIZE") if int(fields[3]) == session else 0
    return total


def row(sketch: Sketch, size: int, seconds: float, folder: Path) -> Row:
    """All methods on a sketch."""
    facts = {}
    memory = 0
    for method in ("greedy", "power", "search"):
        facts[method], memory = solved(sketch, size, method, seconds, folder)
    found = Row(sketch, size, sketch.instance(size).grid.size, *facts.values(), memory)
    print(*found.cells(), file=sys.stderr, flush=True)
    return found


def picture(name: str, folder: Path) -> str:
    """A picture of the greedy field and that of the search side by side, and the Markdown that shows it."""
    fields = {method: cf.read_field(folder / f"{name}.{method}.field.npz") for method in ("greedy", "search")}
    images = []
    for method, field in fields.items():
        title = (
            f"{method}: energy {field.energy().total:.3f}, singularities: {len(field.singularities.index)}"
        )
        images.append(Image.open(cf.draw(field, folder / f"{method}.png", title=title)).convert("RGB"))
    both = Image.new("RGB", (sum(i.width for i in images), max(i.height for i in images)), "white")
    both.paste(images[0], (0, 0))
    both.paste(images[1], (images[0].width, 0))
    path = DOCS / "pictures" / f"fields_{name}.png"
    both.resize((both.width // 2, both.height // 2), Image.Resampling.LANCZOS).save(path, optimize=True)
    return f"![{name}: greedy on the left, search on the right](pictures/{path.name})"


def tiny() -> Iterator[Instance]:
    """Instances that are small enough for a proof: samples as small as they come, and random strokes on 4 x 5 pixels."""
    for name in SAMPLES:
        for size in range(4, 12):
            try:
                instance = cf.sample(name, size)
            except cf.CrossfieldError:  # the outline leaves no room on so coarse a grid
                continue
            if len(instance.theta) >= 3:
                yield instance
                break
    for seed in range(RANDOM):
        rng = np.random.default_rng(seed)
        pixels = np.argwhere(rng.random((4, 5)) < 0.5)
        theta = rng.uniform(0, np.pi, len(pixels))
        yield Instance(f"random_{seed}", np.ones((4, 5), bool), pixels, theta, np.ones(len(pixels)))


def proofs() -> str:
    """The search beside the optimum of `miqp-exact` that a solver proves from the written file."""
    rows, equal, proven = [], 0, 0
    for instance in tiny():
        begin = time.perf_counter()
        field = cf.search(instance, rounds=40).field
        seconds = time.perf_counter() - begin
        greedy, found = cf.greedy(instance).energy().total, field.energy().total
        with tempfile.TemporaryDirectory() as folder:
            write_all(instance, folder, ["miqp-exact"], ["mps"], start=field)
            known = [
                f
                for f in verify(folder, seconds=PROOF_SECONDS, consumers=["gurobi", "scip"]).findings
                if f.step == "solve" and f.objective is not None
            ]
        best = next((f for f in known if f.proven), None)
        bound = max((f.bound for f in known if f.bound is not None), default=None)
        proven += best is not None
        same = (
            best is not None
            and best.objective is not None
            and abs(found - best.objective) <= 1e-6 * max(1, found)
        )
        equal += same
        rows.append(
            [
                instance.name,
                f"{instance.grid.width} x {instance.grid.height}",
                f"{greedy:.7f}",
                f"{found:.7f}",
                f"{seconds:.1f}",
                "" if best is None else f"{best.objective:.7f}",
                f"{best.consumer}, {best.seconds:.1f} s"
                if best
                else f"best bound {bound:.7f}"
                if bound
                else "none",
                "yes" if same else "no" if best else "open",
            ]
        )
        print(*rows[-1], file=sys.stderr, flush=True)
    table = markdown(
        ("instance", "grid", "greedy", "search", "s", "proven optimum", "by", "equal to 1e-6"), rows
    )
    return f"The search is equal to the proven optimum in {equal} of {proven}.\n\n{table}"


def summary(rows: list[Row]) -> str:
    """Whether the search was ever worse, and by how much it was lower."""
    lines = []
    for size in (*SIZES, None):
        chosen = [row for row in rows if size in {row.size, None}]
        worse = sum(row.search["energy_2_norm"] > row.greedy["energy_2_norm"] * (1 + 1e-9) for row in chosen)
        mean = 100 * float(np.mean([row.lower for row in chosen]))
        lines.append(
            [
                "both" if size is None else str(size),
                str(len(chosen)),
                str(worse),
                f"{mean:.1f} %",
                f"{100 * float(np.median([row.lower for row in chosen])):.1f} %",
                f"{100 * max(row.lower for row in chosen):.1f} %",
            ]
        )
    return markdown(("size", "sketches", "search worse", "lower on average", "median", "most"), lines)


def main() -> None:
    """Measure, draw and write the page."""
    parser = argparse.ArgumentParser(description="Compare the methods and write docs/fields.md.")
    parser.add_argument("--sketches", type=Path, help="Folder with further drawings: .svg, .png, .scap.")
    parser.add_argument("--seconds", type=float, default=120.0, help="Time limit of each search.")
    parser.add_argument(
        "--proofs", action="store_true", help="Make the last section again, and leave the others."
    )
    given = parser.parse_args()
    if given.proofs:
        before = (DOCS / "fields.md").read_text().partition(PROOFS)[0]
        (DOCS / "fields.md").write_text(before + PROOFS + proofs() + "\n")
        return
    every = sketches(given.sketches)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = [row(sketch, size, given.seconds, folder) for size in SIZES for sketch in every]
        pictures = [picture(sketch, folder) for sketch in PICTURED]
        large = [row(sketch, LARGE, given.seconds, folder) for sketch in every[-LARGE_SKETCHES:]]
    text = PAGE.format(
        said=said(f"python docs/fields.py --sketches FOLDER --seconds {given.seconds:g}"),
        seconds=f"{given.seconds:g}",
        cores=os.cpu_count(),
        python=platform.python_version(),
        summary=summary(rows),
        table=markdown(COLUMNS, [each.cells() for each in rows]),
        large=markdown(COLUMNS, [each.cells() for each in large]),
        pictures="\n\n".join(pictures),
    )
    (DOCS / "fields.md").write_text(text + PROOFS + proofs() + "\n")


PAGE: Final = """# How good the fields are

{said} The folder is one of line drawings by others; the samples are there without it.

`crossfield solve --method search --time-limit {seconds}` against the greedy strategy of BendFields (`--method greedy`) and the power field with the
best angles for its jumps (`--method power`). Energies are 2-norm energies of fields inside all bounds; lower is better. Singularities, mean
skew abs(beta) in degrees and seconds stand in the order greedy / power + QP / search. {cores} cores, Python {python}. GB: memory of
all processes of the search together, pages that they share counted in each. The search starts from the greedy field and the power field, both
improved, so that it cannot end above either.

{summary}

{table}

## Larger grids

{large}

## Side by side

Size 48; the greedy field on the left, that of the search on the right. Triangles mark singularities.

{pictures}

"""

PROOFS: Final = f"""## Against proven optima

`miqp-exact` is the same problem as a convex MIQP: its file goes to Gurobi (free edition) and SCIP, {PROOF_SECONDS:g} s each. The search takes 40 rounds.

"""

if __name__ == "__main__":
    main()
