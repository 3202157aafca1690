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


def _counts(*keys: str) -> Callable[[dict[str, Any]], int]:
    return lambda sidecar: sum(sidecar["counts"][key] for key in keys)


def _fact(*keys: str) -> Callable[[dict[str, Any]], Any]:
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


def _instance_name(sidecar: dict[str, Any]) -> str:
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
    "name": TableColumn(str, "Name of the entry.", _fact("name")),
    "instance": TableColumn(str, "Name of the instance.", _instance_name),
    "family": TableColumn(str, "Short name of the sketch.", _fact("family")),
    "rung": TableColumn(str, "Class of sizes.", _fact("rung")),
    "split": TableColumn(str, "Set for machine learning: train, validation or test.", _fact("split")),
    "gauge": TableColumn(str, "Window of alpha: strokes or box.", _fact("source", "gauge")),
    "formulation": TableColumn(str, "Formulation.", _fact("formulation")),
    "facet": TableColumn(str, "Facet (26): hull or printed.", _fact("options", "facet")),
    "tightened": TableColumn(
        bool, "In the windows of a certificate.", lambda sidecar: "tightened" in sidecar
    ),
    "problem_class": TableColumn(str, "Class of the problem, as MILP.", _fact("class")),
    "probtype": TableColumn(str, "Three letters as in QPLIB.", _fact("probtype")),
    "convex": TableColumn(bool, "Whether the continuous relaxation is convex.", _fact("convex")),
    "seed": TableColumn(int, "Seed of a random sketch.", _fact("source", "seed")),
    "size": TableColumn(int, "Pixels on the longer side.", _fact("source", "size")),
    "pixels": TableColumn(int, "Pixels in the mask.", _fact("instance", "pixels")),
    "strokes": TableColumn(int, "Pixels with a direction.", _fact("instance", "strokes")),
    "pairs": TableColumn(int, "Pairs of neighbours.", _fact("instance", "pairs")),
    "density": TableColumn(float, "Share of the pixels with a direction.", _fact("density")),
    "columns": TableColumn(int, "Columns.", _counts("variables")),
    "rows": TableColumn(int, "Rows.", _counts("constraints")),
    "integers": TableColumn(int, "Integer columns, binary ones too.", _counts("binary", "integer")),
    "binaries": TableColumn(int, "Binary columns.", _counts("binary")),
    "equalities": TableColumn(int, "Rows that are equations.", _counts("equalities")),
    "nonzeros": TableColumn(int, "Nonzeros of the rows.", _counts("nonzeros")),
    "nonlinear_nonzeros": TableColumn(int, "Nonzeros in nonlinear terms.", _counts("nonlinear_nonzeros")),
    "quadratic_rows": TableColumn(int, "Quadratic rows.", _counts("quadratic_constraints")),
    "nonlinear_rows": TableColumn(
        int, "Rows beyond quadratic ones.", _counts("polynomial_constraints", "general_constraints")
    ),
    "linear_terms": TableColumn(int, "Linear terms of the objective.", _counts("objective_linear_terms")),
    "quadratic_terms": TableColumn(
        int, "Quadratic terms of the objective.", _counts("objective_quadratic_terms")
    ),
    "nonlinear_terms": TableColumn(
        int,
        "Terms of the objective beyond quadratic ones.",
        _counts("objective_higher_terms", "objective_general_terms"),
    ),
    "vortices": TableColumn(
        int, "Singularities of the best known field in the entry's norm.", _fact("vortices")
    ),
    "objective": TableColumn(float, "Objective of the best known point.", _fact("best", "objective")),
    "optimum": TableColumn(float, "The same if it is proven optimal.", _optimum),
    "bound": TableColumn(float, "Best dual bound.", _fact("bound")),
    "gap": TableColumn(float, "Relative gap between both.", _fact("gap")),
    "status": TableColumn(str, "Status: optimal, claimed or open.", _status),
    "solved": TableColumn(str, "Kind of proof: certificate, tangent or agreement.", _fact("solved", "by")),
    "difficulty": TableColumn(str, "Grade: easy, hard or open.", _fact("difficulty")),
    "proof_seconds": TableColumn(
        float, "Seconds of the fastest run that proved the optimum.", _proof_seconds
    ),
    "jumps_file": TableColumn(
        str, "File of the field with the jumps of the best point.", _fact("jumps_file")
    ),
    "licence": TableColumn(str, "Licence.", _fact("licence")),
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
        about = read_about(folder / about_file(_instance_name(sidecar)))
        file = about["fields"][role_of(sidecar)]["file"]
        if file not in vortices:
            vortices[file] = len(read_field(folder / file).singularities.index)
        known = sidecar | {"vortices": vortices[file], "jumps_file": file}
        writer.writerow([_format_value(column.value(known)) for column in COLUMNS.values()])
    return text.getvalue().encode()


def read_table(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a table by column, None for unknown values. Raises InputError without the file."""
    return parse_table(read_bytes(path))


def parse_table(data: bytes) -> list[dict[str, Any]]:
    """Return the rows of the content of a table, as `read_table` does."""
    rows: Iterable[dict[str, str]] = csv.DictReader(io.StringIO(data.decode()))
    return [{key: _parse_value(row[key], column.kind) for key, column in COLUMNS.items()} for row in rows]


def _format_value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)


def _parse_value(text: str, kind: type[str | int | float | bool]) -> Any:
    if not text:
        return None
    return text == "true" if kind is bool else kind(text)
