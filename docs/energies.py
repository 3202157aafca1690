"""Make docs/energies.md: energies of all methods, compared with each other and with proven optima.

    python docs/energies.py [--sketches FOLDER] [--seconds S] [--work FOLDER]

Takes about 2 S seconds for each sample and each sketch of the folder. Each field comes from a separate
`crossfield solve --method`. With --work, finished results stay in that folder, and a repeated command
continues there.
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
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import crossfield as cf
import numpy as np
from crossfield.export.bundle.manifest import write_all
from crossfield.export.verify.verify import Check, verify
from crossfield.models.field.field import CrossField
from crossfield.models.instance.instance import REFERENCE, Instance
from crossfield.models.search.box_qp import fitted
from crossfield.models.sketch.samples import SAMPLES
from make import generated, markdown
from PIL import Image

DOCS: Final = Path(__file__).resolve().parent
SIZES: Final = (24, 48)
LARGE: Final = 128
LARGE_SKETCHES: Final = 4
PICTURED: Final = ("cylinder_bend", "mouse", "singular")
SKETCHES: Final = (".svg", ".png", ".scap")
PROVERS: Final = ("gurobi", "cplex")
PROOF_SECONDS: Final = 60.0
RANDOM: Final = 8  # random instances of 5 x 5 pixels
HUGE: Final = 256
IPOPT_SIZE: Final = 64


@dataclass(frozen=True)
class Sketch:
    """A sample, or a drawing in a file with its mask, if it has one."""

    name: str
    what: str
    mask: Path | None = None

    @property
    def arguments(self) -> list[str]:
        """Its argument on the command line."""
        return [self.what, *(["--mask", str(self.mask)] if self.mask else [])]

    def weights(self, size: int) -> list[str]:
        """The weights whose coefficients at that size are those of the paper, 1 and 1e-6."""
        scale = size / REFERENCE
        return ["--stroke-weight", repr(scale), "--skew-weight", repr(1e-6 * scale**2)]

    def instance(self, size: int) -> Instance:
        """The instance of that size, with the coefficients of the paper."""
        if self.what in SAMPLES:
            found = cf.sample(self.what, size)
        else:
            found = cf.read_sketch(self.what, size=size, mask=self.mask)
        return replace(
            found, stroke_coefficient=Instance.stroke_coefficient, skew_coefficient=Instance.skew_coefficient
        )


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
    """Results of the methods on a sketch.

    improved: energy of the greedy field, improved; the search's memory in bytes, at most.
    """

    sketch: Sketch
    size: int
    pixels: int
    greedy: dict[str, Any]
    power: dict[str, Any]
    search: dict[str, Any]
    improved: float

    @property
    def lower(self) -> float:
        """Relative difference of the search below the greedy field."""
        return share(self.greedy["energy_2_norm"], self.search["energy_2_norm"])

    @property
    def lower_than_improved(self) -> float:
        """Relative difference of the search below the improved greedy field."""
        return share(self.improved, self.search["energy_2_norm"])

    def cells(self) -> list[str]:
        """Its line of the table."""
        facts = (self.greedy, self.power, self.search)
        greedy, power, search = (f"{each['energy_2_norm']:.4f}" for each in facts)
        return [
            self.sketch.name,
            str(self.size),
            str(self.pixels),
            greedy,
            f"{self.improved:.4f}",
            power,
            search,
            f"{100 * self.lower:.1f} % / {100 * self.lower_than_improved:.1f} %",
            " / ".join(str(each["singularities"]) for each in facts),
            " / ".join(f"{each['mean_abs_beta_degrees']:.1f}" for each in facts),
            " / ".join(f"{each['seconds']:.1f}" for each in facts),
            f"{self.search['memory'] / 1e9:.2f}",
        ]


def share(greedy: float, search: float) -> float:
    """Relative difference of the search below; 0 where both energies are only the price of beta."""
    return float((greedy - search) / greedy) if greedy > 1e-3 else 0.0


COLUMNS: Final = (
    "sketch", "size", "pixels", "greedy", "improved", "power + QP", "search", "lower by", "singularities",
    "mean abs(beta)", "seconds", "GB",
)  # fmt: skip


def solved(
    sketch: Sketch, size: int, method: str, seconds: float, folder: Path, *options: str
) -> dict[str, Any]:
    """The facts of `crossfield solve --method`, as from `answered`."""
    command = [
        *("solve", *sketch.arguments, "--size", str(size), *sketch.weights(size), "--method", method),
        *("--time-limit", str(seconds), "--json", "-o", str(folder), *options),
    ]
    return answered(command, folder, sketch.name)


def answered(command: list[str], folder: Path, name: str) -> dict[str, Any]:
    """The JSON output of a command of crossfield, and `memory`: most bytes of its processes.

    It is stored in the folder, with the files of the command, and read from there the next time.
    """
    kept = folder / "facts.json"
    if kept.exists():
        return dict(json.loads(kept.read_text()))
    whole = [sys.executable, "-m", "crossfield", *command]
    with subprocess.Popen(whole, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        most = 0
        while process.poll() is None:
            most = max(most, memory_of(process.pid))
            time.sleep(0.25)
        answer = process.communicate()[0]
    if process.returncode:
        raise SystemExit(f"{name}: exit code {process.returncode}")
    facts = dict(json.loads(answer)) | {"memory": most}
    kept.write_text(json.dumps(facts, indent=1) + "\n")
    return facts


def field_in(folder: Path) -> Path:
    """The field that `solved` wrote to a folder."""
    (path,) = folder.glob("*.field.npz")
    return path


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
    here = place(folder, sketch, size)
    facts = [solved(sketch, size, method, seconds, here / method) for method in ("greedy", "power", "search")]
    greedy = cf.read_field(field_in(here / "greedy"))
    found = Row(sketch, size, greedy.instance.grid.size, *facts, cf.improved_field(greedy).energy().total)
    print(*found.cells(), file=sys.stderr, flush=True)
    return found


def place(folder: Path, sketch: Sketch, size: int) -> Path:
    """The folder for the fields of a sketch of that size."""
    return folder / f"{sketch.name}_{size}"


def picture(sketch: Sketch, folder: Path) -> str:
    """A picture of the greedy field and the search's side by side, and its Markdown."""
    name, here = sketch.name, place(folder, sketch, max(SIZES))
    fields = {method: cf.read_field(field_in(here / method)) for method in ("greedy", "search")}
    images = []
    for method, field in fields.items():
        title = (
            f"{method}: energy {field.energy().total:.3f}, singularities: {len(field.singularities.index)}"
        )
        images.append(Image.open(cf.draw(field, here / f"{method}.png", title=title)).convert("RGB"))
    both = Image.new("RGB", (sum(i.width for i in images), max(i.height for i in images)), "white")
    both.paste(images[0], (0, 0))
    both.paste(images[1], (images[0].width, 0))
    path = DOCS / "pictures" / f"fields_{name}.png"
    both.resize((both.width // 2, both.height // 2), Image.Resampling.LANCZOS).save(path, optimize=True)
    return f"![{name}: greedy on the left, search on the right](pictures/{path.name})"


def best_angles(sketch: Sketch, folder: Path) -> list[str]:
    """Greedy field and angles at size 256, and the angles compared with Ipopt's at size 64."""
    seconds = 600.0
    facts = solved(sketch, HUGE, "greedy", seconds, place(folder, sketch, HUGE) / "greedy")
    large = cold(cf.read_field(field_in(place(folder, sketch, HUGE) / "greedy")))
    begin = time.perf_counter()
    ours = fitted(large).energy().total
    took = time.perf_counter() - begin
    small = cold(cf.greedy_field(sketch.instance(IPOPT_SIZE)))
    ipopt = cf.fit_angles(small, limits=cf.Limits(seconds)).field.energy().total
    cells = [
        sketch.name,
        str(large.instance.grid.size),
        f"{facts['seconds']:.1f}",
        f"{took:.1f}",
        f"{ours:.6f}",
        f"{ipopt:.9f}",
        f"{abs(fitted(small).energy().total - ipopt) / max(1.0, ipopt):.0e}",
    ]
    print(*cells, file=sys.stderr, flush=True)
    return cells


def cold(field: CrossField) -> CrossField:
    """The field with every angle in the middle of its bounds: only its jumps carry information."""
    instance = field.instance
    middle = (instance.alpha_lower + instance.alpha_upper) / 2
    return CrossField(instance, middle, np.zeros(instance.grid.size), field.p)


QP_COLUMNS: Final = (
    "sketch", "pixels at 256", "greedy, s", "QP, s", "energy", "Ipopt's energy at 64", "ours differs by",
)  # fmt: skip


def tiny() -> Iterator[Instance]:
    """Instances small enough for a proof: the smallest samples, and random strokes on 5 x 5 pixels."""
    for name in SAMPLES:
        for size in range(5, 12):
            try:
                instance = Sketch(name, name).instance(size)
            except cf.CrossfieldError:  # the outline leaves no room on so coarse a grid
                continue
            if len(instance.theta) >= 3:
                yield instance
                break
    for seed in range(RANDOM):
        rng = np.random.default_rng(seed)
        pixels = np.argwhere(rng.random((5, 5)) < 0.5)
        theta = rng.uniform(0, np.pi, len(pixels))
        yield Instance(f"random_{seed}", np.ones((5, 5), bool), pixels, theta, np.ones(len(pixels)))


def proofs() -> str:
    """The search compared with the optimum of `miqp-exact` that a solver proves from the written file."""
    rows, equal, proven = [], 0, 0
    for instance in tiny():
        begin = time.perf_counter()
        field = cf.search(instance, rounds=40).field
        seconds = time.perf_counter() - begin
        greedy, found = cf.greedy_field(instance).energy().total, field.energy().total
        best, bound = optimum(instance, field)
        same = best is not None and abs(found - best.objective) <= 1e-6 * max(1, found)
        proven += best is not None
        equal += same
        rows.append(
            [
                instance.name,
                f"{instance.grid.width} x {instance.grid.height}",
                f"{greedy:.7f}",
                f"{found:.7f}",
                f"{seconds:.1f}",
                f"{best.objective:.7f}" if best else f"at least {bound:.7f}" if bound else "",
                f"{best.program}, {best.seconds:.1f} s" if best else "none",
                "yes" if same else "no" if best else "open",
            ]
        )
        print(*rows[-1], file=sys.stderr, flush=True)
    table = markdown(
        ("instance", "grid", "greedy", "search", "s", "proven optimum", "by", "equal to 1e-6"), rows
    )
    return (
        f"The search is equal to the proven optimum in {equal} of {proven}; "
        f"{len(rows) - proven} of {len(rows)} stay open.\n\n{table}"
    )


def optimum(
    instance: Instance, start: CrossField, provers: tuple[str, ...] = PROVERS
) -> tuple[Check | None, float | None]:
    """The check of the first prover that closes `miqp-exact`, or None, and the best dual bound of all."""
    bounds = []
    with tempfile.TemporaryDirectory() as folder:
        write_all(instance, folder, formulations=["miqp-exact"], formats=["mps", "nl"], start=start)
        for prover in provers:
            for check in verify(folder, seconds=PROOF_SECONDS, programs=[prover]).checks:
                if check.step == "solve" and check.proven:
                    return check, check.bound
                if check.step == "solve" and check.bound is not None:
                    bounds.append(check.bound)
    return None, max(bounds, default=None)


def summary(rows: list[Row]) -> str:
    """Whether the search was ever worse, and its mean relative difference."""
    lines = []
    for size in (*SIZES, None):
        chosen = [row for row in rows if size in {row.size, None}]
        worse = sum(row.search["energy_2_norm"] > row.greedy["energy_2_norm"] * (1 + 1e-9) for row in chosen)
        shares = [row.lower for row in chosen]
        numbers = (
            np.mean(shares),
            np.median(shares),
            max(shares),
            np.mean([row.lower_than_improved for row in chosen]),
        )
        lines.append(
            [
                "both" if size is None else str(size),
                str(len(chosen)),
                str(worse),
                *(f"{100 * float(number):.1f} %" for number in numbers),
            ]
        )
    columns = (
        "size",
        "sketches",
        "search worse",
        "lower on average",
        "median",
        "most",
        "than improved, on average",
    )
    return markdown(columns, lines)


def in_short(rows: list[Row], closed: str) -> str:
    """How much lower the search is than other fields, and how often it is the optimum.
    closed: the part about proofs.
    """
    worse = sum(row.search["energy_2_norm"] > row.greedy["energy_2_norm"] * (1 + 1e-9) for row in rows)
    lower, than_improved = (
        100 * float(np.mean(shares))
        for shares in ([row.lower for row in rows], [row.lower_than_improved for row in rows])
    )
    return (
        f"In {len(rows)} cases the search is above the greedy field in {worse}. Its energy is {lower:.1f} "
        f"% lower on average, and {than_improved:.1f} % lower than "
        f"that of the greedy field after local improvement. {closed.partition(';')[0]}, "
        "on grids that are small enough for a proof."
    )


def main() -> None:
    """Measure, draw and write the page."""
    parser = argparse.ArgumentParser(description="Compare the methods and write docs/energies.md.")
    parser.add_argument("--sketches", type=Path, help="Folder with further drawings: .svg, .png, .scap.")
    parser.add_argument("--seconds", type=float, default=120.0, help="Time limit of each search.")
    parser.add_argument("--work", type=Path, help="Folder for what is done; to go on there later.")
    given = parser.parse_args()
    every = sketches(given.sketches)
    with tempfile.TemporaryDirectory() as name:
        folder = given.work or Path(name)
        rows = [row(sketch, size, given.seconds, folder) for size in SIZES for sketch in every]
        large = [row(sketch, LARGE, given.seconds, folder) for sketch in every[-LARGE_SKETCHES:]]
        angles = [best_angles(sketch, folder) for sketch in every[-2:]]
        closed = proofs()
        text = PAGE.format(
            said=generated(f"python docs/energies.py --sketches FOLDER --seconds {given.seconds:g}"),
            seconds=f"{given.seconds:g}",
            cores=os.cpu_count(),
            python=platform.python_version(),
            short=in_short(rows, closed),
            summary=summary(rows),
            table=markdown(COLUMNS, [each.cells() for each in rows]),
            large=markdown(COLUMNS, [each.cells() for each in large]),
            pictures="\n\n".join(picture(sketch, folder) for sketch in named(every, PICTURED)),
            angles=markdown(QP_COLUMNS, angles),
            proof_seconds=f"{PROOF_SECONDS:g}",
            proofs=closed,
        )
    (DOCS / "energies.md").write_text(text)


def named(every: list[Sketch], names: tuple[str, ...]) -> list[Sketch]:
    """The sketches of those names."""
    return [sketch for sketch in every if sketch.name in names]


PAGE: Final = """# How low the energies are

{said} The folder is one of line drawings by others; the samples are there without it.

{short}

`crossfield solve --method search --time-limit {seconds}` against the greedy strategy of BendFields (`--method
greedy`) and the power field with the best angles for its jumps (`--method power`). Energies are 2-norm
energies of fields inside all bounds, under the coefficients of the paper (1 and 1e-6 on every grid); lower
is better. Singularities, mean skew abs(beta) in degrees and
seconds stand in the order greedy / power + QP / search. {cores} cores, Python {python}. GB: memory of all
processes of the search together, pages that they share counted in each. The search starts from the greedy
field and the power field, both improved, so that it cannot end above either; these rows are from before it
began at PolyVector fields and at the dual of a coarse lattice too. *improved* is the greedy field
after local improvement (`crossfield.improved`), from which solvers start; *lower by* is the search against
greedy / against improved.

{summary}

{table}

## Larger grids

{large}

## Side by side

Size 48; the greedy field on the left, that of the search on the right. Red dots mark singularities of
positive index, blue dots those of negative index.

{pictures}

## Angles for given jumps

The greedy field at size 256, and the best angles for its jumps from a cold start: a projected Newton method
with a sparse factorisation (`models/search/box_qp.py`). At size 64, the optimum
of `qp-fixed` that Ipopt finds from the written .nl, and by how much ours differs, relative to it or to 1 if
that is more.

{angles}

## Against proven optima

`miqp-exact` is the same problem as a convex MIQP: its file goes to the free editions of Gurobi, then CPLEX,
{proof_seconds} s each, until one proves the optimum. The search takes 40 rounds.

{proofs}
"""

if __name__ == "__main__":
    main()
