"""Why the names of an answer do not fit a problem: the first of them, how many, and the likely cause."""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from ...models.errors import SolutionError
from ...models.instance.domain import Floats
from ..writing.canonical import CanonicalForm
from .readers.text import NamedValues, RawSolution, unknown_names

_NUMBERED: Final = re.compile(rb"(?:x|c|v|r|col|var|column|_C)_?\[?\(?\d+\)?\]?", re.IGNORECASE)


def check_names(raw: RawSolution, form: CanonicalForm, mapped: NamedValues) -> None:
    """Raise SolutionError when columns are missing, or most names of the answer are unknown."""
    if not mapped.missing and mapped.unknown <= len(raw.values) // 2:
        return
    columns, parts = form.column_names, []
    missing, unknown = np.flatnonzero(np.isnan(mapped.values)), unknown_names(columns, raw)
    if len(missing):
        of = f"{len(missing)} of {len(columns)} columns of {form.problem.name}"
        parts.append(f"{of} are missing ({columns[missing[0]].decode()} is the first)")
    if unknown:
        first = unknown[0][:40].decode(errors="replace")
        parts.append(f"{len(unknown)} of its {len(raw.values)} names are unknown (first {first!r})")
    if unknown and all(map(_NUMBERED.fullmatch, unknown)):
        cause = "the program renamed the columns; let it keep the names of the model"
    elif unknown:
        cause = "it is of another formulation, instance or model; give the manifest of its model"
    elif raw.values.all() and missing[0] + len(missing) < len(columns):
        cause = (
            "the program left out columns at 0, which this layout lists; begin the file with a line "
            "`=obj= VALUE`, as MIPLIB does, or let the program write zeros"
        )
    else:
        cause = (
            "the file may be cut off, or of another formulation or option; let the solver write it again, or "
            "give the manifest of its model"
        )
    raise SolutionError(f"{' and '.join(parts)}; {cause}")


def check_range(point: Floats, form: CanonicalForm, largest: float) -> None:
    """Raise SolutionError for a value that no column can have, and name the column."""
    wrong = ~(np.abs(point) <= largest)
    if wrong.any():
        at = int(np.argmax(wrong))
        finite = np.isfinite(point[at])
        why = f"which no column of {form.problem.name} can have" if finite else "which is not finite"
        name = form.column_names[at].decode()
        raise SolutionError(f"{name} has the value {point[at]:g}, {why}; let the solver write it again")
