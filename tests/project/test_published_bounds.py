"""No published lower bound exceeds the best objective of the same problem: evidence, proofs and library."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import places
import pytest
from crossfield.models.formulations.catalogue import FORMULATIONS

DOCS, PLAN = places.ROOT / "docs", places.ROOT / "export" / "library" / "plan"
TOKENS = {recipe.short: name for name, recipe in FORMULATIONS.items()}
Values = tuple[Any, Any, Any]
"""A problem, an objective and a bound; an empty text or None stands for none."""


def rows(path: str) -> list[dict[str, str]]:
    with (DOCS / path).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def of_solvers() -> Iterator[Values]:
    for row in rows("evidence/runs/solvers.csv"):
        objective = "" if row["status"] == "unknown" else row["objective"]
        for name in ("bound", "root_bound"):
            yield (row["instance"], row["formulation"]), objective, row[name]


def of_fields() -> Iterator[Values]:
    problem = ("instance", "size", "norm", "w_strokes", "w_beta", "hidden", "noise", "seed")
    for part in ("quality", "practice"):
        for row in rows(f"evidence/runs/{part}.csv"):
            yield (part, *(row[name] for name in problem)), row[f"energy_{row['norm']}"], row["bound"]


def of_proofs() -> Iterator[Values]:
    for row in rows("proofs/sketches.csv") + rows("proofs/optima.csv"):
        problem = row["part"], row["row"]
        yield problem, row["energy"], row["bound"]
        yield problem, row.get("other"), ""


def of_entries() -> Iterator[Values]:
    for row in rows("../export/library/plan/entries.csv"):
        printed = row["formulation"] if row["facet"] == "printed" else ""
        problem = row["instance"], FORMULATIONS[row["formulation"]].minimises, printed
        yield problem, row["objective"], row["bound"]


def of_the_ledger() -> Iterator[Values]:
    for record in json.loads((PLAN / "known" / "ledger.json").read_text())["records"]:
        instance, _, token = record["entry"].removesuffix("_tight").rpartition("_")
        printed = instance.endswith("_printed")
        problem = instance, token if printed else FORMULATIONS[TOKENS[token]].minimises
        yield problem, record.get("primal"), record.get("bound")


def largest_excess(values: Iterator[Values]) -> tuple[float, Any]:
    """The largest excess of a bound over the least objective of a problem, and that problem."""
    objectives, bounds = defaultdict(list), defaultdict(list)
    for problem, energy, lower in values:
        objectives[problem] += [float(energy)] if energy not in {"", None} else []
        bounds[problem] += [float(lower)] if lower not in {"", None} else []
    return max(
        ((max(bounds[problem]) - min(known)) / max(1.0, abs(min(known))), problem)
        for problem, known in objectives.items()
        if known and bounds[problem]
    )


@pytest.mark.parametrize(
    "source, tolerance",
    [
        (of_solvers, 1e-5),  # logs round bounds at the root to six digits
        (of_fields, 1e-9),
        (of_proofs, 1e-6),  # what other solvers are asked for
        (of_entries, 1e-9),
        (of_the_ledger, 1e-6),
    ],
)
def test_no_bound_exceeds_the_best_objective_of_its_problem(source, tolerance):
    excess, problem = largest_excess(source())
    assert excess <= tolerance, problem
