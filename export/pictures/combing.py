"""Combing: labels of the crosses that agree from pixel to pixel, as far as singularities allow."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ...models.field.field import CrossField
from ...models.field.jumps import stepped
from ...models.instance.angles import double_angle
from ...models.instance.grid import Floats

_Array = np.ndarray[Any, Any]

_SHIFT: Final = 1e-6  # keeps the signed Laplacian of a part without singularities regular
_ITERATIONS: Final = 12  # of the inverse iteration that places the cuts


def combed(field: CrossField) -> CrossField:
    """The same crosses with labels that agree between neighbours: p is even but on cuts.

    Singularities and holes force cuts. In each 4-connected part the line that carries most stroke weight
    becomes u (without strokes: the more horizontal one). alpha is any real number here, outside the windows
    of a gauge.
    """
    from scipy import ndimage

    instance = field.instance
    part = ndimage.label(instance.mask)[0][instance.mask].astype(np.int64) - 1
    nearer = double_angle(field.u_angle) - double_angle(field.v_angle)  # positive product: nearer to u
    vector = _lowest_vector(field, part, nearer[:, 0])
    at = instance.stroke_index
    carried = np.sign(vector[at]) * instance.w * np.sum(double_angle(instance.theta) * nearer[at], axis=1)
    strokes = np.round(np.bincount(part[at], carried, part.max() + 1), 9)
    lying = np.round(np.bincount(part, np.sign(vector) * nearer[:, 0]), 9)
    side = np.where(np.where(strokes != 0, strokes, lying) < 0, -1, 1)
    exchanged = (vector * side[part] < 0).astype(np.int64)
    return CrossField(instance, *stepped(instance.grid, field.alpha, field.beta, field.p, exchanged))


def _lowest_vector(field: CrossField, part: _Array, start: Floats) -> Floats:
    """The lowest eigenvector of the signed Laplacian with signs (-1)^p, by inverse iteration.

    Its signs say which labels are exchanged; its zero lines, the cuts, are short and smooth. A start that
    changes its sign with the labels makes the result independent of them.
    """
    from scipy.sparse import csc_array, diags_array
    from scipy.sparse.linalg import splu

    grid = field.instance.grid
    signs = csc_array((1.0 - 2.0 * (field.p & 1), (grid.first, grid.second)), shape=(grid.size, grid.size))
    degree = np.bincount(grid.first, minlength=grid.size) + np.bincount(grid.second, minlength=grid.size)
    solver = splu(
        (diags_array(degree + _SHIFT) - signs - signs.T).tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        options={"SymmetricMode": True},
    )
    # Weights keep a symmetric start from being orthogonal to the vector.
    vector: Floats = start * np.random.default_rng(0).random(grid.size)
    for _ in range(_ITERATIONS):
        vector = solver.solve(vector)
        vector /= np.sqrt(np.bincount(part, vector**2))[part]
    return vector
