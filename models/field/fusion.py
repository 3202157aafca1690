"""Two fields made one: of one field, with the regions in which another one has less energy.

Fields that strategies find for one sketch are alike in most places and differ in some regions, each lower
in some of them. Where they differ by more than a small angle falls into parts; round a part the crosses are
nearly the same, so that exchanging one changes the energy by what it holds, whatever happens in the others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..instance.grid import Bools, Floats, Grid, Ints
from ..instance.instance import HALF, Instance
from .field import CrossField
from .jumps import free_jumps

_APART: Final = (0.4, 0.2, 0.1, 0.05, 0.02)
"""Radians of cross error beyond which two fields differ: from parts that are small and leave steep edges to
parts that are large and leave none. Each is tried in turn, on what the ones before have made.
"""
_LOWER: Final = 1e-6  # of the energy, relative to 1 + energy: less may be what solving has left


@dataclass(frozen=True, eq=False)
class _Mix:
    """Angles (n,) and their energy by pixels (n,) and, with the best jumps p, by pairs (m,)."""

    alpha: Floats
    beta: Floats
    p: Ints
    at_pixel: Floats
    at_pair: Floats

    @classmethod
    def of(cls, instance: Instance, alpha: Floats, beta: Floats) -> _Mix:
        """The mix of these angles."""
        terms = instance.stroke_terms
        strokes = terms.at_pixels(terms.weight * terms.residuals(alpha, beta) ** 2, instance.grid.size)
        p, at_pair = free_jumps(instance.grid, alpha, beta)
        return cls(alpha, beta, p, strokes + instance.w_beta * beta**2, at_pair)


def fused(one: CrossField, other: CrossField) -> CrossField:
    """The field `one` with those parts of `other` that lower its 2-norm energy, and the best jumps of all.

    Both are on the same instance. Jumps are in no range; angles are as in either. Where no part lowers the
    energy by more than 1e-6 of 1 + energy it is `one`. Deterministic.
    """
    instance = one.instance
    now = _Mix.of(instance, one.alpha, one.beta)
    lines = other.alpha + other.beta, other.alpha + HALF - other.beta
    least, taken = _LOWER * (1 + one.energy().total), False
    for apart in _APART:
        far = replace(one, alpha=now.alpha, beta=now.beta).cross_error(*lines) > apart
        part, parts = _parts(instance.grid, far)
        mixed = _Mix.of(instance, np.where(far, other.alpha, now.alpha), np.where(far, other.beta, now.beta))
        gains = _gains(instance.grid, part, parts, mixed.at_pixel - now.at_pixel, mixed.at_pair - now.at_pair)
        better = np.append(gains < -least, False)
        if better.any():
            taken, chosen = True, better[part]
            now = _Mix.of(
                instance, np.where(chosen, mixed.alpha, now.alpha), np.where(chosen, mixed.beta, now.beta)
            )
    return CrossField(instance, now.alpha, now.beta, now.p) if taken else one


def _parts(grid: Grid, inside: Bools) -> tuple[Ints, int]:
    """The number of the connected part of each pixel that is inside, -1 for others, (n,); how many."""
    both = inside[grid.first] & inside[grid.second]
    place = (grid.first[both], grid.second[both])
    links = sparse.csr_array((np.ones(both.sum()), place), shape=(grid.size, grid.size))
    count, part = connected_components(links, directed=False)
    return np.where(inside, part, -1), count


def _gains(grid: Grid, part: Ints, parts: int, at_pixel: Floats, at_pair: Floats) -> Floats:
    """What each part adds to the energy: its pixels, and its pairs with those of the pixels round it."""
    # A pair of two parts would have made them one, so that the greater number is that of the only one.
    owner = np.maximum(part[grid.first], part[grid.second])
    gains: Floats = np.bincount(part + 1, at_pixel, parts + 1) + np.bincount(owner + 1, at_pair, parts + 1)
    return gains[1:]
