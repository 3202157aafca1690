"""The result of a proof: the field, the bound, and every level in a form that can be checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Final, Literal, Self

import numpy as np
from numpy.typing import NDArray

from ..array_archive import Arrays
from ..field.field import CrossField, Norm
from ..instance.grid import Floats
from .check_certificate import STEP_PARTS
from .lattice import Lattice, Starts
from .state import Clusters

if TYPE_CHECKING:
    from .sweep import Dual

Status = Literal["optimal", "gap"]

_MOST_16: Final = 2**15 - 1
_MOST_32: Final = 2**31 - 1
_MOST_64: Final = 2**50  # more than any share has
_KINDS: Final = {"steps_16": np.int16, "steps_32": np.int32, "steps_64": np.int64}
_AT_ONCE: Final = 200_000  # labels whose messages are made together
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

    messages, tables: the arrays of messages and clusters that models/proof/certificate.py describes: whole
    multiples of powers of two. bound: sum over pixels of min (D + shares) + sum over pairs of min (c + tables
    - shares) + sum over clusters of min (- tables), over allowed labels, minus a bound of its rounding error.
    energy: U when the level was pruned; fields outside the next level have more (models/proof/pruning.py).
    """

    messages: Arrays
    tables: Arrays
    bound: float
    energy: float

    @classmethod
    def of(cls, dual: Dual, energy: float, least_gap: float = 0.0) -> Self:
        """The record of a dual, whose shares and tables are first rounded, as for that gap at least."""
        quanta, state = dual.quantise(max(energy - dual.bound(), least_gap)), dual.state
        shares = state.shares_first, state.shares_second
        return cls.on(dual.lattice, shares, state.clusters, quanta=quanta, bound=dual.bound(), energy=energy)

    @classmethod
    def on(
        cls,
        lattice: Lattice,
        shares: Sequence[Floats],
        clusters: Clusters,
        *,
        quanta: tuple[float, float],
        bound: float,
        energy: float,
    ) -> Self:
        """The record of a solution on a lattice, which is without cached arrays.

        shares: those at the first pixels of all pairs, and those at the second ones, in the grid's order,
        alpha-major, 0 at labels that are not allowed. quanta: the powers of two of which shares and tables
        are multiples.
        """
        return cls(
            **{each.name: getattr(lattice, each.name) for each in fields(Lattice)},
            messages=_messages(lattice, shares, quanta[0]),
            tables=_tables(lattice, clusters, quanta[1]),
            bound=bound,
            energy=energy,
        )


def _messages(lattice: Lattice, shares: Sequence[Floats], quantum: float) -> Arrays:
    """The messages from each pair to its earlier pixel, as whole numbers of its scale.

    They are the shares, unless these take more bits than the certificate has.
    """
    grid = lattice.instance.grid
    starts_first, starts_second = lattice.share_starts(grid.first), lattice.share_starts(grid.second)
    parts = []
    for pairs in _blocks(starts_first):
        first, second = grid.first[pairs], grid.second[pairs]
        is_first = first < second
        begin = lattice.share_starts(np.minimum(first, second))
        flat, mine = np.empty(begin[-1]), np.repeat(is_first, np.diff(begin))
        given = shares[0][_span(starts_first, pairs)]
        flat[mine] = given[np.repeat(is_first, lattice.count[first])]
        given = shares[1][_span(starts_second, pairs)]
        flat[~mine] = given[np.repeat(~is_first, lattice.count[second])]
        parts.append(_whole(flat, begin, quantum, lattice.norm))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _blocks(starts: Starts) -> list[NDArray[np.int64]]:
    """The pairs in consecutive blocks with some labels each; one block if there are no pairs."""
    pairs = np.arange(len(starts) - 1)
    return np.split(pairs, np.flatnonzero(np.diff(starts[:-1] // _AT_ONCE)) + 1)


def _span(starts: Starts, pairs: NDArray[np.int64]) -> slice:
    """The shares of consecutive pairs."""
    return slice(starts[pairs[0]], starts[pairs[-1] + 1]) if len(pairs) else slice(0)


def _whole(flat: Floats, begin: Starts, quantum: float, norm: Norm) -> Arrays:
    """Messages one after the other as whole numbers of the scale of each, by differences."""
    narrow, broad = STEP_PARTS[norm]
    few, many = (_MOST_16, _MOST_32) if norm == 2 else (_MOST_32, _MOST_64)
    scale = np.maximum(quantum, _greatest(flat, begin[:-1]) / many)
    flat /= np.repeat(scale, np.diff(begin))
    steps = _steps(np.round(flat, out=flat).astype(np.int64), begin[:-1])
    wide = _greatest(steps, begin[:-1]) > few
    each = np.repeat(wide, np.diff(begin))
    return {
        "scale": scale,
        "wide": wide,
        narrow: steps[~each].astype(_KINDS[narrow]),
        broad: steps[each].astype(_KINDS[broad]),  # modulo its range, because the checker adds them up so
    }


def _tables(lattice: Lattice, clusters: Clusters, quantum: float) -> Arrays:
    """The tables of the clusters, as whole numbers of the scale of each."""
    scale = np.maximum(quantum, _greatest(clusters.tables, clusters.start[:-1]) / _MOST_32)
    steps = np.empty(len(clusters.tables), np.int32)  # modulo 2^32
    for number, each in enumerate(scale.tolist()):
        table = slice(clusters.start[number], clusters.start[number + 1])
        whole = np.round(clusters.tables[table] / each).astype(np.int64)
        steps[table] = np.diff(whole, prepend=0)
    return {
        "quads": lattice.instance.grid.first[clusters.quads[:, 0]].astype(np.int32),
        "table_scale": scale,
        "table_steps": steps,
    }


def _greatest(values: Floats | Starts, begin: Starts) -> Floats:
    """The greatest size of the values in each block."""
    if not len(begin):
        return np.zeros(0)
    greatest = np.maximum(np.maximum.reduceat(values, begin), -np.minimum.reduceat(values, begin))
    return greatest.astype(np.float64)


def _steps(whole: Starts, begin: Starts) -> Starts:
    """Differences of consecutive whole numbers; in the first place of each block, the number itself."""
    steps = np.diff(whole, prepend=0)
    steps[begin] = whole[begin]
    return steps


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
    threads
        Number of threads of the proof, which the check of its certificate takes too.

    """

    forced: int
    levels: tuple[LevelRecord, ...]
    seconds: float
    ended: str
    norm: Norm = 2
    multipliers: Floats | None = None
    threads: int = 1
