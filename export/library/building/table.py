"""The table of all entries of a library: features and labels, one row per entry."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from ....models.storage import read_bytes

TABLE: Final = "entries.csv"


Value = Callable[[dict[str, Any]], Any]
"""Returns the value of a column from a sidecar; None: unknown."""


def _counts(*keys: str) -> Value:
    return lambda sidecar: sum(sidecar["counts"][key] for key in keys)


def _fact(*keys: str) -> Value:
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


def _optimum(sidecar: dict[str, Any]) -> float | None:
    return float(sidecar["best"]["objective"]) if sidecar["status"] == "optimal" else None


COLUMNS: Final[Mapping[str, tuple[type[str | int | float | bool], Value]]] = {
    "name": (str, _fact("name")),
    "instance": (str, instance_name),
    "family": (str, _fact("family")),
    "rung": (str, _fact("rung")),
    "gauge": (str, _fact("source", "gauge")),
    "formulation": (str, _fact("formulation")),
    "facet": (str, _fact("options", "facet")),
    "tightened": (bool, lambda sidecar: "tightened" in sidecar),
    "problem_class": (str, _fact("class")),
    "probtype": (str, _fact("probtype")),
    "convex": (bool, _fact("convex")),
    "seed": (int, _fact("source", "seed")),
    "size": (int, _fact("source", "size")),
    "pixels": (int, _fact("instance", "pixels")),
    "faces": (int, _fact("instance", "faces")),
    "strokes": (int, _fact("instance", "strokes")),
    "pairs": (int, _fact("instance", "pairs")),
    "density": (float, _fact("density")),
    "columns": (int, _counts("variables")),
    "rows": (int, _counts("constraints")),
    "integers": (int, _counts("binary", "integer")),
    "binaries": (int, _counts("binary")),
    "equalities": (int, _counts("equalities")),
    "nonzeros": (int, _counts("nonzeros")),
    "nonlinear_nonzeros": (int, _counts("nonlinear_nonzeros")),
    "quadratic_rows": (int, _counts("quadratic_constraints")),
    "nonlinear_rows": (int, _counts("polynomial_constraints", "general_constraints")),
    "linear_terms": (int, _counts("objective_linear_terms")),
    "quadratic_terms": (int, _counts("objective_quadratic_terms")),
    "nonlinear_terms": (int, _counts("objective_higher_terms", "objective_general_terms")),
    "vortices": (int, _fact("vortices")),
    "objective": (float, _fact("best", "objective")),
    "optimum": (float, _optimum),
    "bound": (float, _fact("bound")),
    "gap": (float, _fact("gap")),
    "status": (str, lambda sidecar: sidecar["status"].replace("best known", "open")),  # in one word
    "solved": (str, _fact("solved", "by")),
    "difficulty": (str, _fact("difficulty")),
    "proof_seconds": (float, _proof_seconds),
    "jumps_file": (str, _fact("jumps_file")),
    "licence": (str, _fact("licence")),
}
"""Types and values of the columns in order; docs/library/columns.csv states their meanings."""


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
        writer.writerow([_format_value(value(known)) for _, value in COLUMNS.values()])
    return text.getvalue().encode()


def read_table(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a table by column, None for unknown values. Raises InputError without the file."""
    names, *rows = csv.reader(io.StringIO(read_bytes(path).decode()))
    texts = dict(zip(names, zip(*rows, strict=True), strict=True))
    values = [[_parse_value(text, kind) for text in texts[key]] for key, (kind, _) in COLUMNS.items()]
    return [dict(zip(COLUMNS, row, strict=True)) for row in zip(*values, strict=True)]


def _format_value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)


def _parse_value(text: str, kind: type[str | int | float | bool]) -> Any:
    if not text:
        return None
    return text == "true" if kind is bool else kind(text)
