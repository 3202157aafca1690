"""Seeds of random sketches, as a specification writes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from ....models.errors import InputError

MOST_SEEDS: Final = 100_000  # of a sketch: each one becomes many files
_LEAST_RUN: Final = 4  # seeds that a document writes as a range; shorter runs are lists


def seeds_of(stated: str | Sequence[float], place: str) -> tuple[int, ...]:
    """Return the seeds of a list or of a range such as `1-1000`. Raises InputError that names the place."""
    if not isinstance(stated, str):
        return tuple(map(int, stated))  # 4.0 is a whole number too
    first, last = map(int, stated.split("-"))
    if not first <= last < first + MOST_SEEDS:
        raise InputError(f"{place}: {stated!r} must rise, by less than {MOST_SEEDS}; write it as 1-1000")
    return tuple(range(first, last + 1))


def seeds_document(seeds: Sequence[int | None]) -> list[int | None] | str:
    """Return seeds as a specification has them: a range if they are a long run."""
    first, last = seeds[0], seeds[-1]
    run = first is not None and last is not None and list(seeds) == list(range(first, last + 1))
    return f"{first}-{last}" if run and len(seeds) >= _LEAST_RUN else list(seeds)
