"""The result of a proof: the field, the bound, and every level in a form that can be checked."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final, Literal, Self

from ..field.field import CrossField, Norm
from ..instance.grid import Floats
from .lattice import Lattice
from .state import Clusters

if TYPE_CHECKING:
    from .sweep import Dual

Status = Literal["optimal", "gap"]

EXACT: Final = 1e-9  # gap relative to 1 + energy that rounding leaves when the true gap is zero


@dataclass(frozen=True, eq=False)
class Claim:
    """A field and a proven lower bound of the energy of all fields."""

    field: CrossField
    energy: float
    bound: float
    status: Status

    @property
    def gap(self) -> float:
        """The relative gap, (energy - bound) / energy; 0 where the field is proven optimal."""
        return 0.0 if self.status == "optimal" else (self.energy - self.bound) / max(self.energy, 1e-300)


@dataclass(frozen=True, eq=False, kw_only=True)
class LevelRecord(Lattice):
    """One level of a proof: its lattice and a dual solution on it.

    shares_first, shares_second: flat over pairs in the grid's order, alpha-major: the shares of a pair at the
    labels of its first and of its second pixel; 0 at labels that are not allowed. Whole multiples of
    `quantum`, a power of two, below 2^31 of them (2^49 unless the norm is 2). clusters: the tables of quads,
    also in whole multiples of `quantum`. bound: sum over pixels of min (D + shares) + sum over pairs of min
    (c + tables - shares) + sum over clusters of min (- tables), over allowed labels, minus a bound of its
    rounding error.
    energy: U when the level was pruned; fields outside the next level have more (models/proof/pruning.py).
    """

    shares_first: Floats
    shares_second: Floats
    clusters: Clusters
    quantum: float
    bound: float
    energy: float

    @classmethod
    def of(cls, dual: Dual, energy: float) -> Self:
        """The record of a dual; its shares are first rounded to multiples of their quantum."""
        quantum, state = dual.quantise(energy - dual.bound()), dual.state
        shares = {name: getattr(state, name).copy() for name in ("shares_first", "shares_second")}
        clusters = state.clusters._replace(tables=state.clusters.tables.copy())
        return cls.on(
            dual.lattice, **shares, clusters=clusters, quantum=quantum, bound=dual.bound(), energy=energy
        )

    @classmethod
    def on(cls, lattice: Lattice, **solution: Any) -> Self:
        """The record of a solution on a lattice, which is without cached arrays."""
        return cls(**{each.name: getattr(lattice, each.name) for each in fields(Lattice)}, **solution)


@dataclass(frozen=True, eq=False)
class Proof(Claim):
    """The best field found, and the proven bound.

    Parameters
    ----------
    field
        The field.
    energy
        Its energy in the norm of the proof.
    bound
        No field has a lower energy.
    status
        `optimal` if energy - bound <= 1e-9 (1 + energy), else `gap`. If it is optimal, all jumps are forced
        and the field solves the convex problem that remains.
    forced
        Number of pairs with the same jump in every field that could be better.
    levels
        The last chain of lattices, coarsest first. Each follows from the one before.
    seconds
        Duration of the whole work.
    ended
        `optimal`, `gap` (the requested one), `time`, `work`, `interrupted`, or `labels` if the next level
        would be too large.
    norm
        1, 2 or `mixed`.
    multipliers
        Where pairs count with absolute values and all jumps are forced: the multipliers that prove the least
        energy on the last boxes, shape (2m + s + n,). See models/search/absolute_fit.py.

    """

    forced: int
    levels: tuple[LevelRecord, ...]
    seconds: float
    ended: str
    norm: Norm = 2
    multipliers: Floats | None = None
