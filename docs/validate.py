"""Make docs/validation.md, one instance through every route: `python docs/validate.py` (four minutes).

Every row is a written file and the answer of a program, checked by `crossfield verify --solve`. Free licences
end, so licensed.json keeps the last results of each program that needs one.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from argparse import ArgumentParser
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import crossfield as cf
import numpy as np
from crossfield.export.bundle.problem_files import write_all
from crossfield.export.bundle.starts import STARTS
from crossfield.export.cli.tables import smallest_problems
from crossfield.export.solvers_table import PROGRAMS, SOLVERS, suitability
from crossfield.export.verify.checks import Check, Verdict, Verification
from crossfield.export.verify.verify import verify
from crossfield.models.formulations.catalogue import list_formulations
from crossfield.models.formulations.problem import Problem
from crossfield.models.instance.instance import GAUGES, Gauge, Instance
from make import generated_line, markdown

DOCS: Final = Path(__file__).resolve().parent
RECORD: Final = DOCS / "licensed.json"
SECONDS: Final = 15.0
SHAPE: Final = (2, 4)
STROKES: Final = 4
SEED: Final = 1
ROUTES: Final = ("formulation", "solver", "file", "objective", "bound", "s", "result")
VARIANTS: Final = ("milp-mccormick", "miqp-mccormick")
"""The formulations that have both options, gauge and facet."""


def instance_of(gauge: Gauge) -> Instance:
    """The instance: random strokes on a small grid."""
    rng = np.random.default_rng(SEED)
    mask = np.ones(SHAPE, dtype=bool)
    pixels = np.argwhere(mask)[np.sort(rng.permutation(mask.size)[:STROKES])]
    return Instance.on_pixels(
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

    def solves(self, formulation: str) -> list[Check]:
        """Its solves of a formulation."""
        checks = (
            f for f in self.result.checks if f.problem.endswith(f" {formulation}") and f.step == "solve"
        )
        return sorted(checks, key=lambda f: (f.program, f.file))

    def proven(self, formulation: str) -> list[tuple[float, float]]:
        """Objective and energy of each proven optimum, in ascending order."""
        solves = self.solves(formulation)
        return sorted((f.objective, f.energy or 0.0) for f in solves if f.proven and f.objective is not None)

    def apart(self, formulation: str) -> float:
        """Largest difference between its proven optima."""
        values = [value for value, _ in self.proven(formulation)]
        return values[-1] - values[0]


def verify_instance(gauge: Gauge, facet: str, formulations: tuple[str, ...]) -> Run:
    """The verification of the instance's files, solves included."""
    instance = instance_of(gauge)
    best = cf.solve(cf.formulate(instance, "milp-mccormick"), start=cf.greedy_field(instance)).field
    with tempfile.TemporaryDirectory() as folder:
        write_all(instance, folder, formulations=formulations, start=best, options={"facet": facet})
        result = verify(folder, seconds=SECONDS, progress=lambda words: print(words, file=sys.stderr))
    return Run(gauge, facet, result)


def route_row(check: Check) -> list[str]:
    """A row about a solve."""
    numbers = ((check.objective, ".9f"), (check.bound, ".9f"), (check.seconds, ".1f"))
    words = {Verdict.AGREES: "optimal", Verdict.LIMIT: f"stopped after {SECONDS:g} s"}
    return [
        SOLVERS[check.program].title,
        check.file.rpartition(".")[2],
        *("" if value is None else format(value, digits) for value, digits in numbers),
        words.get(check.verdict, f"{check.verdict}: {check.reason}"),
    ]


def verified_problems() -> list[Problem]:
    """The smallest problem of each formulation that the sketch of this page can have."""
    return [problem for problem in smallest_problems() if problem.name in list_formulations()]


