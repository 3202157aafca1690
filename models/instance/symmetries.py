"""Instances of a turned or mirrored sketch: the energy of their best fields is that of the sketch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .angles import HALF
from .domain import Bools, Ints
from .instance import Instance


def turned(instance: Instance) -> Instance:
    """The instance of the sketch turned by a quarter counter-clockwise."""
    row, column = instance.stroke_pixels.T
    pixels = np.stack([instance.mask.shape[1] - 1 - column, row], axis=1)
    return _move(instance, np.rot90(instance.mask), pixels, 1, HALF)


def mirrored(instance: Instance) -> Instance:
    """The instance of the sketch mirrored left to right."""
    row, column = instance.stroke_pixels.T
    pixels = np.stack([row, instance.mask.shape[1] - 1 - column], axis=1)
    return _move(instance, instance.mask[:, ::-1], pixels, -1, np.pi)


def transposed(instance: Instance) -> Instance:
    """The instance mirrored at its main diagonal: rows and columns are exchanged."""
    return _move(instance, instance.mask.T, instance.stroke_pixels[:, ::-1], -1, -HALF)


def _move(instance: Instance, mask: Bools, pixels: Ints, sense: int, turn: float) -> Instance:
    """The instance with its stroke pixels moved and every theta changed to sense theta + turn."""
    grid = replace(instance.grid, mask=mask)
    number = grid.number[pixels[:, 0], pixels[:, 1]]
    order = np.argsort(number)
    return replace(
        instance,
        domain=grid,
        stroke_index=number[order],
        theta=sense * instance.theta[order] + turn,
        w=instance.w[order],
        reading=None,
    )
