"""The result of a proof: a field, a bound of the energy of all fields, and the arrays that prove it."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal, NamedTuple, Self, cast

import numpy as np

from ...array_archive import Arrays
from ...field.field import CrossField, Norm
from ...instance.file import instance_arrays
from ..checkers import check_certificate, check_orthogonal
from ..checkers.check_certificate import Findings, gap_of, status_of

Status = Literal["optimal", "gap"]

EXACT: Final = 4e-9  # gap relative to 1 + energy at which the prover ends; `status_of` allows a little more
INSTANCE: Final = "instance_"
"""Prefix of the names of the instance's arrays in a certificate."""


class LevelFacts(NamedTuple):
    """Spacing of the labels of a refinement level in radians, their number, and the bound of the level."""

    h: float
    size: int
    bound: float


@dataclass
class Chain:
    """The levels round one centre, coarsest first, and what they prove together.

    arrays: those of the certificate without head, instance and field. convex: bound of the last step. forced:
    number of pairs with the same jump in every field that could be better.
    """

    levels: list[LevelFacts] = field(default_factory=list)
    arrays: Arrays = field(default_factory=dict)
    convex: float = -math.inf
    forced: int = 0

    @property
    def bound(self) -> float:
        """The bound that all levels prove together."""
        return max([0.0, self.convex, *(level.bound for level in self.levels)])

    @property
    def last_of_spacings(self) -> list[LevelFacts]:
        """The last level of each spacing."""
        return list({level.h: level for level in self.levels}.values())

    def add(self, level: LevelFacts, arrays: Arrays) -> None:
        """Add a level with its arrays."""
        self.arrays |= {f"level_{len(self.levels)}_{name}": array for name, array in arrays.items()}
        self.levels.append(level)


@dataclass(frozen=True, eq=False)
class Claim:
    """A field, and a proven lower bound of the energy of all fields: what a certificate claims.

    Parameters
    ----------
    field
        The field. With status `optimal`, its energy is the minimum.
    energy
        Its energy in the norm.
    bound
        No field has a lower energy.
    forced
        Number of pairs whose jump equals the field's in every field that could be better.
    norm
        1, 2 or `mixed`.
    proven
        Findings of the checker; None before the check.

    """

    field: CrossField
    energy: float
    bound: float
    forced: int
    norm: Norm = 2
    proven: Findings | None = dataclasses.field(default=None, init=False, repr=False)  # not by `replace`

    def __repr__(self) -> str:
        numbers = f"norm {self.norm}, energy {self.energy:.6g}, bound {self.bound:.6g}"
        return f"<{type(self).__name__} on {self.field.instance.name}: {self.status}, {numbers}>"

    def confirmed(self, proven: Findings, **changes: Any) -> Self:
        """The claim with the findings of the checker, and with other changes."""
        claim = replace(self, forced=proven.forced, **changes)
        object.__setattr__(claim, "proven", proven)
        return claim

    @property
    def status(self) -> Status:
        """`optimal` or `gap`, as the checker of certificates calls this energy and bound."""
        return cast("Status", status_of(self.energy, self.bound))

    @property
    def gap(self) -> float:
        """The relative gap, (energy - bound) / energy; 0 where the field is proven optimal."""
        return gap_of(self.energy, self.bound)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Proof(Claim):
    """The best field found, the bound that is proven, and how: a claim with its proof.

    Parameters
    ----------
    field, energy, bound, forced, norm, proven
        As in `Claim`.
    levels
        The last chain of levels, coarsest first, on the parts of the mask that have a stroke. Each covers
        what the one before leaves. Empty where nothing is proven, or charges alone prove the bound.
    seconds
        Duration of the work; for crosses of any angle without the check.
    ended
        `optimal`, `gap` (the requested one), `time`, `work`, `interrupted`, `labels` if the next level would
        be too large or prove no more, or `memory` if it took more than there is.
    arrays
        The arrays of the certificate without its head, its instance and its field.
    threshold
        The energy for which the levels of orthogonal crosses were pruned.
    reason
        What is left out for lack of time or memory, or why nothing is proven, where `ended` does not state
        it; empty otherwise.

    """

    levels: tuple[LevelFacts, ...]
    seconds: float
    ended: str
    arrays: Arrays = dataclasses.field(repr=False)
    threshold: float = math.inf
    reason: str = ""

    @property
    def has_bound(self) -> bool:
        """Whether there is something for the checker to confirm: levels, or charges."""
        return bool(self.levels) or "loop_start" in self.arrays

    def certificate(self) -> Arrays:
        """The arrays of the certificate, with the claim."""
        instance, orthogonal = self.field.instance, self.field.instance.orthogonal
        checker = check_orthogonal if orthogonal else check_certificate
        head = {"format": checker.FORMAT, "version": checker.VERSION, "status": self.status}
        head |= {"energy": self.energy, "bound": self.bound}
        of_levels = {"levels": len(self.levels), "norm": self.norm}
        head |= {"threshold": self.threshold} if orthogonal else of_levels
        arrays: Arrays = {"head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8)}
        arrays |= {INSTANCE + name: array for name, array in instance_arrays(instance).items()}
        beta = {} if orthogonal else {"beta": self.field.beta}
        return arrays | {"alpha": self.field.alpha, **beta, "p": self.field.p} | self.arrays

    def with_levels(self, count: int, ended: str) -> Proof:
        """A proof of crosses of any angle, with the first levels alone and no last step; not checked."""
        dropped = tuple(f"level_{number}_" for number in range(count, len(self.levels)))
        kept = {
            name: array
            for name, array in self.arrays.items()
            if not name.startswith(dropped) and name not in ("cuts", "multipliers")
        }
        levels = self.levels[:count]
        return replace(self, levels=levels, arrays=kept, bound=0.0, forced=0, ended=ended)
