"""The table of all entries of a library: features and labels, one row per entry."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ....models.storage import read_bytes

TABLE: Final = "entries.csv"
OPEN: Final = "open"  # the status `best known` of a sidecar, in one word


@dataclass(frozen=True)
class TableColumn:
    """A column: the type of its values, and its value from a sidecar. None: unknown."""

    kind: type[str | int | float | bool]
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


def instance_name(sidecar: dict[str, Any]) -> str:
    """Return the name of an entry's instance."""
    return str(sidecar["instance"]["file"]).removesuffix(".instance.json")


def role_of(sidecar: dict[str, Any]) -> str:
    """Return the role of an entry's field: with its fixed jumps, or else the best in its norm.

    The best in the 2-norm stands for an objective that is the energy in no norm.
    """
    if sidecar["jumps"] is not None:
        return "baseline"
    from ..plan.recipe import norm_minimised

    return f"least_{norm_minimised(sidecar['formulation']) or 2}"


def _status(sidecar: dict[str, Any]) -> str:
    return OPEN if sidecar["status"] == "best known" else str(sidecar["status"])


def _optimum(sidecar: dict[str, Any]) -> float | None:
    return float(sidecar["best"]["objective"]) if sidecar["status"] == "optimal" else None


COLUMNS: Final[Mapping[str, TableColumn]] = {
    "name": TableColumn(str, _fact("name")),
    "instance": TableColumn(str, instance_name),
    "family": TableColumn(str, _fact("family")),
    "rung": TableColumn(str, _fact("rung")),
    "gauge": TableColumn(str, _fact("source", "gauge")),
    "formulation": TableColumn(str, _fact("formulation")),
    "facet": TableColumn(str, _fact("options", "facet")),
    "tightened": TableColumn(bool, lambda sidecar: "tightened" in sidecar),
    "problem_class": TableColumn(str, _fact("class")),
    "probtype": TableColumn(str, _fact("probtype")),
    "convex": TableColumn(bool, _fact("convex")),
    "seed": TableColumn(int, _fact("source", "seed")),
    "size": TableColumn(int, _fact("source", "size")),
    "pixels": TableColumn(int, _fact("instance", "pixels")),
    "faces": TableColumn(int, _fact("instance", "faces")),
    "strokes": TableColumn(int, _fact("instance", "strokes")),
    "pairs": TableColumn(int, _fact("instance", "pairs")),
    "density": TableColumn(float, _fact("density")),
    "columns": TableColumn(int, _counts("variables")),
    "rows": TableColumn(int, _counts("constraints")),
    "integers": TableColumn(int, _counts("binary", "integer")),
    "binaries": TableColumn(int, _counts("binary")),
    "equalities": TableColumn(int, _counts("equalities")),
    "nonzeros": TableColumn(int, _counts("nonzeros")),
    "nonlinear_nonzeros": TableColumn(int, _counts("nonlinear_nonzeros")),
    "quadratic_rows": TableColumn(int, _counts("quadratic_constraints")),
    "nonlinear_rows": TableColumn(int, _counts("polynomial_constraints", "general_constraints")),
    "linear_terms": TableColumn(int, _counts("objective_linear_terms")),
    "quadratic_terms": TableColumn(int, _counts("objective_quadratic_terms")),
    "nonlinear_terms": TableColumn(
        int,
        _counts("objective_higher_terms", "objective_general_terms"),
    ),
    "vortices": TableColumn(int, _fact("vortices")),
    "objective": TableColumn(float, _fact("best", "objective")),
    "optimum": TableColumn(float, _optimum),
    "bound": TableColumn(float, _fact("bound")),
    "gap": TableColumn(float, _fact("gap")),
    "status": TableColumn(str, _status),
    "solved": TableColumn(str, _fact("solved", "by")),
    "difficulty": TableColumn(str, _fact("difficulty")),
    "proof_seconds": TableColumn(float, _proof_seconds),
    "jumps_file": TableColumn(str, _fact("jumps_file")),
    "licence": TableColumn(str, _fact("licence")),
}
"""The columns in order; docs/library/columns.csv states their meanings."""


def table(folder: Path, sidecars: Sequence[dict[str, Any]]) -> bytes:
    """Return the table of entries as CSV. folder: holds the documents and fields of their instances.

    Raises InputError, InstanceError for a missing or damaged file.
    """
    from ....models.field.file import read_field
    from ..documents.documents import about_file, load_document

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    vortices: dict[str, int] = {}
    for sidecar in sidecars:
        about = load_document(folder / about_file(instance_name(sidecar)))
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
    names, *rows = csv.reader(io.StringIO(data.decode()))
    texts = dict(zip(names, zip(*rows, strict=True), strict=True))
    values = [[_parse_value(text, column.kind) for text in texts[key]] for key, column in COLUMNS.items()]
    return [dict(zip(COLUMNS, row, strict=True)) for row in zip(*values, strict=True)]


def _format_value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)


def _parse_value(text: str, kind: type[str | int | float | bool]) -> Any:
    if not text:
        return None
    return text == "true" if kind is bool else kind(text)
