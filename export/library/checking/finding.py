"""Findings of a verification, and when two numbers count as the same."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ....models.errors import CrossfieldError

BUILD: Final = "build the library again"
FEASIBLE: Final = 1e-8
"""The greatest violation of a point that a library takes."""
SAME: Final = 1e-9
"""Objectives this close, relative to their size or absolute, are the same."""


@dataclass(frozen=True)
class Finding:
    """Something that is wrong with a library: in which file, what, and what helps."""

    file: str
    what: str
    remedy: str = BUILD

    def __str__(self) -> str:
        return f"{self.file}: {self.what}; {self.remedy}"


def of_error(error: CrossfieldError, file: str) -> Finding:
    """An error about a file as a finding; its message names what is wrong and what helps."""
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
