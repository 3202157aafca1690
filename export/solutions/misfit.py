"""Names and values of an answer that do not fit a problem."""

from __future__ import annotations

from typing import Final

import numpy as np

from ...models.errors import SolutionError
from ...models.instance.domain import Floats
from ..writing.canonical import CanonicalForm
from .readers.text import NamedValues, RawSolution, unknown_names

_REMEDY: Final = (
    "give the manifest of the model that the program solved, and let it write all columns under their names"
)


def check_names(raw: RawSolution, form: CanonicalForm, mapped: NamedValues) -> None:
    """Raise SolutionError when columns are missing, or most names of the answer are unknown."""
    if not mapped.missing and mapped.unknown <= len(raw.values) // 2:
        return
    columns, parts = form.column_names, []
    if mapped.missing:
        first = columns[np.flatnonzero(np.isnan(mapped.values))[0]].decode()
        of = f"{mapped.missing} of {len(columns)} columns of {form.problem.name}"
        parts.append(f"{of} are missing ({first} is the first)")
    if mapped.unknown:
        name = unknown_names(columns, raw)[0][:40].decode(errors="replace")
        parts.append(f"{mapped.unknown} of its {len(raw.values)} names are unknown (first {name!r})")
    raise SolutionError(f"{' and '.join(parts)}; {_REMEDY}")


def check_range(point: Floats, form: CanonicalForm, largest: float) -> None:
    """Raise SolutionError for a value that no column can have, and name the column."""
    wrong = ~(np.abs(point) <= largest)
    if wrong.any():
        at = int(np.argmax(wrong))
        finite = np.isfinite(point[at])
        why = f"which no column of {form.problem.name} can have" if finite else "which is not finite"
        name = form.column_names[at].decode()
        raise SolutionError(f"{name} has the value {point[at]:g}, {why}; let the solver write it again")
