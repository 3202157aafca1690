"""How hard an entry has been so far: easy, hard or open, after MIPLIB's grades.

easy  a run on this very entry, on one thread, ended with a proof of optimality within EASY seconds; or the
      tangent at the best point shows it
hard  an optimum is proven, or a program claims so, in another way: by a longer run, on several threads, by
      the certificate of the instance, or on an equivalent entry
open  nobody has proven an optimum

The grade is of what was measured: an entry on which no solver was run is open, or hard by a certificate.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, Literal

from .ledger import Record

Difficulty = Literal["easy", "hard", "open"]

EASY: Final = 60.0
"""Seconds."""


def difficulty(status: str, runs: Iterable[Record], *, tangent: bool) -> Difficulty:
    """The grade of an entry of a status.

    runs: those on its very problem; tangent: whether that at its point shows the optimum.
    """
    if status == "best known":
        return "open"
    return "easy" if tangent or any(map(_is_quick, runs)) else "hard"


def _is_quick(run: Record) -> bool:
    """Whether a run proved an optimum on one thread, and soon."""
    return run.status == "optimal" and run.threads == 1 and run.seconds is not None and run.seconds <= EASY
