"""The lattice of the 1-norm: one for all pixels, on which pairs lose nothing.

alpha and beta of every label are multiples of h, and h divides pi/4. So the differences A and B of two
labels are multiples of h too, at every jump. Round crosses by thresholds as in check_certificate.py, 2: A
and B each become one of two neighbouring multiples of h with the right mean. |.| is linear between them,
and so it is for beta. Hence

    pair    c = min over p of 2 (|A| + |B|)        E[c] <= 2 (|a| + |b|)
    skew    w_beta |beta|                          E[.] = w_beta |beta|

For strokes the line's misfit R = alpha + beta - theta is a sum of two that are rounded independently: it
becomes one of three values h apart, with the right mean. They need not be multiples of h. With any -1 <= l
<= 1 let

    stroke  w d(R),  d(R) = |R| where |R| >= 2h, else l R        E[.] <= w |r|

Either all three values are less than 2h in size. Then d is linear there, and its mean is l r <= |r|. Or one
of them is 2h or more in size: because they span 2h, none has another sign. Then |.| is linear on them, d is
nowhere more, and the mean of d is at most |r|. The same holds with R = alpha + pi/2 - beta - theta for line
v, with l = 0, and after any number of turns by pi. The least over lines and turns is nowhere more than any
of them.

So the local polytope of the discrete problem holds every field at no more than its 1-norm energy. At the
best angles for some jumps there is no loss if l is the multiplier of the stroke in the linear program for
them (models/search/box_lp.py): l R supports |R| at r, and the pairs hold it in balance.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..field.field import CrossField, Norm
from ..instance.angles import wrap
from ..instance.grid import Floats
from ..instance.instance import HALF
from .lattice import Lattice, reached, whole_ranges


@dataclass(frozen=True, eq=False)
class CommonLattice(Lattice):
    """The labels of one level in the 1-norm; centres are multiples of the spacing, those of beta 0.

    slopes (s,): l of each stroke, in [-1, 1].
    """

    norm: ClassVar[Norm] = 1
    slopes: Floats

    @classmethod
    def near(cls, field: CrossField, slopes: Floats, steps: int) -> CommonLattice:
        """The lattice of spacing pi / (2 steps) with every cross of the strip in a cell.

        steps: an even number. alpha covers pi/2 round the multiple of h nearest to the field's alpha.
        """
        h, beta = HALF / steps, np.zeros(field.instance.grid.size)
        alpha = h * np.round(field.alpha * reached(field.instance) / h)
        ranges = whole_ranges(field.instance, beta, h, beta)
        return cls(field.instance, h, alpha, beta, field.p, slopes=slopes, **ranges)

    @cached_property
    def offset(self) -> Floats:
        """0 at every pixel, shape (n,)."""
        return np.zeros(self.instance.grid.size)

    def _skew(self, beta: Floats) -> Floats:
        return np.abs(beta)

    def _misfit(self, at: NDArray[np.int64], alpha: Floats, beta: Floats) -> Floats:
        target, slope = np.zeros((2, self.instance.grid.size))
        target[self.instance.stroke_index] = self.instance.target
        slope[self.instance.stroke_index] = self.slopes
        pixel = self.pixel[at]
        u = self._away(alpha + beta - target[pixel], slope[pixel])
        v = self._away(alpha + HALF - beta - target[pixel], np.zeros(len(at)))
        return np.minimum(u, v)

    def _away(self, r: Floats, slope: Floats) -> Floats:
        """The cost d(R) of a line, slightly reduced where rounding could increase it."""
        r = wrap(r, -HALF, np.pi)
        return np.where(np.abs(r) >= 2 * self.h * (1 + 1e-12) + 1e-12, np.abs(r), slope * r)
