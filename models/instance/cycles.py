"""A basis of the cycles of a domain whose points with strokes are joined to one more point, the ground.

Jumps matter only through their sums along these cycles: every choice of integers, one per cycle, is the sums
of some jumps. Rings come first, as many as are independent. The rest are walks through a spanning forest
around a pair that is not in it. The forest grows from the strokes in breadth, so such a walk is short, and
leads from stroke to stroke or is closed. A longest spanning forest between the rings, over pairs outside the
first forest, finds the pairs that need no walk since rings replace it (the tree-cotree decomposition of
Eppstein, and of Erickson and Whittlesey).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .domain import Bools, Domain, Floats, Ints, Walks


@dataclass(frozen=True, eq=False)
class Forest:
    """A spanning forest of the pairs, whose roots are the points with strokes, one more in other parts.

    depth: pairs between each point and its root, shape (n,). pair: pair towards the root, -1 at a root, (n,).
    """

    depth: Ints
    pair: Ints


@dataclass(frozen=True, eq=False)
class Cycles(Walks):
    """The basis: closed walks, and walks from a stroke to a stroke.

    ends: strokes at which each walk starts and ends, -1 for a closed one, shape (c, 2). rings: numbers of the
    rings that are the first walks.
    """

    ends: Ints
    forest: Forest
    rings: Ints

    def places(self, step: int) -> Ints:
        """Place of a step in `pair` and `sign`, of the last step in shorter walks, shape (c,)."""
        return np.minimum(self.start[:-1] + step, self.start[1:] - 1).astype(np.int32)


def find_cycles(domain: Domain, stroke_index: Ints, wanted: Ints | None = None) -> Cycles:
    """The basis for a domain with strokes at some points; the same for equal arguments.

    wanted: rings that it has, unless they are all rings of a closed part.
    """
    forest = grow_forest(domain.size, domain.first, domain.second, stroke_index)
    chords = np.ones(len(domain.first), dtype=bool)
    chords[forest.pair[forest.pair >= 0]] = False
    rings, replaced = _choose_rings(domain, np.nonzero(chords)[0].astype(np.int32), forest, wanted)
    chords[replaced] = False
    steps, ends = _walk_round(domain, np.nonzero(chords)[0].astype(np.int32), forest)
    of_ring = np.repeat(np.arange(len(rings)), np.diff(domain.rings.start))
    kept = rings[of_ring]
    lengths = [np.diff(domain.rings.start)[rings], np.bincount(steps[0], minlength=len(ends))]
    stroke = np.full(domain.size, -1, dtype=np.int32)
    stroke[stroke_index] = np.arange(len(stroke_index), dtype=np.int32)
    is_open = ends[:, 0] != ends[:, 1]
    return Cycles(
        np.concatenate([[0], np.cumsum(np.concatenate(lengths))]).astype(np.int32),
        np.concatenate([domain.rings.pair[kept], steps[1]]).astype(np.int32),
        np.concatenate([domain.rings.sign[kept], steps[2]]).astype(np.int32),
        np.concatenate([np.full((int(rings.sum()), 2), -1), np.where(is_open[:, None], stroke[ends], -1)]),
        forest,
        np.nonzero(rings)[0].astype(np.int32),
    )


def integrate(cycles: Cycles, domain: Domain, turns: Floats, at_roots: Floats) -> Floats:
    """Values (n,) that grow by `turns` (m,) from the first to the second point of each pair of the forest."""
    values, forest = at_roots.copy(), cycles.forest
    order = np.argsort(forest.depth, kind="stable")
    levels = np.searchsorted(forest.depth[order], np.arange(1, forest.depth.max(initial=0) + 2))
    for start, end in pairwise(levels.tolist()):
        points = order[start:end]
        pair = forest.pair[points]
        ahead = domain.second[pair] == points
        from_ = np.where(ahead, domain.first[pair], domain.second[pair])
        values[points] = values[from_] + np.where(ahead, turns[pair], -turns[pair])
    return values


def grow_forest(size: int, first: Ints, second: Ints, roots: Ints | list[int]) -> Forest:
    """Grow a forest over pairs of points in breadth from roots, then from the first point of each other part.

    size: number of points. first, second: of each pair, (m,).
    """
    from scipy.sparse import coo_array  # not needed by programs that only read and write files
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(first), dtype=np.int8), (first, second)), shape=(size, size))
    part = connected_components(graph, directed=False)[1]
    depth = np.full(size, -1, dtype=np.int32)
    pair = depth.copy()
    numbers, first_point = np.unique(part, return_index=True)
    depth[first_point[~np.isin(numbers, part[roots])]] = depth[roots] = 0
    open_ = np.arange(len(first), dtype=np.int32)
    while len(open_):
        reached = depth[first[open_]] >= 0, depth[second[open_]] >= 0
        at = open_[reached[0] != reached[1]]
        open_ = open_[~(reached[0] & reached[1])]
        outer = np.where(depth[first[at]] < 0, first[at], second[at])
        outer, place = np.unique(outer, return_index=True)
        pair[outer] = at[place]
        depth[outer] = 1 + np.maximum(depth[first[at[place]]], depth[second[at[place]]])
    return Forest(depth, pair)


def _choose_rings(domain: Domain, chords: Ints, forest: Forest, wanted: Ints | None) -> tuple[Bools, Ints]:
    """Independent rings (r,), and the pairs outside the forest whose walks they replace, one per ring.

    All rings around the corners of a closed part add up to nothing, so one of them is left out.
    """
    from scipy.sparse import coo_array  # not needed by programs that only read and write files
    from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

    rings = domain.rings
    count = len(rings.defect)
    sides = np.full((2, len(domain.first)), count, dtype=np.int32)  # the ring on each side, or the outside
    of_step = np.repeat(np.arange(count, dtype=np.int32), np.diff(rings.start))
    sides[(rings.sign < 0).astype(np.intp), rings.pair] = of_step
    length = forest.depth[domain.first[chords]] + forest.depth[domain.second[chords]]
    chords = chords[np.argsort(-length, kind="stable")]
    low, high = np.sort(sides[:, chords], axis=0)
    chords, low, high = chords[low < high], low[low < high], high[low < high]
    _, place = np.unique(low.astype(np.int64) * (count + 1) + high, return_index=True)
    shape = (count + 1, count + 1)
    graph = coo_array((place + 1.0, (low[place], high[place])), shape=shape).tocsr()
    chosen = minimum_spanning_tree(graph).tocoo().data.astype(np.int64) - 1
    part = connected_components(graph, directed=False)[1]
    order = np.argsort(np.isin(np.arange(count), [] if wanted is None else wanted), kind="stable")
    parts, first_ring = np.unique(part[:count][order], return_index=True)
    independent = np.ones(count, dtype=bool)
    independent[order[first_ring[parts != part[count]]]] = False
    return independent, chords[chosen]


def _walk_round(domain: Domain, chords: Ints, forest: Forest) -> tuple[Ints, Ints]:
    """Steps (3, k) of the walk round each chord: walk, pair, sign, in order; and both its ends (c, 2)."""
    ends = np.stack([domain.first[chords], domain.second[chords]])
    walk = np.arange(len(chords), dtype=np.int32)
    steps, number = [np.stack([walk, chords, np.ones_like(walk), np.zeros_like(walk)])], 0
    while True:
        depth = forest.depth[ends]
        climbing = (ends[0] != ends[1]) & (depth.max(axis=0, initial=0) > 0)
        if not climbing.any():
            break
        number += 1
        for side, other in ((0, 1), (1, 0)):
            moving = np.nonzero(climbing & (depth[side] >= depth[other]))[0].astype(np.int32)
            point = ends[side, moving]
            pair = forest.pair[point]
            ahead = domain.second[pair] == point  # the pair points away from the root
            sign = np.where(ahead == (side == 0), 1, -1).astype(np.int32)
            rank = np.full_like(moving, number if side else -number)
            steps.append(np.stack([moving, pair, sign, rank]))
            ends[side, moving] = np.where(ahead, domain.first[pair], domain.second[pair])
    all_ = np.concatenate(steps, axis=1)
    return all_[:3, np.lexsort((all_[3], all_[0]))], ends.T
