"""Why the names of an answer do not fit a problem: the first of them, how many, and the likely cause."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from ...models.errors import SolutionError
from ...models.formulations.catalogue import declare, list_formulations
from ...models.instance.domain import Floats
from ..writing.canonical import CanonicalForm
from .readers.grammar import spellings
from .readers.text import NamedValues, RawSolution, unknown_names

_OURS: Final = re.compile(rb"([a-z]\w*?)_(?:\d{2,4}_\d{2,4}(?:_[ur])?|\d{2,7})")
_NUMBERED: Final = re.compile(rb"(?:x|c|v|r|col|var|column|_C)_?\[?\(?\d+\)?\]?", re.IGNORECASE)
_LIFTED: Final = "z"


def check_names(raw: RawSolution, form: CanonicalForm, mapped: NamedValues) -> None:
    """Raise SolutionError when columns are missing, or most names of the answer are unknown."""
    if mapped.missing or mapped.unknown > len(raw.values) // 2:
        raise SolutionError(_Misfit(raw, form, mapped.values).message)


@dataclass(frozen=True)
class _Misfit:
    """The names of an answer, and the columns of a problem, which do not fit."""

    raw: RawSolution
    form: CanonicalForm
    values: Floats

    @property
    def message(self) -> str:
        """Missing and unknown names, and the likely cause with its remedy."""
        columns, missing, unknown = self.form.column_names, self._missing, self._unknown
        parts = []
        if missing:
            of = f"{len(missing)} of {len(columns)} columns of {self.form.problem.name}"
            parts.append(f"{of} are missing ({columns[missing[0]].decode()} is the first)")
        if unknown:
            first = unknown[0][:40].decode(errors="replace")
            parts.append(f"{len(unknown)} of its {len(self.raw.values)} names are unknown (first {first!r})")
        return f"{' and '.join(parts)}; {self._cause}"

    @cached_property
    def _missing(self) -> list[int]:
        """Numbers of the columns without a value."""
        return [int(at) for at in np.flatnonzero(np.isnan(self.values))]

    @property
    def _names(self) -> list[bytes]:
        return [] if self.raw.names is None else list(self.raw.names.tolist())

    @cached_property
    def _unknown(self) -> list[bytes]:
        return unknown_names(self.form.column_names, self.raw)

    @property
    def _cause(self) -> str:
        """The likely cause and the remedy."""
        return next(words for holds, words in self._causes() if holds)

    def _causes(self) -> Iterator[tuple[bool, str]]:
        """Possible causes with their remedies, and whether they hold; the first that holds is likely."""
        tags, ours, unknown = _tags(self._names), set(self.form.problem.blocks), self._unknown
        renamed = bool(unknown) and all(map(_NUMBERED.fullmatch, unknown))
        yield renamed, "the program renamed the columns; let it keep the names of the model"
        names = self.form.column_names.tolist()
        tail = not unknown and self._missing == list(range(self._missing[0], len(names)))
        cut = "the file may be cut off; let the solver write it again"
        yield tail and _tags(names[self._missing[0] :][:1]) <= tags, cut
        formulations = self._formulations(tags, ours)
        yield bool(formulations), f"it is probably of {formulations}; give the manifest of that formulation"
        foreign = bool(_tags(unknown) - ours) or (bool(unknown) and not _tags(unknown))
        yield foreign, "it is of another formulation or model; give the manifest of its model"
        kind = self.form.problem.instance.domain.kind
        other = f"it is of another instance, at other {kind}s; give the manifest of its model"
        yield bool(unknown), other
        yield tail, cut
        yield (
            bool(self.raw.values.all()),
            (
                "the program left out columns at 0, which this layout lists; begin the file with a line "
                "`=obj= VALUE`, as MIPLIB does, or let the program write zeros"
            ),
        )
        yield True, "lines are missing in it, or it is of another option; let the solver write it again"

    def _formulations(self, tags: set[str], ours: set[str]) -> str:
        """The formulations that have the kinds of columns in the answer, if this problem has others."""
        if tags == ours or not tags:
            return ""
        instance = self.form.problem.instance
        blocks = {name: set(declare(name, instance).variables) for name in list_formulations(instance)}
        fitting = [name for name, variables in blocks.items() if tags in (variables, variables | {_LIFTED})]
        return " or ".join(name for name in fitting if name != self.form.problem.name)


def _tags(names: Iterable[bytes]) -> set[str]:
    """The symbols of our columns among names."""
    places = (_OURS.fullmatch(spellings(name)[0]) for name in names)
    return {place[1].decode() for place in places if place}


def check_range(point: Floats, form: CanonicalForm, largest: float) -> None:
    """Raise SolutionError for a value that no column can have, and name the column."""
    wrong = ~(np.abs(point) <= largest)
    if wrong.any():
        at = int(np.argmax(wrong))
        finite = np.isfinite(point[at])
        why = f"which no column of {form.problem.name} can have" if finite else "which is not finite"
        name = form.column_names[at].decode()
        raise SolutionError(f"{name} has the value {point[at]:g}, {why}; let the solver write it again")
