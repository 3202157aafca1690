"""A patch of a field with the ring of pixels round it, for an exact solver; put back when solved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..field.field import CrossField
from ..instance.grid import Bools
from ..instance.instance import Instance


@dataclass(frozen=True, eq=False)
class Excerpt:
    """A patch and the pixels round it, as a field on an instance of its own.

    free: which of these pixels are the patch and may change, shape (k,). pixels (n,), pairs (m,): where they
    lie in the whole field.
    """

    field: CrossField
    free: Bools
    pixels: Bools
    pairs: Bools

    def put_back(self, piece: CrossField, whole: CrossField) -> CrossField:
        """The whole field with the free pixels' angles and the jumps to and between them as in `piece`."""
        alpha, beta, p = whole.alpha.copy(), whole.beta.copy(), whole.p.copy()
        at = np.nonzero(self.pixels)[0][self.free]
        alpha[at], beta[at] = piece.alpha[self.free], piece.beta[self.free]
        p[self.pairs] = piece.p
        return CrossField(whole.instance, alpha, beta, p)


def excerpt(field: CrossField, free: Bools) -> Excerpt:
    """The excerpt of a field that holds these pixels (n,), their neighbours, and at least one stroke pixel.

    With all but the free pixels fixed, its energy differs from that of the whole field by a constant.
    """
    instance, grid = field.instance, field.instance.grid
    pixels = free.copy()
    pixels[grid.first[free[grid.second]]] = True
    pixels[grid.second[free[grid.first]]] = True
    if not pixels[instance.stroke_index].any():
        pixels[_nearest_stroke(instance, free)] = True
    pairs = pixels[grid.first] & pixels[grid.second]
    mask = np.zeros_like(instance.mask)
    mask[grid.rows[pixels], grid.columns[pixels]] = True
    strokes = pixels[instance.stroke_index]
    piece = instance.with_strokes(strokes, mask)
    return Excerpt(
        CrossField(piece, field.alpha[pixels], field.beta[pixels], field.p[pairs]),
        free[pixels],
        pixels,
        pairs,
    )


def _nearest_stroke(instance: Instance, free: Bools) -> int:
    """The stroke pixel nearest to the first of some pixels: an instance without any stroke is none."""
    grid, at = instance.grid, instance.stroke_index
    first = int(np.argmax(free))
    away = (grid.rows[at] - grid.rows[first]) ** 2 + (grid.columns[at] - grid.columns[first]) ** 2
    return int(at[np.argmin(away)])
