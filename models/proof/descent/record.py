"""The result of a proof: the field, the bound, and every level in a form that can be checked."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Final, Literal, Self, cast

from ...array_archive import Arrays
from ...field.field import CrossField, Norm
from ..bound.lattice import Lattice
from ..checkers.check_certificate import ProvenClaim, gap_of, status_of

if TYPE_CHECKING:
    from ..bound.dual import Dual

Status = Literal["optimal", "gap"]

EXACT: Final = 4e-9  # gap relative to 1 + energy at which the prover ends; `status_of` allows a little more


@dataclass(frozen=True, eq=False)
class Claim:
    """A field and a proven lower bound of the energy of all fields."""

    field: CrossField
    energy: float
    bound: float

    @property
    def status(self) -> Status:
        """`optimal` or `gap`, as the checker of certificates calls this energy and bound."""
        return cast("Status", status_of(self.energy, self.bound))

    @property
    def gap(self) -> float:
        """The relative gap, (energy - bound) / energy; 0 where the field is proven optimal."""
        return gap_of(self.energy, self.bound)


@dataclass(frozen=True, eq=False, kw_only=True)
class LevelRecord(Lattice):
    """One level of a proof: its lattice and a dual solution on it.

    shares, tables: the arrays of shares and quads of a certificate (bound/encoding.py). bound: sum
    over pixels of min (D + shares) + sum over pairs of min (c + tables - shares) + sum over clusters of min
    (- tables), over allowed labels, minus a bound of its rounding error. energy: U when the level was pruned;
    fields outside the next level have more (models/proof/bound/pruning.py).
    """

    shares: Arrays
    tables: Arrays
    bound: float
    energy: float

    @property
    def size(self) -> int:
        """Number of allowed labels."""
        return int(self.allowed.sum())

    @classmethod
    def of_dual(cls, dual: Dual, energy: float, least_gap: float = 0.0) -> Self:
        """The record of a dual, whose shares and tables are first rounded, as for that gap at least.

        Where the bound exceeds the energy, rounding costs a small part of the excess.
        """
        quanta = dual.quantise(max(abs(energy - dual.bound()), least_gap))
        return cls.on_lattice(dual.lattice, dual.arrays(quanta), bound=dual.bound(), energy=energy)

    @classmethod
    def on_lattice(
        cls, lattice: Lattice, arrays: tuple[Arrays, Arrays], *, bound: float, energy: float
    ) -> Self:
        """The record of shares and tables on a lattice, which is without cached arrays."""
        values = {entry.name: getattr(lattice, entry.name) for entry in fields(Lattice)}
        return cls(**values, shares=arrays[0], tables=arrays[1], bound=bound, energy=energy)


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
        No field has a lower energy, as the checker confirms: the bound that the certificate claims.
    forced
        Number of pairs with the same jump in every field that could be better.
    levels
        The last chain of lattices, coarsest first, on the parts of the mask that have a stroke. Each covers
        what the one before leaves.
    seconds
        Duration of the work without the check.
    ended
        `optimal`, `gap` (the requested one), `time`, `work`, `interrupted`, `labels` if the next level would
        be too large or prove no more, or `memory` if it took more than there is.
    norm
        1, 2 or `mixed`.
    proven
        Findings of the checker; None before the check.
    pieces
        The arrays of the certificate that prove the last step, None without one.
    reason
        Why nothing is proven, where `ended` does not state it; empty otherwise.

    """

    forced: int
    levels: tuple[LevelRecord, ...]
    seconds: float
    ended: str
    norm: Norm = 2
    pieces: Arrays | None = field(default=None, repr=False)
    reason: str = ""
    proven: ProvenClaim | None = field(default=None, init=False, repr=False)  # `replace` leaves it out