def route_tables(main: Run) -> list[str]:
    """A table for each formulation, of the solvers that take it."""
    parts = []
    for problem in verified_problems():
        checks = [f for f in main.solves(problem.name) if suitability(problem, f.program).answer == "yes"]
        proven = "No route proves the optimum in time."
        if proofs := len(main.proven(problem.name)):
            proven = (
                f"{proofs} routes prove the optimum. Their values differ by {main.apart(problem.name):.1e}."
            )
        parts += [
            f"## `{problem.name}`",
            proven,
            markdown(ROUTES[1:], [route_row(f) for f in checks]),
        ]
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
            best = min((f.objective for f in main.solves(name) if f.objective is not None), default=np.nan)
            rows.append([words, f"`{name}`", f"{best:.9f}", "yes" if main.proven(name) else "no"])
    return markdown(("problem", "formulation", "best objective", "proven"), rows)


def short_summary(main: Run, runs: list[Run]) -> str:
    """Numbers of files that were read as intended or not, and of formulations with a proven optimum."""
    verdicts = [f.verdict for run in runs for f in run.result.checks if f.step == "read"]
    proven = [name for name in list_formulations() if main.proven(name)]
    counts = [len(main.proven(name)) for name in proven]
    return (
        f"{len(main.result.versions)} programs read {verdicts.count(Verdict.AGREES)} files correctly and "
        f"{verdicts.count(Verdict.DIFFERS) + verdicts.count(Verdict.FAILED)} wrongly. "
        f"{len(proven)} of the {len(list_formulations())} formulations are proven optimal, "
        f"each by {min(counts)} to {max(counts)} routes. "
        f"The proven optima of a formulation differ by at most {max(map(main.apart, proven)):.1e}."
    )


def errata(runs: list[Run]) -> str:
    """The misprints as numbers: optimum, and the energy of its field."""
    rows = []
    for run in runs:
        for name in VARIANTS:
            (objective, energy), *more = run.proven(name)
            numbers = (f"{objective:.6f}", f"{energy:.6f}", str(1 + len(more)))
            rows.append([f"`{name}`", run.gauge, run.facet, *numbers])
    return markdown(
        ("formulation", "gauge", "facet", "optimum", "energy of its field", "proofs"), sorted(rows)
    )


def readings(runs: list[Run]) -> str:
    """Number of files that each program read, by result."""
    rows = []
    for name, entry in PROGRAMS.items():
        checks = [f for run in runs for f in run.result.checks if f.program == name and f.step == "read"]
        verdicts = [f.verdict for f in checks]
        counts = [verdicts.count(verdict) for verdict in (Verdict.AGREES, Verdict.REFUSED, Verdict.NOT_TRIED)]
        counts.append(verdicts.count(Verdict.DIFFERS) + verdicts.count(Verdict.FAILED))
        version = runs[0].result.versions.get(name, "absent")
        by = ["coefficients"] * bool(entry.algebra) + ["values"] * bool(entry.behaviour)
        rows.append([entry.title, version, ", ".join(entry.formats), " and ".join(by), *map(str, counts)])
    return markdown(
        ("program", "version", "reads", "compared by", "agree", "refused, as stated", "not tried", "differ"),
        rows,
    )


def update_record(runs: list[Run]) -> dict[str, dict[str, Any]]:
    """Store the results of programs that need a licence, and return the last ones of each."""
    record: dict[str, dict[str, Any]] = json.loads(RECORD.read_text())
    main = runs[0]
    for name, entry in PROGRAMS.items():
        if entry.free and name in main.result.versions:
            checks = [check for run in runs for check in run.result.checks if check.program == name]
            read = [check.verdict for check in checks if check.step == "read"]
            record[name] = {
                "version": main.result.versions[name],
                "date": datetime.now(UTC).date().isoformat(),
                "files": [read.count(Verdict.AGREES), *map(read.count, (Verdict.DIFFERS, Verdict.FAILED))],
                "routes": [
                    [f"`{problem.name}`", *route_row(check)]
                    for problem in verified_problems()
                    for check in main.solves(problem.name)
                    if check.program in entry.solvers and check.verdict != Verdict.NOT_TRIED
                    if suitability(problem, check.program).answer == "yes"
                ],
            }
    RECORD.write_text(json.dumps(record, indent=1) + "\n")
    return record


