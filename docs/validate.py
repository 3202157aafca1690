"""Make docs/validation.md, one instance through every route: `python docs/validate.py` (four minutes).

The rows go to docs/validation, and `--page` only writes the page from them. A row of a route is a written
file and the answer of a program, checked by `crossfield verify --solve`. Free licences end, so licensed.json
keeps the last results of each program that needs one.
"""

from __future__ import annotations

import csv
import json
import sys
import tempfile
import time
from argparse import ArgumentParser
from dataclasses import dataclass
from datetime import UTC, datetime
from math import inf
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
from crossfield.models.formulations.catalogue import FORMULATIONS, list_formulations
from crossfield.models.formulations.problem import Problem
from crossfield.models.instance.instance import GAUGES, Gauge, Instance
from make import csv_text, generated_line, markdown

DOCS: Final = Path(__file__).resolve().parent
RECORD: Final = DOCS / "licensed.json"
TABLES: Final = DOCS / "validation"
SECONDS: Final = 15.0
SHAPE: Final = (2, 4)
STROKES: Final = 4
SEED: Final = 1
OPTIMAL: Final = "optimal"
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


def verify_instance(gauge: Gauge, facet: str, formulations: tuple[str, ...]) -> Run:
    """The verification of the instance's files, solves included."""
    instance = instance_of(gauge)
    best = cf.solve(cf.formulate(instance, "milp-mccormick"), start=cf.greedy_field(instance)).field
    with tempfile.TemporaryDirectory() as folder:
        write_all(instance, folder, formulations=formulations, start=best, options={"facet": facet})
        result = verify(folder, seconds=SECONDS, progress=lambda words: print(words, file=sys.stderr))
    return Run(gauge, facet, result)


def route_row(check: Check) -> dict[str, str]:
    """A row about a solve."""
    numbers = ((check.objective, ".9f"), (check.bound, ".9f"), (check.seconds, ".1f"))
    words = {Verdict.AGREES: OPTIMAL, Verdict.LIMIT: f"stopped after {SECONDS:g} s"}
    cells = [
        check.problem.rpartition(" ")[2],
        SOLVERS[check.program].title,
        check.file.rpartition(".")[2],
        *("" if value is None else format(value, digits) for value, digits in numbers),
        words.get(check.verdict, f"{check.verdict}: {check.reason}"),
    ]
    return dict(zip(ROUTES, cells, strict=True))


def route_rows(main: Run) -> list[dict[str, str]]:
    """The solves of each formulation by the solvers that take it."""
    return [
        route_row(check)
        for problem in verified_problems()
        for check in main.solves(problem.name)
        if suitability(problem, check.program).answer == "yes"
    ]


def verified_problems() -> list[Problem]:
    """The smallest problem of each formulation that the sketch of this page can have."""
    return [problem for problem in smallest_problems() if problem.name in list_formulations()]


def variant_rows(runs: list[Run]) -> list[dict[str, Any]]:
    """The misprints as numbers: optimum, and the energy of its field."""
    rows = []
    for run in runs:
        for name in VARIANTS:
            (objective, energy), *more = run.proven(name)
            values = {"optimum": f"{objective:.6f}", "energy of its field": f"{energy:.6f}"}
            facts = {"formulation": name, "gauge": run.gauge, "facet": run.facet}
            rows.append({**facts, **values, "proofs": 1 + len(more)})
    return sorted(rows, key=lambda row: tuple(row.values()))


def reading_rows(runs: list[Run]) -> list[dict[str, Any]]:
    """Number of files that each program read, by result."""
    rows = []
    for name, entry in PROGRAMS.items():
        checks = [f for run in runs for f in run.result.checks if f.program == name and f.step == "read"]
        verdicts = [f.verdict for f in checks]
        by = ["coefficients"] * bool(entry.algebra) + ["values"] * bool(entry.behaviour)
        facts = {
            "program": entry.title,
            "version": runs[0].result.versions.get(name, "absent"),
            "reads": ", ".join(entry.formats),
            "compared by": " and ".join(by),
            "agree": verdicts.count(Verdict.AGREES),
            "refused, as stated": verdicts.count(Verdict.REFUSED),
            "differ": verdicts.count(Verdict.DIFFERS) + verdicts.count(Verdict.FAILED),
        }
        rows.append(facts)
    return rows


def update_record(runs: list[Run]) -> None:
    """Store the results of programs that need a licence."""
    record: dict[str, dict[str, Any]] = json.loads(RECORD.read_text())
    main = runs[0]
    for name, entry in PROGRAMS.items():
        if entry.free and name in main.result.versions:
            checks = [check for run in runs for check in run.result.checks if check.program == name]
            read = [check.verdict for check in checks if check.step == "read"]
            titles = {SOLVERS[solver].title for solver in entry.solvers}
            record[name] = {
                "version": main.result.versions[name],
                "date": datetime.now(UTC).date().isoformat(),
                "files": [read.count(Verdict.AGREES), *map(read.count, (Verdict.DIFFERS, Verdict.FAILED))],
                "routes": [row for row in route_rows(main) if row["solver"] in titles],
            }
    RECORD.write_text(json.dumps(record, indent=1) + "\n")


def capability_rows() -> list[dict[str, str]]:
    """The solvers that take each formulation."""
    return [
        {"formulation": p.name, **{of.title: suitability(p, name).answer for name, of in SOLVERS.items()}}
        for p in smallest_problems()
    ]


