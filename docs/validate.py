"""Make docs/validation.md, one instance through every route: `python docs/validate.py` (four minutes).

Every row is a written file, a program that read it, and its answer, checked by `crossfield verify
--solve`.
"""

from __future__ import annotations

import sys
import tempfile
import time
from argparse import ArgumentParser
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import crossfield as cf
import numpy as np
from crossfield.export.bundle.manifest import write_all
from crossfield.export.bundle.starts import STARTS
from crossfield.export.cli.tables import smallest_problems
from crossfield.export.solvers_table import PROGRAMS, SOLVERS, takes
from crossfield.export.verify.checks import Check, Verdict, Verification
from crossfield.export.verify.verify import verify
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.instance.instance import GAUGES, Gauge, Instance
from make import generated, markdown

DOCS: Final = Path(__file__).resolve().parent
SECONDS: Final = 15.0
SHAPE: Final = (2, 4)
STROKES: Final = 4
SEED: Final = 1
VARIANTS: Final = ("milp-mccormick", "miqp-mccormick")
"""The formulations that have both options, gauge and facet."""


def instance_of(gauge: Gauge) -> Instance:
    """The instance: random strokes on a small grid."""
    rng = np.random.default_rng(SEED)
    mask = np.ones(SHAPE, dtype=bool)
    pixels = np.argwhere(mask)[np.sort(rng.permutation(mask.size)[:STROKES])]
    return Instance(
        "small",
        mask,
        pixels,
        rng.uniform(0, np.pi, STROKES),
        np.ones(STROKES),
        skew_coefficient=1e-3,
        gauge=gauge,
    )


@dataclass(frozen=True)
class Run:
    """A verification of the instance under a gauge and a facet."""

    gauge: str
    facet: str
    result: Verification

    def of(self, formulation: str) -> list[Check]:
        """Its solves of a formulation."""
        found = (f for f in self.result.checks if f.problem.endswith(f" {formulation}") and f.step == "solve")
        return sorted(found, key=lambda f: (f.program, f.file))

    def optimum(self, formulation: str) -> float:
        """The best proven value."""
        return min(f.objective for f in self.of(formulation) if f.proven and f.objective is not None)


def run(gauge: Gauge, facet: str, formulations: tuple[str, ...], seconds: float) -> Run:
    """The verification of the instance's files, solves included."""
    instance = instance_of(gauge)
    best = cf.solve(cf.formulate(instance, "milp-mccormick"), start=cf.greedy_field(instance)).field
    with tempfile.TemporaryDirectory() as folder:
        write_all(instance, folder, formulations=formulations, start=best, options={"facet": facet})
        found = verify(folder, seconds=seconds, progress=lambda words: print(words, file=sys.stderr))
    return Run(gauge, facet, found)


def route(check: Check) -> list[str]:
    """A row about a solve."""
    title = SOLVERS[check.program].title
    value = "" if check.objective is None else f"{check.objective:.9f}"
    bound = "" if check.bound is None else f"{check.bound:.9f}"
    words = {
        Verdict.AGREES: "optimal",
        Verdict.LIMIT: f"gave up after {SECONDS:g} s",
        Verdict.REFUSED: f"refused: {check.reason}",
        Verdict.NOT_TRIED: f"not tried: {check.reason}",
    }.get(check.verdict, f"{check.verdict}: {check.reason}")
    seconds = "" if check.seconds is None else f"{check.seconds:.1f}"
    return [title, check.file.rpartition(".")[2], value, bound, seconds, words]


def routes(main: Run) -> list[str]:
    """A table for each formulation."""
    parts = []
    for name in FORMULATIONS:
        found = main.of(name)
        proven = [f.objective for f in found if f.proven and f.objective is not None]
        agree = (
            (
                f"{len(proven)} routes prove an optimum; "
                f"the furthest two are {max(proven) - min(proven):.1e} apart."
            )
            if proven
            else "No route proves an optimum in the time."
        )
        tried = [f for f in found if f.verdict not in {Verdict.REFUSED, Verdict.NOT_TRIED}]
        rest = [f for f in found if f not in tried]
        parts += [
            f"## `{name}`",
            agree,
            markdown(("solver", "file", "objective", "bound", "s", "result"), [route(f) for f in tried]),
        ]
        reasons = sorted({f"- {SOLVERS[f.program].title}: {f.verdict}: {f.reason}." for f in rest})
        parts += ["\n".join(reasons)] if reasons else []
    return parts


def same_problem(main: Run) -> str:
    """Optima of the formulations of the same problem."""
    groups = {
        "2-norm energy": ("minlp-parity", "minlp-quartic", "minlp-cubic", "miqp-exact"),
        "1-norm smoothness, 2-norm rest": ("miqcp-bilinear", "miqp-mccormick"),
        "1-norm energy": ("miqcp-bilinear-l1", "milp-mccormick"),
    }
    rows = []
    for words, names in groups.items():
        for name in names:
            best = min((f.objective for f in main.of(name) if f.objective is not None), default=np.nan)
            proven = any(f.proven for f in main.of(name))
            rows.append([words, f"`{name}`", f"{best:.9f}", "yes" if proven else "no"])
    return markdown(("problem", "formulation", "best objective", "proven"), rows)


