"""Effects of turning, mirroring and transposing a sketch on pictures and on lines."""

import numpy as np
from crossfield.models.instance.angles import HALF
from crossfield.models.instance.symmetries import mirrored, transposed, turned

MOVES = {
    turned: (np.rot90, lambda angle: angle + HALF),
    mirrored: (lambda picture: picture[:, ::-1], lambda angle: np.pi - angle),
    transposed: (lambda picture: picture.T, lambda angle: -HALF - angle),
}
"""By the function that moves an instance: the new picture, and the new angle in radians."""


def lines(field):
    """The angles of lines u and v of a field, radians."""
    return field.alpha + field.beta, field.alpha + HALF - field.beta