def refusal_rows() -> list[dict[str, str]]:
    """The reasons for which solvers do not take a formulation, or answer without proof."""
    return [
        {"solver": entry.title, "trait": trait, "reason": refusal.reason}
        for entry in SOLVERS.values()
        for trait, refusal in entry.refusals.items()
    ]


def measure() -> None:
    """Do everything, and store the rows."""
    begin = time.perf_counter()
    main_run = verify_instance("strokes", "hull", tuple(list_formulations()))
    others = [(gauge, facet) for gauge in GAUGES for facet in ("hull", "printed")][1:]
    runs = [main_run, *(verify_instance(gauge, facet, VARIANTS) for gauge, facet in others)]
    update_record(runs)
    write_rows("reading", reading_rows(runs))
    write_rows("routes", route_rows(main_run))
    write_rows("variants", variant_rows(runs))
    bad = [check for run in runs for check in run.result.failed_checks]
    print(
        f"{time.perf_counter() - begin:.0f} s, {len(bad)} checks with something wrong",
        *bad,
        sep="\n",
        file=sys.stderr,
    )


def write_rows(name: str, rows: list[dict[str, Any]]) -> None:
    """Write rows to a CSV file beside the page."""
    (TABLES / f"{name}.csv").write_text(csv_text(rows))


def read_rows(name: str) -> list[dict[str, str]]:
    """The rows of a CSV file beside the page."""
    with (TABLES / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def table(rows: list[dict[str, str]]) -> str:
    """Rows as a Markdown table."""
    return markdown(tuple(rows[0]), [list(row.values()) for row in rows])


def optima(routes: list[dict[str, str]]) -> list[dict[str, str]]:
    """Best objective of each formulation, the optimum of its kind, and its proofs with their difference."""
    optimum: dict[str, float] = {}
    for row in routes:
        if row["result"] == OPTIMAL:
            kind = FORMULATIONS[row["formulation"]].minimises
            optimum[kind] = min(optimum.get(kind, inf), float(row["objective"]))
    rows = []
    for name in dict.fromkeys(row["formulation"] for row in routes):
        mine = [row for row in routes if row["formulation"] == name]
        proven = [float(row["objective"]) for row in mine if row["result"] == OPTIMAL]
        facts = {
            "formulation": f"`{name}`",
            "best objective": min((row["objective"] for row in mine if row["objective"]), key=float),
            "proven optimum": f"{optimum[FORMULATIONS[name].minimises]:.9f}",
            "proofs": f"{len(proven)} of {len(mine)}",
            "proofs differ by": f"{max(proven) - min(proven):.1g}" if proven else "",
        }
        rows.append(facts)
    return rows


def licences() -> str:
    """Sentence on the last runs with a licence."""
    texts = []
    for name, last in json.loads(RECORD.read_text()).items():
        agree, *bad = last["files"]
        found = f"{agree} files agree" + f", {sum(bad)} do not" * any(bad)
        texts.append(f"{PROGRAMS[name].title} {last['version'].split()[0]} on {last['date']} ({found})")
    return f"Last runs with a licence: {', '.join(texts)}."


SHOWN: Final = ("program", "version", "agree", "refused, as stated", "differ")
"""Columns of the table of readings in the page."""
PAGE: Final = """# One instance, all routes

{generated}

A route is a written file and a solver that reads it. Here free programs take every route of one instance.
{programs} programs read {right} files correctly and {wrong} wrongly. The routes that prove an optimum agree
to {apart}.

The instance has {shape} pixels, {strokes} random strokes and the skew weight 0.001. A solve may take
{seconds:g} s, on one thread where that can be set. Objectives are recomputed at the solver's point.
`crossfield verify DIR --solve SECONDS` makes the same checks for any folder.

## Reading

A program refuses a file *as stated* if crossfield lists beforehand that it cannot read that model.
[reading.csv](validation/reading.csv) also has the formats that it reads.

{reading}

{licences} [licensed.json](licensed.json) has their results.

## Optima

{optima}

Formulations that minimise the same have one optimum, which any of them may prove. Where the best objective is
greater by more than tolerances of solvers, only local solvers answered.

[routes.csv](validation/routes.csv) has each route, and [variants.csv](validation/variants.csv) the effect of
the two [misprints of the paper](errata.md). [solvers.csv](validation/solvers.csv) states which solver takes
which formulation (`local`: it answers without proof), and [refusals.csv](validation/refusals.csv) why one
does not.

## Starting points

{starts}
"""


def page() -> str:
    """The page, from the stored rows."""
    reading, best = read_rows("reading"), optima(read_rows("routes"))
    starts = [{"solver": SOLVERS[name].title, "how": f"`{entry.use}`"} for name, entry in STARTS.items()]
    return PAGE.format(
        generated=generated_line("python docs/validate.py"),
        programs=sum(row["version"] != "absent" for row in reading),
        right=sum(int(row["agree"]) for row in reading),
        wrong=sum(int(row["differ"]) for row in reading),
        apart=max((row["proofs differ by"] for row in best if row["proofs differ by"]), key=float),
        shape=" x ".join(map(str, SHAPE)),
        strokes=STROKES,
        seconds=SECONDS,
        reading=table([{name: row[name] for name in SHOWN} for row in reading if row["version"] != "absent"]),
        licences=licences(),
        optima=table(best),
        starts=table(starts),
    )


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--page", action="store_true", help="only write the page from the stored rows")
    if not parser.parse_args().page:
        measure()
    write_rows("solvers", capability_rows())
    write_rows("refusals", refusal_rows())
    (DOCS / "validation.md").write_text(page())


if __name__ == "__main__":
    main()
