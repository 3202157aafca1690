"""The parts of a mask that have a stroke, which are all that a search or a proof is about.

A part (4-connected) without strokes has the least possible cost, zero, where all its crosses are equal and
beta is 0. So the optimum is that of the other parts, and a lower bound of their energy is one of the whole.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from ..field.field import CrossField
from ..instance.instance import Instance


def stroked_parts(instance: Instance) -> Instance:
    """The instance on those parts of its mask alone that have a stroke."""
    parts = ndimage.label(instance.mask)[0]
    numbers = parts[instance.mask][instance.stroke_index]
    grid = replace(instance.grid, mask=np.isin(parts, numbers))
    return instance.moved(grid, np.flatnonzero(grid.mask[instance.mask]))


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
