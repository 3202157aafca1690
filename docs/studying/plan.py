"""All runs of the study, in the order in which a partial result is most useful."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from crossfield.models.instance.instance import SKEW_WEIGHT, STROKE_WEIGHT

from .fields import MOST_CURVES, PERTURBED, PLAIN, SHARES
from .instances import curves, drawings, surfaces
from .rows import PROOF, Run

WEIGHTS: Final = (1.0, 5.0, 80.0)
"""Weights of the strokes, besides the default."""
SKEWS: Final = (1e-4, 1e-2, 1.0)
"""Weights of the skew, besides the default."""
NOISE: Final = ((0.0, (0,)), (3.0, (0, 1, 2, 3)), (8.0, (0, 1, 2, 3)))
"""Degrees of noise on the strokes of a surface, and seeds."""
SEEDS: Final = (0, 1)
"""Seeds of perturbed fields."""
SEARCHES: Final = (1.0, 3.0)
"""Seconds of searches in the part about quality."""
METHODS_TIMED: Final = ("search", "two-stage", "prove")


@dataclass(frozen=True)
class Plan:
    """Extent of the study: sizes, and numbers of everything; seconds of a run by part."""

    quality: tuple[int, ...] = (24, 32)
    quality_limit: float = 10.0
    practice: tuple[int, ...] = (24, 48, 128, 256)
    practice_limit: float = 10.0
    quick_search: float = 1.0
    hidden: int = 3
    curves: int = MOST_CURVES
    most: int = 99


FULL: Final = Plan()
QUICK: Final = Plan(
    quality=(16,), quality_limit=2.0, practice=(16, 24),
    practice_limit=2.0, quick_search=0.5, hidden=1, curves=1, most=1,
)  # fmt: skip


@dataclass(frozen=True)
class Stage:
    """Runs that may be done in any order."""

    name: str
    runs: tuple[Run, ...]


def stages(plan: Plan, folder: Path | None) -> Iterator[Stage]:
    """The whole plan: small sizes before large ones, parts in turn."""
    practice, quality = (dict(enumerate(runs)) for runs in (plan.practice, plan.quality))
    for number in range(max(len(practice), len(quality))):
        if number in practice:
            yield Stage(f"practice {practice[number]}", tuple(practice_runs(plan, practice[number], folder)))
        if number in quality:
            yield Stage(f"quality {quality[number]}", tuple(quality_runs(plan, quality[number], folder)))
        if number == 1:
            yield Stage("weights", tuple(weight_runs(plan, plan.quality[0], folder)))


def practice_runs(plan: Plan, size: int, folder: Path | None) -> Iterator[Run]:
    """Every way to a field of every drawing, whole and without one curve after the other."""
    timed = [("search", plan.quick_search), *((name, plan.practice_limit) for name in METHODS_TIMED)]
    plain = [(name, 0.0) for name in PLAIN if name != "improved"]
    for curve in range(-1, plan.hidden):
        for name in drawings(folder)[: plan.most]:
            if curve < len(curves(name, size, MOST_CURVES, folder)):
                for way, limit in (*plain, *timed):
                    yield _default("practice", name, size, way, hidden=curve, limit=limit)


def quality_runs(plan: Plan, size: int, folder: Path | None) -> Iterator[Run]:
    """Fields of all qualities, of drawings without a curve and of surfaces."""
    for name, case in _instances(plan, size, folder):
        for way in PLAIN:
            yield _default("quality", name, size, way, **case)
        for share in SHARES if "hidden" in case else ():
            for seed in SEEDS:
                yield _default("quality", name, size, f"{PERTURBED} {share}", **case, seed=seed)
        for limit in dict.fromkeys(min(seconds, plan.quality_limit) for seconds in SEARCHES):
            yield _default("quality", name, size, "search", **case, limit=limit)
        for norm in (2, 1):
            yield _default("quality", name, size, PROOF, **case, norm=norm, limit=plan.quality_limit)


def weight_runs(plan: Plan, size: int, folder: Path | None) -> Iterator[Run]:
    """Greedy and best fields under other weights."""
    for name, case in _instances(plan, size, folder):
        for strokes, skew in (
            *((weight, SKEW_WEIGHT) for weight in WEIGHTS),
            *((STROKE_WEIGHT, weight) for weight in SKEWS),
        ):
            for way, limit in (("greedy", 0.0), (PROOF, plan.quality_limit)):
                changed = {"w_strokes": strokes, "w_beta": skew, "limit": limit}
                yield _default("quality", name, size, way, **case | changed)


def _instances(plan: Plan, size: int, folder: Path | None) -> Iterator[tuple[str, dict[str, float]]]:
    """Drawings with each hidden curve, curve by curve; then surfaces with their noise."""
    for curve in range(plan.curves):
        for name in drawings(folder)[: plan.most]:
            if curve < len(curves(name, size, MOST_CURVES, folder)):
                yield name, {"hidden": curve}
    for degrees, seeds in NOISE:
        for seed in seeds[: plan.most]:
            for name in surfaces()[: plan.most]:
                yield name, {"noise": degrees, "seed": seed}


def _default(part: str, name: str, size: int, way: str, **facts: float) -> Run:
    """A run with the default weights, unless others are given."""
    return Run(part, name, size, way, **{"w_strokes": STROKE_WEIGHT, "w_beta": SKEW_WEIGHT} | facts)  # type: ignore[arg-type]


def expected_seconds(run: Run) -> float:
    """Most seconds of a run, without reading and writing."""
    return run.limit
