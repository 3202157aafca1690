"""Effects of turning, mirroring and transposing a sketch on pictures and on lines."""

from dataclasses import replace

import numpy as np
from angles import HALF
from crossfield.models.search.stroked_parts import move_to_grid


def turned(instance):
    """The instance of the sketch turned by a quarter counter-clockwise."""
    return move(instance, np.rot90(instance.grid.number), 1, HALF)


def mirrored(instance):
    """The instance of the sketch mirrored left to right."""
    return move(instance, instance.grid.number[:, ::-1], -1, np.pi)


def transposed(instance):
    """The instance mirrored at its main diagonal: rows and columns are exchanged."""
    return move(instance, instance.grid.number.T, -1, -HALF)


def move(instance, number, sense, turn):
    """The instance with pixels at the places of their numbers, and every theta as sense theta + turn."""
    inside = number >= 0
    placed = move_to_grid(instance, replace(instance.grid, mask=inside), number[inside])
    return replace(placed, theta=sense * placed.theta + turn, reading=None)


MOVES = {
    turned: (np.rot90, lambda angle: angle + HALF),
    mirrored: (lambda picture: picture[:, ::-1], lambda angle: np.pi - angle),
    transposed: (lambda picture: picture.T, lambda angle: -HALF - angle),
}
"""By the function that moves an instance: the new picture, and the new angle in radians."""


def lines(field):
    """The angles of lines u and v of a field, radians."""
    return field.alpha + field.beta, field.alpha + HALF - field.beta
