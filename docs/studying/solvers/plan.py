"""The runs of the study of solvers, in the order in which partial results are most useful."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Final

import crossfield as cf
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.symmetries import turned
from crossfield.models.sketch.samples import SAMPLES

from ..random_curves import instance_of_curves
from ..rows import DATA as FOLDER
from ..rows import Keyed, Rows

INSTANCES: Final[dict[int, tuple[str, ...]]] = {
    25: (
        "cylinder_bend 11", "singular 8", "bottle 11", "pixels 5 7001", "straight 5 7005", "curved 5 7009",
    ),
    50: ("mouse 8", "skew 8", "saddle 10", "pixels 6 7002", "straight 7 7006", "curved 8 7010"),
    100: ("bottle 17", "mouse 11", "ring 16", "pixels 10 7003", "straight 9 7007", "curved 9 7011"),
    200: (
        "saddle 18", "cylinder_bend 21", "skew 15", "pixels 13 7004", "straight 14 7008", "curved 13 7012",
    ),
}  # fmt: skip
"""Instances by their approximate number of pairs: three samples with their sizes, and three random
sketches, kind of strokes, size and seed. No other program of this project uses these seeds."""
PROVE: Final = "prove"
PAIRS: Final = (
    ("milp-mccormick", "highs"),
    ("milp-mccormick", "scip"),
    ("milp-mccormick", "cbc"),
    ("miqp-exact", "scip"),
    ("miqp-exact", "bonmin"),
)
PROBLEMS: Final = ("milp-mccormick", "miqp-exact")
"""Formulations in the 1-norm and in the 2-norm; `prove` solves both problems without a file."""
COMMERCIAL: Final = ("gurobi", "cplex", "xpress")
"""Solvers with a free edition of limited size. BARON's takes 50 columns, fewer than any instance has."""
STARTS: Final = ("cold", "tightened")
MASK_SHARE: Final = 0.8
NOISE: Final = 0.2
"""Standard deviation in radians of the directions along random lines and curves: without it, few of them
leave nothing to optimise."""
LIMIT: Final = 300.0
LONG: Final = 3600.0
LONG_ONES: Final = ("mouse 11", "curved 9 7011")
TURNED: Final = tuple(names[place] for names in INSTANCES.values() for place in (0, 3))
BEST: Final = 3
"""Number of pairs that also get the turned instances and the long runs."""
DATA: Final = FOLDER / "solvers.csv"


@dataclass(frozen=True)
class Run(Keyed):
    """One run. formulation: for `prove`, one that has the same optimum. turns: quarters, of the sketch."""

    instance: str
    formulation: str
    solver: str
    start: str = "cold"
    turns: int = 0
    limit: float = LIMIT


@dataclass(frozen=True)
class Plan:
    """Extent of the study; `QUICK` tries everything on a tiny instance."""

    instances: dict[int, tuple[str, ...]]
    limit: float = LIMIT
    turned: tuple[str, ...] = ()
    long_ones: tuple[str, ...] = ()
    long: float = LONG

    def first(self) -> Iterator[Run]:
        """All proofs, then every pair and free edition, one number of pairs after the other."""
        for names in self.instances.values():
            for name in names:
                yield from (Run(name, formulation, PROVE, limit=self.limit) for formulation in PROBLEMS)
        for names in self.instances.values():
            for name in names:
                for start in STARTS:
                    yield from (Run(name, *pair, start, limit=self.limit) for pair in PAIRS)
            for name in names:
                for formulation in PROBLEMS:
                    yield from (Run(name, formulation, solver, limit=self.limit) for solver in COMMERCIAL)

    def last(self, best: list[tuple[str, str]]) -> Iterator[Run]:
        """The turned instances, then the long runs, of the best pairs; also the long proofs."""
        for turns in (1, 2):
            for name in self.turned:
                yield from (Run(name, *pair, turns=turns, limit=self.limit) for pair in best)
        for name in self.long_ones:
            yield from (Run(name, formulation, PROVE, limit=self.long) for formulation in PROBLEMS)
            yield from (Run(name, *pair, limit=self.long) for pair in best)

    @property
    def size(self) -> int:
        """Number of all runs."""
        return sum(1 for _ in self.first()) + sum(1 for _ in self.last([*PAIRS[:BEST]]))


FULL: Final = Plan(INSTANCES, LIMIT, TURNED, LONG_ONES)
QUICK: Final = Plan({10: ("pixels 3 7000",)}, 5.0, ("pixels 3 7000",), ("pixels 3 7000",), 6.0)


@lru_cache(maxsize=32)
def make_instance(name: str, turns: int = 0) -> Instance:
    """The instance of that name with the default weights, turned by that many quarters."""
    kind, size, *seed = name.split()
    if kind in SAMPLES:
        instance = cf.sample(kind, int(size))
    elif kind == "pixels":
        instance = cf.random_instance(int(seed[0]), size=int(size), mask_share=MASK_SHARE)
    else:
        instance = instance_of_curves(kind, int(size), int(seed[0]), MASK_SHARE, NOISE)
    for _ in range(turns):
        instance = turned(instance)
    return instance


ASKED: Final = tuple(column.name for column in fields(Run))
FOUND: Final = (
    "pairs", "integers", "columns", "version", "status", "objective", "bound", "root_bound", "cpu", "wall",
    "nodes", "integral", "beside", "machine", "note",
)  # fmt: skip
WORDS: Final = frozenset(
    {"instance", "formulation", "solver", "start", "version", "status", "machine", "note"}
)


def table(path: Path = DATA) -> Rows:
    """The rows of a file."""
    return Rows(path, ASKED, FOUND, frozenset(ASKED + FOUND) - WORDS)
