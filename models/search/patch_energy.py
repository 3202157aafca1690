"""The energy by its definition as a function of the angles in a patch, free of errors of updates."""

from __future__ import annotations

import numpy as np

from ..field.field import CrossField
from ..field.jumps import parity_sign
from ..instance.grid import Bools, Floats, Ints
from ..instance.instance import HALF, Instance


class PatchEnergy:
    """The field's 2-norm energy where only angles and jumps within a patch change."""

    def __init__(self, instance: Instance, pixels: Ints, x: Floats, p: Ints) -> None:
        """Take over angles x (2n,) and jumps p (m,) of the whole field; those outside the patch stay.

        pixels: the numbers of the patch's pixels, shape (k,).
        """
        grid, free = instance.grid, np.zeros(len(x) // 2, dtype=bool)
        free[pixels] = True
        self._instance = instance
        self._pairs = np.nonzero(free[grid.first] | free[grid.second])[0].astype(np.int32)
        ends = np.concatenate([grid.first[self._pairs], grid.second[self._pairs]])
        # Local numbers: the pixels of the patch, and then those beside it, whose angles stay.
        beside = np.setdiff1d(ends, pixels)
        number = np.zeros(grid.size, dtype=np.int32)
        number[np.concatenate([pixels, beside])] = np.arange(len(pixels) + len(beside))
        self._first, self._second = np.split(number[ends], 2)
        alpha, beta = np.split(x, 2)
        self._alpha, self._beta = alpha[beside], beta[beside]
        strokes = np.nonzero(free[instance.stroke_terms.pixel])[0].astype(np.int32)
        self._strokes = instance.stroke_terms.chosen(strokes, number)
        self._rest = _rest(CrossField(instance, alpha, beta, p), free, self._pairs, strokes)

    def __call__(self, x: Floats, p: Ints) -> float:
        """The energy at the patch's angles x (2k,) and the jumps p (m,) of the whole field."""
        inside = np.split(x, 2)
        alpha, beta = np.concatenate([inside[0], self._alpha]), np.concatenate([inside[1], self._beta])
        jumps, instance = p[self._pairs], self._instance
        a = alpha[self._first] - alpha[self._second] + HALF * jumps
        b = parity_sign(jumps) * beta[self._first] - beta[self._second]
        r = self._strokes.residuals(alpha, beta)
        strokes = float(self._strokes.weight @ (r * r))
        return (
            self._rest
            + 2 * float(a @ a + b @ b)
            + strokes
            + instance.skew_coefficient * float(inside[1] @ inside[1])
        )


def _rest(field: CrossField, free: Bools, pairs: Ints, strokes: Ints) -> float:
    """The energy outside the patch: other pixels, without these pairs and strokes."""
    instance = field.instance
    pair = field.residual_a**2 + field.residual_b**2
    terms, skew = instance.stroke_terms, field.beta[~free] ** 2
    stroke = terms.weight * terms.residuals(field.alpha, field.beta) ** 2
    pair[pairs], stroke[strokes] = 0.0, 0.0
    return float(2 * pair.sum() + stroke.sum() + instance.skew_coefficient * skew.sum())
