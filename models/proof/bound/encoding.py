"""Shares and tables of a level as arrays of a certificate (docs/files.md, "Layout of a certificate")."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from ...array_archive import Arrays
from ...instance.domain import Floats
from .lattice import Lattice
from .state import Clusters

_MOST: Final = 2**31 - 1


def share_arrays(lattice: Lattice, shares: Sequence[Floats], quantum: float) -> Arrays:
    """The shares of the earlier pixels of all pairs, at their allowed labels.

    shares: those at the first pixels of all pairs, and those at the second ones, in the grid's order,
    alpha-major; whole multiples of the quantum, a power of two.
    """
    grid = lattice.instance.grid
    ends = (grid.first, grid.second)
    starts, earlier = [lattice.share_starts(end) for end in ends], np.minimum(*ends)
    side = (grid.second == earlier).astype(np.int64)  # of each pair, on which its earlier pixel is

    def share(e: int) -> Floats:
        begin, i = starts[side[e]], earlier[e]
        allowed = lattice.allowed[lattice.start[i] : lattice.start[i + 1]]
        numbers: Floats = shares[side[e]][begin[e] : begin[e + 1]][allowed]
        return numbers

    return _encode_blocks("share", map(share, range(len(side))), quantum)


def table_arrays(lattice: Lattice, clusters: Clusters, quantum: float) -> Arrays:
    """The quads that have tables, and the tables."""
    tables = np.split(clusters.tables, clusters.start[1:-1]) if len(clusters.quads) else []
    quads = lattice.instance.grid.first[clusters.quads[:, 0]].astype(np.int32)
    return {"quads": quads, **_encode_blocks("table", tables, quantum)}


def _encode_blocks(name: str, blocks: Iterable[Floats], quantum: float) -> Arrays:
    """Blocks of numbers as whole multiples of a unit each, stored by their differences modulo 2^32.

    The unit is the quantum, unless the numbers then take more bits than the certificate has.
    """
    units, steps = list[float](), [np.zeros(0, np.int32)]
    for numbers in blocks:
        units.append(max(quantum, float(np.abs(numbers).max()) / _MOST))
        steps.append(np.diff(np.round(numbers / units[-1]).astype(np.int64), prepend=0).astype(np.int32))
    return {f"{name}_steps": np.concatenate(steps), f"{name}_unit": np.array(units)}
