"""Content of the log of a run, and parsing of its numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Final, Literal, NamedTuple

MOST_STEPS: Final = 40
"""Steps of a trace that are kept: enough for a plot."""

_HUGE: Final = 1e19  # solvers write infinity as 1e20 and more
_TIMES: Final = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}


class Step(NamedTuple):
    """A moment of a run: seconds since its start, dual bound and best objective then, None without one."""

    seconds: float
    bound: float | None
    objective: float | None


@dataclass(frozen=True)
class RunLog:
    """Facts from the log of one run; None or empty if the log lacks them.

    solver: its name in the table of solvers. ended: `optimal` if the log states a proven optimum and its
    numbers agree, else `limit`. bound: the dual bound at the end; if the log rounds it, the least number that
    rounds to it.
    limit: seconds it was allowed. columns, rows: of the model that it read. trace: in the order of time.
    stamps: digits of the stamps of the problems that it names; text: the whole.
    """

    solver: str
    version: str | None = None
    ended: Literal["optimal", "limit"] | None = None
    bound: float | None = None
    objective: float | None = None
    seconds: float | None = None
    threads: int | None = None
    limit: float | None = None
    columns: int | None = None
    rows: int | None = None
    trace: tuple[Step, ...] = ()
    stamps: frozenset[str] = frozenset()
    text: str = ""


def last(pattern: str, text: str) -> str | None:
    """The first group of the last match of a pattern with lines of a text."""
    found = re.findall(pattern, text, re.MULTILINE)
    return str(found[-1]) if found else None


def number(word: str | None) -> float | None:
    """The number in a word, None for anything else and for infinity."""
    try:
        value = float(word or "nan")
    except ValueError:
        return None
    return value if math.isfinite(value) and abs(value) < _HUGE else None


def share(word: str | None) -> float | None:
    """A share as `1e-4` or `0.01%`."""
    percent = (word or "").endswith("%")
    value = number((word or "").removesuffix("%"))
    return value / 100 if percent and value is not None else value


def whole(word: str | None) -> int | None:
    """The whole number in a word."""
    return int(word) if word is not None and re.fullmatch(r"\d{1,9}", word) else None


def seconds(word: str | None) -> float | None:
    """A time as `6.4s`, `12m`, `3h`, or a plain number of seconds."""
    word = word or ""
    unit = _TIMES.get(word[-1:])
    value = number(word if unit is None else word[:-1])
    return None if value is None or value < 0 else value * (unit or 1.0)


def at_least(word: str | None) -> float | None:
    """The least number that rounds to a printed one: half a unit less."""
    if number(word) is None:
        return None
    try:
        shown = Decimal(str(word))
    except InvalidOperation:
        return None
    exponent = int(shown.as_tuple().exponent)
    return float(shown - Decimal(5).scaleb(exponent - 1))


def thinned(steps: Iterable[Step], bound: float | None) -> tuple[Step, ...]:
    """A trace without steps that change nothing, at most MOST_STEPS of them, with the first and last kept.

    Of steps at one time, which logs round, the last one counts. A bound only grows: a bound above the
    bound at the end, by the rounding of the log, is reduced to it.
    """
    kept: list[Step] = []
    for each in steps:
        cut = each.bound if each.bound is None or bound is None else min(each.bound, bound)
        if kept and kept[-1].seconds >= each.seconds:
            kept.pop()
        if not kept or kept[-1][1:] != (cut, each.objective):
            kept.append(Step(each.seconds, cut, each.objective))
    if len(kept) <= MOST_STEPS:
        return tuple(kept)
    apart = (len(kept) - 1) / (MOST_STEPS - 1)
    return tuple(kept[round(place * apart)] for place in range(MOST_STEPS))
