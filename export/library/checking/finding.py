"""Findings of a verification, and the comparison of objectives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ....models.errors import CrossfieldError

BUILD: Final = "build the library again"
FEASIBLE: Final = 1e-8
"""The greatest violation of a point that a library accepts."""
SAME: Final = 1e-9
"""Objectives this close, relative to their size or absolute, are the same."""


@dataclass(frozen=True)
class Finding:
    """A defect of a library: file, description and remedy."""

    file: str
    what: str
    remedy: str = BUILD

    def __str__(self) -> str:
        return f"{self.file}: {self.what}; {self.remedy}"


def of_error(error: CrossfieldError, file: str) -> Finding:
    """Return an error about a file as a finding; its message names defect and remedy."""
    message = str(error).removeprefix(f"{error.file}: ")
    what, _, remedy = message.partition("; ")
    return Finding(file, what, remedy) if remedy and "; " not in remedy else Finding(file, message)


def is_better(objective: float, known: float) -> bool:
    """Whether an objective is lower than the best known one by more than rounding."""
    return known - objective > SAME * max(abs(known), SAME)


def close(first: float, second: float) -> bool:
    """Whether two objectives are the same up to rounding."""
    try:
        return abs(first - second) <= SAME * max(1.0, abs(first), abs(second))
    except OverflowError:  # JSON may hold whole numbers beyond all doubles
        return False