def in_short(main: Run, runs: list[Run]) -> str:
    """Numbers of files that were read as intended or not, and of formulations with a proven optimum."""
    found = [f for each in runs for f in each.result.checks if f.step == "read"]
    read = sum(f.verdict == Verdict.AGREES for f in found)
    wrong = sum(f.verdict in {Verdict.DIFFERS, Verdict.FAILED} for f in found)
    values = [
        [f.objective for f in main.of(name) if f.proven and f.objective is not None] for name in FORMULATIONS
    ]
    proven = [each for each in values if each]
    apart = max(max(each) - min(each) for each in proven)
    return (
        f"{len(PROGRAMS)} programs read {read} files as they were meant, and {wrong} otherwise. "
        f"Of the {len(FORMULATIONS)} formulations {len(proven)} are proven optimal "
        f"by {min(map(len, proven))} to {max(map(len, proven))} routes each. "
        f"The proven optima of one formulation are at most {apart:.1e} apart."
    )


def errata(runs: list[Run]) -> str:
    """The misprints as numbers: optimum, and the energy of its field."""
    rows = []
    for each in runs:
        for name in VARIANTS:
            best = min(
                (f for f in each.of(name) if f.proven and f.objective is not None),
                key=lambda f: f.objective or 0.0,
            )
            proofs = sum(f.proven for f in each.of(name))
            rows.append(
                [
                    f"`{name}`",
                    each.gauge,
                    each.facet,
                    f"{best.objective:.6f}",
                    f"{best.energy:.6f}",
                    str(proofs),
                ]
            )
    return markdown(
        ("formulation", "gauge", "facet", "optimum", "energy of its field", "proofs"), sorted(rows)
    )


def readings(runs: list[Run]) -> str:
    """Number of files that each program read, by result."""
    rows = []
    for name, entry in PROGRAMS.items():
        found = [f for each in runs for f in each.result.checks if f.program == name and f.step == "read"]
        counts = [
            str(sum(f.verdict == verdict for f in found))
            for verdict in (Verdict.AGREES, Verdict.REFUSED, Verdict.NOT_TRIED)
        ]
        wrong = sum(f.verdict in {Verdict.DIFFERS, Verdict.FAILED} for f in found)
        version = runs[0].result.versions.get(name, f"absent: {entry.install}")
        by = ["coefficients"] * bool(entry.algebra) + ["values"] * bool(entry.behaviour)
        rows.append([entry.title, version, ", ".join(entry.formats), " and ".join(by), *counts, str(wrong)])
    return markdown(
        ("program", "version", "reads", "compared by", "agree", "refused, as stated", "not tried", "differ"),
        rows,
    )


def capabilities() -> str:
    """The solvers that take each formulation, with the reasons below."""
    marks = {"yes": "yes", "local": "local", "no": "-"}
    rows = [[f"`{p.name}`", *(marks[takes(p, name).answer] for name in SOLVERS)] for p in smallest_problems()]
    reasons = [
        f"- {entry.title}, {trait}: {refusal.reason}."
        for entry in SOLVERS.values()
        for trait, refusal in entry.refusals.items()
    ]
    return f"{markdown(('formulation', *(e.title for e in SOLVERS.values())), rows)}\n\n" + "\n".join(reasons)


def main() -> None:
    """Run everything and write the page."""
    ArgumentParser(description=__doc__).parse_args()
    begin = time.perf_counter()
    main_run = run("strokes", "hull", tuple(FORMULATIONS), SECONDS)
    rest = [
        run(gauge, facet, VARIANTS, SECONDS)
        for gauge in GAUGES
        for facet in ("hull", "printed")
        if (gauge, facet) != ("strokes", "hull")
    ]
    runs = [main_run, *rest]
    grid = f"{SHAPE[0]} x {SHAPE[1]} pixels, {STROKES} of them with a stroke "
    grid += f"in a random direction (seed {SEED}), w_beta = 0.001"
    parts = [
        "# One instance, all routes",
        generated("python docs/validate.py"),
        in_short(main_run, runs),
        (
            f"An instance of {grid}, in all formulations and all formats, handed to every program "
            "that can be had for free. Objectives are recomputed "
            f"from the declaration at the point that the solver gives; the limit is {SECONDS:g} s for each "
            "solve, on one thread where that can be set. "
            "Optima must agree to 1e-6. `crossfield verify DIR --solve` does the same for any folder."
        ),
        "## Reading",
        readings(runs),
        "## The same problem in several formulations",
        same_problem(main_run),
        *routes(main_run),
        "## Gauge and facet",
        (
            "The misprints of the paper as numbers. With the printed facet (26) the optimum falls "
            "below the energy of the field it stands for; with the "
            "printed box (1) it rises."
        ),
        errata(runs),
        "## Who takes what",
        "`local`: it answers without proof. `-`: for the reasons below.",
        capabilities(),
        "## Starting points",
        markdown(
            ("solver", "suffix", "how"),
            [[SOLVERS[name].title, entry.suffix, entry.use] for name, entry in STARTS.items()],
        ),
    ]
    (DOCS / "validation.md").write_text("\n\n".join(parts) + "\n")
    bad = [check for each in runs for check in each.result.bad]
    print(
        f"{time.perf_counter() - begin:.0f} s, {len(bad)} checks with something wrong",
        *bad,
        sep="\n",
        file=sys.stderr,
    )


if __name__ == "__main__":
    main()
