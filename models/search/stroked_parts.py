"""The parts of a mask that have a stroke, which are all that a search or a proof is about.

A part (4-connected) without strokes has the least possible cost, zero, where all its crosses are equal and
beta is 0. So the optimum is that of the other parts, and a lower bound of their energy is one of the whole.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..field.field import CrossField
from ..instance.instance import Instance


def stroked_parts(instance: Instance) -> Instance:
    """The instance on those parts of its mask alone that have a stroke."""
    grid = instance.grid
    links = sparse.csr_array((np.ones(len(grid.first)), (grid.first, grid.second)), shape=(grid.size,) * 2)
    part = connected_components(links, directed=False)[1]
    kept = np.isin(part, part[instance.stroke_index])
    mask = np.zeros_like(grid.mask)
    mask[grid.rows[kept], grid.columns[kept]] = True
    return instance.moved(replace(grid, mask=mask), np.nonzero(kept)[0])


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
