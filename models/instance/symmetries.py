"""Instances of a turned or mirrored sketch: the energy of their best fields is that of the sketch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .angles import HALF
from .domain import Ints
from .instance import Instance


def turned(instance: Instance) -> Instance:
    """The instance of the sketch turned by a quarter counter-clockwise."""
    return _move(instance, np.rot90(instance.grid.number), 1, HALF)


def mirrored(instance: Instance) -> Instance:
    """The instance of the sketch mirrored left to right."""
    return _move(instance, instance.grid.number[:, ::-1], -1, np.pi)


def transposed(instance: Instance) -> Instance:
    """The instance mirrored at its main diagonal: rows and columns are exchanged."""
    return _move(instance, instance.grid.number.T, -1, -HALF)


def _move(instance: Instance, number: Ints, sense: int, turn: float) -> Instance:
    """The instance with pixels at the places of their numbers, and every theta as sense theta + turn."""
    inside = number >= 0
    moved = instance.moved(replace(instance.grid, mask=inside), number[inside])
    return replace(moved, theta=sense * moved.theta + turn, reading=None)
