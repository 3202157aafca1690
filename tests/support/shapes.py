"""Surfaces whose heights are known functions: a ball, a plane, a ridge, and masks that are hard to draw."""

import crossfield as cf
import numpy as np
from crossfield.models.surface.surface import Surface


def corners_of(mask):
    """Which corners [height + 1, width + 1] belong to a pixel of the mask."""
    wide = np.pad(mask, 1)
    return wide[1:, 1:] | wide[1:, :-1] | wide[:-1, 1:] | wide[:-1, :-1]


def surface_of(mask, height, u=0.0, v=np.pi / 2):
    """The surface of a height function of x and y, pixels from the middle, with the same cross everywhere."""
    mask = np.asarray(mask, dtype=bool)
    instance = cf.Instance.on_pixels("shape", mask, np.argwhere(mask)[:1], np.zeros(1), np.ones(1))
    rows, columns = mask.shape
    row, column = np.mgrid[: rows + 1, : columns + 1]
    heights = np.asarray(height(column - columns / 2, rows / 2 - row), dtype=np.float64)
    n = instance.grid.size
    field = cf.CrossField.from_lines(instance, np.full(n, u), np.full(n, v))
    return Surface(field, np.where(corners_of(mask), heights, np.nan), np.ones(n))


def disc(size, radius):
    """Pixels whose middle is near the middle of the grid."""
    y, x = np.mgrid[:size, :size] + 0.5 - size / 2
    return x**2 + y**2 <= radius**2


def ball(size, part=0.9):
    """The front of a ball as wide as the grid, without its border."""
    radius = size / 2

    def height(x, y):
        return np.sqrt(np.maximum(radius**2 - x**2 - y**2, 0))

    return surface_of(disc(size, part * radius), height)


def plane(size, across, upward, **cross):
    """A plane with these slopes."""
    return surface_of(np.ones((size, size + 2)), lambda x, y: across * x + upward * y, **cross)


def ball_normals(surface):
    """The true normals of a ball at the middles of its pixels, (n, 3)."""
    grid = surface.instance.grid
    radius = grid.width / 2
    x, y = (grid.columns + 0.5 - radius) / radius, (radius - grid.rows - 0.5) / radius
    return np.stack([x, y, np.sqrt(1 - x**2 - y**2)], axis=1)
