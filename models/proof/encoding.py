"""Shares and tables of a level as the whole numbers of a certificate; see models/proof/certificate.py."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..array_archive import Arrays
from ..field.field import Norm
from ..instance.grid import Floats
from .check_certificate import STEP_PARTS
from .lattice import Lattice, Starts, starts
from .state import Clusters

_MOST_16: Final = 2**15 - 1
_MOST_32: Final = 2**31 - 1
_MOST_64: Final = 2**50  # more than any share has
_KINDS: Final = {"steps_16": np.int16, "steps_32": np.int32, "steps_64": np.int64}
_AT_ONCE: Final = 200_000  # labels whose messages are made together


def messages_of(lattice: Lattice, shares: Sequence[Floats], quantum: float, pairs: slice) -> Arrays:
    """The messages from some pairs to their earlier pixels, as whole numbers of their scales.

    They are the shares, unless these take more bits than the certificate has. shares: those at the first
    pixels of all pairs, and those at the second ones, in the grid's order, alpha-major; whole multiples of
    the quantum, a power of two. pairs: consecutive ones.
    """
    grid = lattice.instance.grid
    ends = (grid.first, grid.second)
    starts_of, earlier = [lattice.share_starts(end) for end in ends], np.minimum(*ends)
    side = (grid.second == earlier).astype(np.int64)  # of each pair, on which its earlier pixel is
    parts = []
    for block in _blocks(starts_of[0], pairs):
        flat = [np.zeros(0)]
        for e, i, which in zip(block.tolist(), earlier[block].tolist(), side[block].tolist(), strict=True):
            share = shares[which][starts_of[which][e] : starts_of[which][e + 1]]
            flat.append(share[lattice.allowed[lattice.start[i] : lattice.start[i + 1]]])
        begin = starts(lattice.allowed_count[earlier[block]])
        parts.append(_whole(np.concatenate(flat), begin, quantum, lattice.norm))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _blocks(starts: Starts, pairs: slice) -> list[NDArray[np.int64]]:
    """The pairs in consecutive blocks with some labels each; one block if there are no pairs."""
    numbers = np.arange(pairs.start, pairs.stop)
    return np.split(numbers, np.flatnonzero(np.diff(starts[numbers] // _AT_ONCE)) + 1)


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


def tables_of(lattice: Lattice, clusters: Clusters, quantum: float) -> Arrays:
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
