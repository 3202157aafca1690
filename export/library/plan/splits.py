"""Seeds, and splits into train, validation and test sets.

A split belongs to a sketch or a seed, never to an entry. So all sizes, gauges and formulations of what is
learned from one set stay out of the others.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Final

from ....models.errors import InputError, shortened

SPLITS: Final = ("train", "validation", "test")
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


def splits_of(stated: str | dict[str, Any], seeds: Sequence[int | None], place: str) -> tuple[str, ...]:
    """Return the split of each seed. stated: one for all, or the seeds of each. Raises InputError."""
    if isinstance(stated, str):
        if stated and stated not in SPLITS:
            raise InputError(f"{place}: there is no {shortened(stated)!r}; choose from {', '.join(SPLITS)}")
        return (stated,) * len(seeds)
    if seeds == (None,):
        raise InputError(f"{place}: a table of seeds goes with random; write one of {', '.join(SPLITS)}")
    split_of_seed: dict[int | None, str] = {}
    for split in (name for name in SPLITS if name in stated):
        for seed in seeds_of(stated[split], f"{place}.{split}"):
            if seed in split_of_seed:
                raise InputError(
                    f"{place}: seed {seed} is in {split_of_seed[seed]} and in {split}; keep it in one"
                )
            split_of_seed[seed] = split
    if strange := sorted(split_of_seed.keys() - set(seeds), key=str):
        raise InputError(f"{place}: {strange[0]} is not in seeds; add it there, or remove it here")
    if missing := [seed for seed in seeds if seed not in split_of_seed]:
        raise InputError(f"{place}: seed {missing[0]} has no split; every seed needs one")
    return tuple(split_of_seed[seed] for seed in seeds)


def check_splits(sources: Iterable[tuple[str, str, str]]) -> None:
    """Raise InputError for a source in two splits. sources: source, split, and the sketch that uses it."""
    splits: dict[str, tuple[str, str]] = {}
    for source, split, name in sources:
        earlier, first = splits.setdefault(source, (split, name))
        if earlier != split:
            raise InputError(
                f"sketches: {source} is in {earlier} of {first} and in {split} of {name}; keep it in one"
            )


def seeds_document(seeds: Sequence[int | None]) -> list[int | None] | str:
    """Return seeds as a specification has them: a range if they are a long run."""
    first, last = seeds[0], seeds[-1]
    run = first is not None and last is not None and list(seeds) == list(range(first, last + 1))
    return f"{first}-{last}" if run and len(seeds) >= _LEAST_RUN else list(seeds)


def split_document(seeds: Sequence[int | None], splits: Sequence[str]) -> dict[str, Any]:
    """Return the key `split` of a sketch as a specification has it; nothing without a split."""
    if len(set(splits)) == 1:
        return {"split": splits[0]} if splits[0] else {}
    named = {
        name: [seed for seed, split in zip(seeds, splits, strict=True) if split == name] for name in SPLITS
    }
    return {"split": {split: seeds_document(chosen) for split, chosen in named.items() if chosen}}
