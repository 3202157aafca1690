"""Size of a model file before and after the presolve of HiGHS."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import highspy

from ...programs.highs import loaded, version
from ...programs.protocol import RefusedError

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


def presolved(folder: Path, entry: dict[str, Any]) -> Presolved | None:
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
