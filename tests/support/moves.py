"""What turning, mirroring and transposing a sketch does to pictures and to lines."""

import numpy as np
from crossfield.models.instance.instance import HALF

MOVES = {
    "turned": (np.rot90, lambda angle: angle + HALF),
    "mirrored": (lambda picture: picture[:, ::-1], lambda angle: np.pi - angle),
    "transposed": (lambda picture: picture.T, lambda angle: -HALF - angle),
}
"""By the method of Instance: what becomes of a picture, and of an angle in radians."""


def lines(field):
    """The angles of lines u and v of a field, radians."""
    return field.alpha + field.beta, field.alpha + HALF - field.beta
