"""No stored lower bound exceeds the best objective of the same problem: study, proofs and library."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import Any

import places
import pytest
from crossfield.models.formulations.catalogue import FORMULATIONS

DOCS, PLAN = places.ROOT / "docs", places.ROOT / "export" / "library" / "plan"
TOKENS = {recipe.short: name for name, recipe in FORMULATIONS.items()}
Values = tuple[Any, Iterable[Any], Iterable[Any]]
"""A problem, objectives and bounds; an empty text or None stands for none."""


def rows(*path: str) -> list[dict[str, str]]:
    with DOCS.joinpath(*path).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def of_solvers() -> Iterator[Values]:
    for row in rows("studying", "data", "solvers.csv"):
        objective = "" if row["status"] == "unknown" else row["objective"]
        yield (row["instance"], row["formulation"]), [objective], [row["bound"], row["root_bound"]]


def of_fields() -> Iterator[Values]:
    problem = ("instance", "size", "norm", "w_strokes", "w_beta", "hidden", "noise", "seed")
    for part in ("quality", "practice"):
        for row in rows("studying", "data", f"{part}.csv"):
            yield (part, *(row[name] for name in problem)), [row[f"energy_{row['norm']}"]], [row["bound"]]


def of_an_hour() -> Iterator[Values]:
    for row in rows("evidence", "solvers-in-an-hour.csv"):
        objective, bound = (row[name].strip("-") for name in ("objective", "bound"))
        yield (row["instance"], row["formulation"]), [objective], [bound]


def of_proofs(document: Any = None, place: str = "") -> Iterator[Values]:
    """Every part of docs/proofs.json that has a bound."""
    if document is None:
        document = json.loads((DOCS / "proofs.json").read_text())
    if "bound" in document:
        yield place, [document.get("energy", document.get("objective"))], [document["bound"]]
    for name, part in document.items():
        if isinstance(part, dict):
            yield from of_proofs(part, f"{place}/{name}")


def of_entries() -> Iterator[Values]:
    with (PLAN / "entries.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            formulation = row["formulation"]
            printed = formulation if row["facet"] == "printed" else ""
            problem = row["instance"], FORMULATIONS[formulation].minimises, printed
            yield problem, [row["objective"]], [row["bound"]]


def of_the_ledger() -> Iterator[Values]:
    for record in json.loads((PLAN / "known" / "ledger.json").read_text())["records"]:
        instance, _, token = record["entry"].removesuffix("_tight").rpartition("_")
        problem = instance, FORMULATIONS[TOKENS[token]].minimises
        if instance.endswith("_printed"):
            problem = instance, token
        yield problem, [record.get("primal")], [record.get("bound")]


def largest_excess(values: Iterator[Values]) -> tuple[float, Any]:
    """The largest excess of a bound over the least objective of a problem, and that problem."""
    objectives, bounds = defaultdict(list), defaultdict(list)
    for problem, energies, lower in values:
        objectives[problem] += [float(value) for value in energies if value not in {"", None}]
        bounds[problem] += [float(value) for value in lower if value not in {"", None}]
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
        (of_an_hour, 1e-5),  # six digits
        (of_proofs, 1e-9),
        (of_entries, 1e-9),
        (of_the_ledger, 1e-6),  # what solvers are asked for
    ],
)
def test_no_bound_exceeds_the_best_objective_of_its_problem(source, tolerance):
    excess, problem = largest_excess(source())
    assert excess <= tolerance, problem