def licences(record: dict[str, dict[str, Any]], present: dict[str, str]) -> list[str]:
    """The table of the last runs with a licence, and the results of programs that are absent now."""
    rows = []
    for name, last in record.items():
        titles = [PROGRAMS[name].title, *(SOLVERS[solver].title for solver in PROGRAMS[name].solvers)]
        rows.append(
            [", ".join(dict.fromkeys(titles)), last["version"], last["date"], *map(str, last["files"])]
        )
    absent = [line for name, last in record.items() if name not in present for line in last["routes"]]
    title = "Results of that run, for programs that are left out above:"
    return [
        (
            "The free licences of these programs end, except that of CPLEX. "
            "A program that does not accept its licence is left out above. "
            "The tests also solve `.bar` files of up to 10 columns with BARON, "
            "which needs no licence for them."
        ),
        markdown(
            ("program", "version", "last run with a licence", "files that agree", "differ", "failed"), rows
        ),
        *([title, markdown(ROUTES, absent)] if absent else []),
    ]


def capabilities() -> list[str]:
    """The solvers that take each formulation, and the reasons of the others."""
    marks = {"yes": "yes", "local": "local", "no": "-"}
    rows = [
        [f"`{p.name}`", *(marks[suitability(p, name).answer] for name in SOLVERS)]
        for p in smallest_problems()
    ]
    reasons = [
        [entry.title, trait, refusal.reason]
        for entry in SOLVERS.values()
        for trait, refusal in entry.refusals.items()
    ]
    return [
        markdown(("formulation", *(entry.title for entry in SOLVERS.values())), rows),
        markdown(("solver", "trait", "reason"), reasons),
    ]


def main() -> None:
    """Run everything and write the page."""
    ArgumentParser(description=__doc__).parse_args()
    begin = time.perf_counter()
    main_run = verify_instance("strokes", "hull", tuple(list_formulations()))
    others = [(gauge, facet) for gauge in GAUGES for facet in ("hull", "printed")][1:]
    runs = [main_run, *(verify_instance(gauge, facet, VARIANTS) for gauge, facet in others)]
    parts = [
        "# One instance, all routes",
        generated_line("python docs/validate.py"),
        (
            "Results of free programs on one small instance, in every formulation and format. "
            "A route is a written file and a solver that reads it."
        ),
        short_summary(main_run, runs),
        f"""\
- The instance has {SHAPE[0]} x {SHAPE[1]} pixels and w_beta = 0.001. {STROKES} pixels have a stroke in a
  random direction (seed {SEED}).
- Each solve may take {SECONDS:g} s, on one thread where that can be set.
  Seconds depend on the load of the machine.
- Objectives are recomputed from the declaration at the solver's point. Optima must agree to 1e-6.
- Solvers are listed for the formulations that they [take](#solvers-and-formulations).

`crossfield verify DIR --solve SECONDS` makes the same checks for any folder. It writes `verify.json`.""",
        "## Reading",
        readings(runs),
        "## Licences",
        *licences(update_record(runs), main_run.result.versions),
        "## The same problem in several formulations",
        same_problem(main_run),
        *route_tables(main_run),
        "## Gauge and facet",
        (
            "The effect of the two [misprints of the paper](errata.md). The printed facet (26) lowers the "
            "optimum below the energy of its field. The printed box (1) raises the optimum."
        ),
        errata(runs),
        "## Solvers and formulations",
        "`local`: the solver answers without proof. `-`: it does not take the formulation. Reasons follow.",
        *capabilities(),
        "## Starting points",
        markdown(
            ("solver", "suffix", "how"),
            [[SOLVERS[name].title, entry.suffix, entry.use] for name, entry in STARTS.items()],
        ),
    ]
    (DOCS / "validation.md").write_text("\n\n".join(parts) + "\n")
    bad = [check for run in runs for check in run.result.failed_checks]
    print(
        f"{time.perf_counter() - begin:.0f} s, {len(bad)} checks with something wrong",
        *bad,
        sep="\n",
        file=sys.stderr,
    )


if __name__ == "__main__":
    main()
