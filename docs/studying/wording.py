"""Numbers and lists as words of a sentence."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

_NONE: Final = 5e-6  # smaller values are rounding
_WHOLE: Final = 0.1


def percent(share: float) -> str:
    """A share in percent: two digits, or whole percents of what is more than that."""
    if abs(share) < _NONE:
        return "0 %"
    return f"{100 * share:,.0f} %" if abs(share) >= _WHOLE else f"{100 * share:.2g} %"


def series(items: Iterable[object]) -> str:
    """At least one item, with commas between them and "and" before the last one."""
    *most, last = map(str, items)
    return f"{', '.join(most)} and {last}" if most else last
