"""Content of an entry's page beyond its sidecar: structure, presolve, a plot of runs, loading."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ....models.storage import write_bytes
from ...pictures.sparsity import Pattern, sparsity_picture
from ...pictures.traces import curve, trace_picture
from ..documents.documents import Library, problem_of
from .loading import Way, ways
from .presolve import Presolved, presolved
from .structure import Blocks, blocks, hessian, matrix


@dataclass(frozen=True)
class Study:
    """Results computed from an entry. matrix, hessian: None if empty; blocks: of the Hessian.

    plot: the picture of runs over time, empty without traces.
    """

    matrix: Pattern | None
    hessian: Pattern | None
    blocks: Blocks | None
    presolved: Presolved | None
    ways: list[Way]
    plot: str


def study(library: Library, entry: dict[str, Any], pictures: Path) -> Study:
    """Compute the content of an entry's page and write its pictures, NAME.matrix.svg and so on.

    Raises InputError, InstanceError when the instance is missing, damaged, or another one than the sidecar
    names, and OutputError when a picture cannot be written.
    """
    problem = problem_of(library, entry)
    patterns = {
        kind: pattern
        for kind, pattern in (("matrix", matrix(problem)), ("hessian", hessian(problem)))
        if pattern.entries
    }
    for kind, pattern in patterns.items():
        write_bytes(pictures / f"{entry['name']}.{kind}.svg", sparsity_picture(pattern))
    return Study(
        patterns.get("matrix"),
        patterns.get("hessian"),
        blocks(patterns["hessian"]) if "hessian" in patterns else None,
        presolved(library.folder, entry),
        ways(entry, problem),
        _plot(entry, pictures),
    )


def _plot(entry: dict[str, Any], pictures: Path) -> str:
    """Write the plot of an entry's runs and return its name; empty without traces."""
    curves = [
        curve(f"{run['solver']} {run.get('version', '')}".strip(), run["trace"])
        for run in entry.get("runs", ())
        if run.get("trace")
    ]
    shown = [each for each in curves if each.bounds or each.objectives]
    if not shown:
        return ""
    name = f"{entry['name']}.runs.svg"
    write_bytes(pictures / name, trace_picture(shown))
    return name
