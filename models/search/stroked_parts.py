"""The parts of a mask that have a stroke, which are all that a search or a proof is about.

A part (4-connected) without strokes has the least possible cost, zero, where all its crosses are equal and
beta is 0. So the optimum is that of the other parts, and a lower bound of their energy is one of the whole.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..field.field import CrossField
from ..instance.grid import Grid
from ..instance.instance import Instance


def stroked_parts(instance: Instance) -> Instance:
    """The instance on those parts of its mask alone that have a stroke."""
    grid = instance.grid
    links = sparse.csr_array((np.ones(len(grid.first)), (grid.first, grid.second)), shape=(grid.size,) * 2)
    part = connected_components(links, directed=False)[1]
    kept = np.isin(part, part[instance.stroke_index])
    mask = np.zeros_like(grid.mask)
    mask[grid.rows[kept], grid.columns[kept]] = True
    return move_to_grid(instance, replace(grid, mask=mask), np.nonzero(kept)[0])


def restricted(field: CrossField, part: Instance) -> CrossField:
    """A field on the pixels of `stroked_parts` alone."""
    grid = field.instance.grid
    held = part.mask[grid.mask]
    return CrossField(part, field.alpha[held], field.beta[held], field.p[held[grid.first]])


def extended(field: CrossField, instance: Instance) -> CrossField:
    """A field on `stroked_parts` as one of the instance, with equal crosses in all other parts."""
    held = field.instance.mask[instance.mask]
    alpha, beta = np.zeros((2, len(held)))
    alpha[held], beta[held] = field.alpha, field.beta
    jumps = np.zeros(len(instance.grid.first), np.int32)
    jumps[held[instance.grid.first]] = field.p
    return CrossField(instance, alpha, beta, jumps)


def move_to_grid(instance: Instance, grid: Grid, origin: NDArray[Any]) -> Instance:
    """The instance on another grid whose pixel k is the pixel origin[k] of this one.

    Strokes and weights of pairs move with their pixels, and directions stay, unlike in a replacement of the
    domain. Neighbours on the other grid have to be neighbours on this one. origin: (k,).
    """
    before = instance.grid
    number = np.full(before.size, -1, dtype=np.int32)
    number[origin] = np.arange(len(origin), dtype=np.int32)
    at, weights = number[instance.stroke_index], instance.pair_weights
    order = np.argsort(at)[np.count_nonzero(at < 0) :]
    if weights is not None:
        ends = [
            np.sort([before.first, before.second], axis=0),
            np.sort([origin[grid.first], origin[grid.second]], axis=0),
        ]
        keys, moved_keys = (low * np.int64(before.size) + high for low, high in ends)
        by_key = np.argsort(keys)
        weights = weights[by_key[np.searchsorted(keys, moved_keys, sorter=by_key)]]
    return replace(
        instance,
        domain=grid,
        stroke_index=at[order],
        theta=instance.theta[order],
        w=instance.w[order],
        pair_weights=weights,
    )
