"""Combing: labels of the crosses that agree from pixel to pixel, as far as singularities allow."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ...models.field.field import CrossField
from ...models.field.jumps import stepped
from ...models.instance.angles import double_angle

_Array = np.ndarray[Any, Any]

_SHIFT: Final = 1e-6  # keeps the signed Laplacian of a part without singularities regular
_ITERATIONS: Final = 12  # of the inverse iteration that places the cuts


def combed(field: CrossField) -> CrossField:
    """The same crosses with labels that agree between neighbours: p is even but on cuts.

    Singularities and holes force cuts.

    Which labels are exchanged follows the signs of the lowest eigenvector of the signed Laplacian of the
    grid, with signs (-1)^p: its zero lines, the cuts, are short and smooth. In each 4-connected part the line
    that carries most stroke weight becomes u (without strokes: the more horizontal one), and u points to the
    right on the whole. alpha is any real number here, outside the windows of a gauge. Step k of a label:
    (alpha + k pi/2, (-1)^k beta).
    """
    part = _parts(field)
    field = _stepped(field, _tree_steps(field, part))
    field = _stepped(field, _exchanges(field, part))
    field = _stepped(field, _votes(field, part)[part])
    leftwards = np.round(np.bincount(part, field.u[:, 0]), 9) < 0
    return _stepped(field, 2 * leftwards[part])


def _stepped(field: CrossField, steps: _Array) -> CrossField:
    return CrossField(field.instance, *stepped(field.instance.grid, field.alpha, field.beta, field.p, steps))


def _parts(field: CrossField) -> _Array:
    """Number of the 4-connected part of each pixel, shape (n,)."""
    from scipy import ndimage

    mask = field.instance.mask
    labelled: _Array = ndimage.label(mask)[0]
    return labelled[mask].astype(np.int64) - 1


def _tree_steps(field: CrossField, part: _Array) -> _Array:
    """Label steps that make jumps zero along a breadth-first tree from each part's innermost pixel."""
    from scipy import ndimage
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order

    grid = field.instance.grid
    depth = ndimage.distance_transform_edt(np.pad(grid.mask, 1))[1:-1, 1:-1][grid.mask]
    inwards = np.lexsort((-depth, part))
    roots = inwards[np.unique(part[inwards], return_index=True)[1]]
    top = np.full(len(roots), grid.size)  # one node above all roots makes the forest a tree
    tail, head = np.concatenate([grid.first, top]), np.concatenate([grid.second, roots])
    jump = np.concatenate([field.p, np.zeros(len(roots), dtype=np.int32)])
    links = coo_array((np.ones(len(tail)), (tail, head)), shape=(grid.size + 1, grid.size + 1)).tocsr()
    parent = breadth_first_order(links, grid.size, directed=False)[1].astype(np.int64)
    parent[grid.size] = grid.size
    steps = np.zeros(grid.size + 1, dtype=np.int64)
    down, up = parent[head] == tail, parent[tail] == head
    steps[head[down]] = -jump[down]
    steps[tail[up]] = jump[up]
    while (parent != grid.size).any():  # each round doubles the way that is summed up
        steps, parent = steps + steps[parent], parent[parent]
    return steps[:-1]


def _exchanges(field: CrossField, part: _Array) -> _Array:
    """1 for each pixel whose u and v are better exchanged, else 0, by inverse iteration."""
    from scipy.sparse import csc_array, diags_array
    from scipy.sparse.linalg import splu

    grid = field.instance.grid
    odd = field.p & 1
    if not odd.any():
        return np.zeros(grid.size, dtype=np.int64)
    signs = csc_array((1.0 - 2.0 * odd, (grid.first, grid.second)), shape=(grid.size, grid.size))
    degree = np.bincount(grid.first, minlength=grid.size) + np.bincount(grid.second, minlength=grid.size)
    solver = splu(
        (diags_array(degree + _SHIFT) - signs - signs.T).tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        options={"SymmetricMode": True},
    )
    vector = np.ones(grid.size)
    for _ in range(_ITERATIONS):
        vector = solver.solve(vector)
        vector /= np.sqrt(np.bincount(part, vector**2))[part]
    return (vector < 0).astype(np.int64)


def _votes(field: CrossField, part: _Array) -> _Array:
    """1 for each part whose v carries more of the strokes (or lies more horizontally) than its u, else 0."""
    instance = field.instance
    nearer = double_angle(field.u_angle) - double_angle(
        field.v_angle
    )  # products with it: positive nearer to u
    at = instance.stroke_index
    carried = instance.w * np.sum(double_angle(instance.theta) * nearer[at], axis=1)
    strokes = np.round(np.bincount(part[at], carried, part.max() + 1), 9)
    lying = np.round(np.bincount(part, nearer[:, 0]), 9)
    return (np.where(strokes != 0, strokes, lying) < 0).astype(np.int64)
