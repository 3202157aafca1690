"""The table of all entries of a library: features, labels and splits, one row per entry."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ....models.field.file import read_field
from ....models.storage import read_bytes
from ..documents.documents import about_file, read_about
from ..plan.recipe import norm_minimised

TABLE: Final = "entries.csv"
OPEN: Final = "open"  # the status `best known` of a sidecar, in one word


@dataclass(frozen=True)
class TableColumn:
    """A column: the type of its values, its meaning, and its value from a sidecar. None: unknown."""

    kind: type[str | int | float | bool]
    meaning: str
    value: Callable[[dict[str, Any]], Any]


def _count(*keys: str) -> Callable[[dict[str, Any]], int]:
    return lambda sidecar: sum(sidecar["counts"][key] for key in keys)


def _at(*keys: str) -> Callable[[dict[str, Any]], Any]:
    def value(sidecar: dict[str, Any]) -> Any:
        value: Any = sidecar
        for key in keys:
            value = value.get(key) if isinstance(value, dict) else None
        return value

    return value


def _proof_seconds(sidecar: dict[str, Any]) -> float | None:
    """Seconds of the fastest run on this entry that proved its optimum."""
    seconds = [run.get("seconds") for run in sidecar["runs"] if run["status"] == "optimal"]
    return min((value for value in seconds if value is not None), default=None)


def _instance(sidecar: dict[str, Any]) -> str:
    return str(sidecar["instance"]["file"]).removesuffix(".instance.json")


def role_of(sidecar: dict[str, Any]) -> str:
    """Return the role of an entry's field: with its fixed jumps, or else the best in its norm.

    The best in the 2-norm stands for an objective that is the energy in no norm.
    """
    if sidecar["jumps"] is not None:
        return "baseline"
    return f"least_{norm_minimised(sidecar['formulation']) or 2}"


def _status(sidecar: dict[str, Any]) -> str:
    return OPEN if sidecar["status"] == "best known" else str(sidecar["status"])


def _optimum(sidecar: dict[str, Any]) -> float | None:
    return float(sidecar["best"]["objective"]) if sidecar["status"] == "optimal" else None


COLUMNS: Final[Mapping[str, TableColumn]] = {
    "name": TableColumn(str, "Name of the entry.", _at("name")),
    "instance": TableColumn(str, "Name of the instance.", _instance),
    "family": TableColumn(str, "Short name of the sketch.", _at("family")),
    "rung": TableColumn(str, "Class of sizes.", _at("rung")),
    "split": TableColumn(str, "Set for machine learning: train, validation or test.", _at("split")),
    "gauge": TableColumn(str, "Window of alpha: strokes or box.", _at("source", "gauge")),
    "formulation": TableColumn(str, "Formulation.", _at("formulation")),
    "facet": TableColumn(str, "Facet (26): hull or printed.", _at("options", "facet")),
    "tightened": TableColumn(
        bool, "In the windows of a certificate.", lambda sidecar: "tightened" in sidecar
    ),
    "problem_class": TableColumn(str, "Class of the problem, as MILP.", _at("class")),
    "probtype": TableColumn(str, "Three letters as in QPLIB.", _at("probtype")),
    "convex": TableColumn(bool, "Whether the continuous relaxation is convex.", _at("convex")),
    "seed": TableColumn(int, "Seed of a random sketch.", _at("source", "seed")),
    "size": TableColumn(int, "Pixels on the longer side.", _at("source", "size")),
    "pixels": TableColumn(int, "Pixels in the mask.", _at("instance", "pixels")),
    "strokes": TableColumn(int, "Pixels with a direction.", _at("instance", "strokes")),
    "pairs": TableColumn(int, "Pairs of neighbours.", _at("instance", "pairs")),
    "density": TableColumn(float, "Share of the pixels with a direction.", _at("density")),
    "columns": TableColumn(int, "Columns.", _count("variables")),
    "rows": TableColumn(int, "Rows.", _count("constraints")),
    "integers": TableColumn(int, "Integer columns, binary ones too.", _count("binary", "integer")),
    "binaries": TableColumn(int, "Binary columns.", _count("binary")),
    "equalities": TableColumn(int, "Rows that are equations.", _count("equalities")),
    "nonzeros": TableColumn(int, "Nonzeros of the rows.", _count("nonzeros")),
    "nonlinear_nonzeros": TableColumn(int, "Nonzeros in nonlinear terms.", _count("nonlinear_nonzeros")),
    "quadratic_rows": TableColumn(int, "Quadratic rows.", _count("quadratic_constraints")),
    "nonlinear_rows": TableColumn(
        int, "Rows beyond quadratic ones.", _count("polynomial_constraints", "general_constraints")
    ),
    "linear_terms": TableColumn(int, "Linear terms of the objective.", _count("objective_linear_terms")),
    "quadratic_terms": TableColumn(
        int, "Quadratic terms of the objective.", _count("objective_quadratic_terms")
    ),
    "nonlinear_terms": TableColumn(
        int,
        "Terms of the objective beyond quadratic ones.",
        _count("objective_higher_terms", "objective_general_terms"),
    ),
    "vortices": TableColumn(
        int, "Singularities of the best known field in the entry's norm.", _at("vortices")
    ),
    "objective": TableColumn(float, "Objective of the best known point.", _at("best", "objective")),
    "optimum": TableColumn(float, "The same if it is proven optimal.", _optimum),
    "bound": TableColumn(float, "Best dual bound.", _at("bound")),
    "gap": TableColumn(float, "Relative gap between both.", _at("gap")),
    "status": TableColumn(str, "Status: optimal, claimed or open.", _status),
    "solved": TableColumn(str, "Kind of proof: certificate, tangent or agreement.", _at("solved", "by")),
    "difficulty": TableColumn(str, "Grade: easy, hard or open.", _at("difficulty")),
    "proof_seconds": TableColumn(
        float, "Seconds of the fastest run that proved the optimum.", _proof_seconds
    ),
    "jumps_file": TableColumn(str, "File of the field with the jumps of the best point.", _at("jumps_file")),
    "licence": TableColumn(str, "Licence.", _at("licence")),
}
"""The columns in order."""


def table(folder: Path, sidecars: Sequence[dict[str, Any]]) -> bytes:
    """Return the table of entries as CSV. folder: holds the documents and fields of their instances.

    Raises InputError, InstanceError for a missing or damaged file.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    vortices: dict[str, int] = {}
    for sidecar in sidecars:
        about = read_about(folder / about_file(_instance(sidecar)))
        file = about["fields"][role_of(sidecar)]["file"]
        if file not in vortices:
            vortices[file] = len(read_field(folder / file).singularities.index)
        known = sidecar | {"vortices": vortices[file], "jumps_file": file}
        writer.writerow([_written(column.value(known)) for column in COLUMNS.values()])
    return text.getvalue().encode()


def read_table(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a table by column, None for unknown values. Raises InputError without the file."""
    return parsed(read_bytes(path))


def parsed(data: bytes) -> list[dict[str, Any]]:
    """Return the rows of the content of a table, as `read_table` does."""
    rows: Iterable[dict[str, str]] = csv.DictReader(io.StringIO(data.decode()))
    return [{key: _read(row[key], column.kind) for key, column in COLUMNS.items()} for row in rows]


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)


def _read(text: str, kind: type[str | int | float | bool]) -> Any:
    if not text:
        return None
    return text == "true" if kind is bool else kind(text)
