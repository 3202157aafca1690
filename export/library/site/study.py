"""Content of an entry's page beyond its sidecar: structure, presolve, a plot of runs, loading."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import highspy

from ....models.storage import write_bytes
from ...pictures.sparsity import Pattern, sparsity_picture
from ...pictures.traces import curve, trace_picture
from ...programs.highs import loaded, version
from ...programs.protocol import RefusedError
from ..documents.documents import Library, problem_of
from .loading import Way, ways
from .structure import Blocks, blocks, hessian, matrix

LINEAR: Final = ("LP", "MILP")
"""Classes that HiGHS presolves: of a quadratic objective it presolves nothing, and quadratic rows it does not
read.
"""


@dataclass(frozen=True)
class Counts:
    """Columns, integer ones among them, rows and nonzeros of a model."""

    columns: int
    integer: int
    rows: int
    nonzeros: int


@dataclass(frozen=True)
class Presolved:
    """A model file before and after presolve, and the version of HiGHS that did it."""

    file: str
    before: Counts
    after: Counts
    version: str


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
        _presolved(library.folder, entry),
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


def _presolved(folder: Path, entry: dict[str, Any]) -> Presolved | None:
    """Return the size of an entry's .mps or .lp before and after presolve; None for other classes.

    None, too, where there is no such file, or HiGHS does not read it.
    """
    files = [each["name"] for form in ("mps", "lp") for each in entry["files"] if each["format"] == form]
    if entry["class"] not in LINEAR or not files:
        return None
    try:
        highs = loaded(folder / files[0], threads=1)
    except RefusedError:
        return None
    before = _counts(highs.getLp())
    highs.presolve()
    same = highs.getModelPresolveStatus() == highspy.HighsPresolveStatus.kNotReduced
    return Presolved(files[0], before, before if same else _counts(highs.getPresolvedLp()), version())


def _counts(model: Any) -> Counts:
    kinds = [kind for kind in model.integrality_ if kind != highspy.HighsVarType.kContinuous]
    return Counts(model.num_col_, len(kinds), model.num_row_, len(model.a_matrix_.value_))
