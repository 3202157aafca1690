"""Checks of files by programs, and their collection."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from ..formats.registry import program_version


class Verdict(StrEnum):
    """Result of a check of a file with a program."""

    AGREES = "agrees"
    LIMIT = "time limit"
    REFUSED = "refused, as stated"
    NOT_TRIED = "not tried"
    DIFFERS = "differs"
    FAILED = "failed"


_BAD: Final = frozenset({Verdict.DIFFERS, Verdict.FAILED})


@dataclass(frozen=True)
class Check:
    """A check of a file with a program: reading it, or solving it with one of its solvers.

    problem: instance and formulation. program: its name, or the solver's. objective: recomputed at the
    solver's point; bound: its dual bound; attained: an objective that a feasible point has. group: equal for
    problems with the same optimum; relaxes: the group that the file relaxes, whose optimum is at least as
    high.
    """

    problem: str
    file: str
    program: str
    step: str
    verdict: Verdict
    reason: str = ""
    objective: float | None = None
    bound: float | None = None
    attained: float | None = None
    seconds: float | None = None
    proven: bool = False
    group: str = ""
    relaxes: str = ""


@dataclass(frozen=True)
class Verification:
    """All checks, the versions of the programs that took part, and why others are absent."""

    folder: Path
    checks: list[Check] = field(default_factory=list)
    versions: dict[str, str] = field(default_factory=dict)
    absent: dict[str, str] = field(default_factory=dict)

    @property
    def failed_checks(self) -> list[Check]:
        """The checks that found a fault."""
        return [check for check in self.checks if check.verdict in _BAD]

    @property
    def is_ok(self) -> bool:
        """Whether no program differs or failed."""
        return not self.failed_checks

    def document(self) -> dict[str, Any]:
        """The content of verify.json."""
        return {
            "format": "crossfield-verification",
            "version": 2,
            "generator": program_version(),
            "ok": self.is_ok,
            "versions": self.versions,
            "absent": self.absent,
            "checks": [
                {key: value for key, value in asdict(check).items() if value not in (None, "")}
                for check in self.checks
            ],
        }
