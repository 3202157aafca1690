"""Prescribed indices of vertices: fixed sums of jumps along the rings around them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arguments import whole_numbers
from ..errors import InstanceError
from .angles import HALF, SLACK
from .domain import Domain, Ints, Walks
from .terms import quarter_turns


@dataclass(frozen=True, eq=False)
class PrescribedRings(Walks):
    """The rings of vertices with prescribed indices.

    number: of each ring in the domain, ascending, (k,). turns: sum of the jumps along it, (k,). On the pairs
    of these rings |A| is at most pi/4, so that the crosses alone determine the index.
    """

    number: Ints
    turns: Ints


def sort_indices(values: Any) -> Ints | None:
    """The pairs of a vertex and four times its index, ascending, (k, 2), read-only; None without any.

    Raises InstanceError for other values, and for a vertex that comes twice.
    """
    if values is None or not (pairs := whole_numbers(values, "indices")).size:
        return None
    if pairs.ndim != 2 or pairs.shape[1] != 2:
        raise InstanceError(
            f"indices has shape {pairs.shape}; give pairs of a vertex and four times its index"
        )
    pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
    if (twice := np.diff(pairs[:, 0]) == 0).any():
        raise InstanceError(f"indices list vertex {pairs[1:, 0][twice][0]} twice; give each vertex once")
    pairs.setflags(write=False)
    return pairs


def prescribe_rings(domain: Domain, indices: Ints) -> PrescribedRings:
    """The rings of prescribed indices (k, 2).

    Raises InstanceError for a vertex without a ring, for an index that residuals of at most pi/4 do not
    reach, and for a closed part whose indices cannot add up to its Euler characteristic.
    """
    rings, (vertex, wanted), known = domain.rings, indices.T, domain.ring_vertices
    if (missing := ~np.isin(vertex, known)).any():
        raise InstanceError(
            f"vertex {vertex[missing][0]} has no index: it is on the boundary or in no {domain.kind} "
            f"({int(missing.sum())} such vertices); leave it out"
        )
    number, length = np.searchsorted(known, vertex), np.diff(rings.start)
    flat = quarter_turns(rings, np.zeros(len(domain.first)) if domain.kappa is None else domain.kappa)
    charge, reach = rings.defect / HALF, length / 2 + SLACK
    least, most = np.ceil(charge - reach).astype(int), np.floor(charge + reach).astype(int)
    if (beyond := (wanted < least[number]) | (wanted > most[number])).any():
        at = int(np.argmax(beyond))
        raise InstanceError(
            f"vertex {vertex[at]} cannot have the index {wanted[at]}/4: with residuals of at most pi/4 it is "
            f"{least[number][at]}/4 to {most[number][at]}/4"
        )
    least[number] = most[number] = wanted
    part = domain.part_of_points[domain.first[rings.pair[rings.start[:-1]]]]
    low, high, total = (np.bincount(part, numbers, domain.size) for numbers in (least, most, flat))
    pairs = np.bincount(domain.part_of_points[domain.first], minlength=domain.size)
    closed = (pairs > 0) & (np.bincount(part, length, domain.size) == 2 * pairs)
    for face in np.nonzero(closed & ((total < low) | (total > high)))[0]:
        reached = f"{low[face]:.0f}/4" + f" to {high[face]:.0f}/4" * bool(low[face] < high[face])
        raise InstanceError(
            f"the indices of the closed part with {domain.kind} {face} add up to {reached} instead of "
            f"{total[face]:.0f}/4; change the indices of its vertices"
        )
    kept = np.zeros(len(length), dtype=bool)
    kept[number] = True
    some = rings.keep(kept)
    turns = (flat[number] - wanted).astype(np.int32)
    return PrescribedRings(some.start, some.pair, some.sign, number.astype(np.int32), turns)
