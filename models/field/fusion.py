"""Fusion of two fields: at every pixel the cross of one of them, so that the energy is least.

The choice of least energy is a minimum cut, the fusion move of Lempitsky, Rother, Roth, Blake (Fusion Moves
for Markov Random Field Optimization, IEEE PAMI 32, 2010). A cut cannot express that two neighbours of the
same field cost more than a mixed pair; then the mixed pair counts as much.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

from ..instance.domain import Bools, Floats, Ints
from ..instance.terms import PairTerms
from .field import CrossField
from .jumps import free_jumps

_APART: Final = 0.02  # radians of cross error up to which two crosses count as equal
_UNITS: Final = 1e6  # parts of 1 + energy: flows are whole numbers, whose sums do not depend on the order
_MOST: Final = 1e9  # units of a pixel's price, far more than a choice can gain: flows have 32 bits


def fuse_fields(one: CrossField, other: CrossField) -> CrossField:
    """The field that takes each cross from `one` or `other`, at the least 2-norm energy, with best jumps.

    Both fields are on the same instance. Jumps are not limited to a range. Returns `one` if no cut finds a
    choice that is lower by 1e-6 of 1 + energy. Deterministic.
    """
    domain, energy = one.instance.domain, one.energy().total
    far = one.cross_error(other.u_angle, other.v_angle) > _APART
    if not far.any():
        return one
    fields = (one, other)
    pairs = np.nonzero(far[domain.first] | far[domain.second])[0].astype(np.int32)
    terms = one.instance.pair_terms.select(pairs)
    same, mixed, mixed_too, exchanged = (
        _least_pair_costs(terms, first, second) for first in fields for second in fields
    )
    inside = far[domain.first[pairs]] & far[domain.second[pairs]]
    price = _pixel_costs(other) - _pixel_costs(one)
    price += np.bincount(domain.first[pairs], mixed_too - same, domain.size)
    price += np.bincount(
        domain.second[pairs], np.where(inside, exchanged - mixed_too, mixed - same), domain.size
    )
    links = np.stack([domain.first[pairs[inside]], domain.second[pairs[inside]]])
    excess = (mixed + mixed_too - same - exchanged)[inside]
    unit = (1 + energy) / _UNITS
    taken = _find_least_cut(far, np.rint(price / unit), links, np.rint(np.maximum(excess, 0) / unit))
    alpha, beta = np.where(taken, other.alpha, one.alpha), np.where(taken, other.beta, one.beta)
    fusion = CrossField(one.instance, alpha, beta, free_jumps(one.instance, alpha, beta)[0])
    return fusion if fusion.energy().total < energy - unit else one


def _pixel_costs(field: CrossField) -> Floats:
    """Contribution of each pixel to the energy without its neighbours, shape (n,)."""
    terms, instance = field.instance.stroke_terms, field.instance
    strokes = terms.at_points(terms.costs(field.alpha, field.beta), instance.domain.size)
    skew: Floats = instance.skew_coefficient * field.beta * field.beta
    return strokes + skew


def _least_pair_costs(pairs: PairTerms, first: CrossField, second: CrossField) -> Floats:
    """Energies of pairs with their best jumps; first pixels from one field, second from another."""
    between = replace(pairs, second=pairs.second + np.int32(len(first.alpha)))
    alpha = np.concatenate([first.alpha, second.alpha])
    return between.least_costs(alpha, np.concatenate([first.beta, second.beta]))


def _find_least_cut(free: Bools, price: Floats, links: Ints, excess: Floats) -> Bools:
    """The free pixels that pay, at the least total of prices (n,) and excesses (k,) of links (2, k)."""
    # An excess is due for each link from a pixel that does not pay to one that does.
    count = int(free.sum())
    number = np.cumsum(free) - 1
    source, sink, place = count, count + 1, np.arange(count)
    start = np.concatenate([np.where(price[free] > 0, source, place), number[links[0]]])
    end = np.concatenate([np.where(price[free] > 0, place, sink), number[links[1]]])
    most = np.minimum(np.concatenate([np.abs(price[free]), excess]), _MOST).astype(np.int32)
    graph = sparse.csr_array((most, (start, end)), shape=(count + 2, count + 2))
    left = graph - maximum_flow(graph, source, sink).flow
    left.eliminate_zeros()
    reached = np.zeros(count + 2, dtype=bool)
    reached[breadth_first_order(left, source, return_predecessors=False)] = True
    paying = np.zeros(len(free), dtype=bool)
    paying[free] = ~reached[:count]
    return paying
