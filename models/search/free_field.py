"""A field under construction: angles that may be any real numbers, jumps without ranges, both free to change.

Windows and ranges of an instance make the label of a cross unique. While a field grows or is searched for,
they are in the way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..field.field import CrossField, relabelled
from ..instance.grid import Floats, Ints
from ..instance.instance import Instance
from ..processes.deadline import Over, never
from .box_qp import fitted


@dataclass(eq=False)
class FreeField:
    """Angles alpha, beta (n,) in radians and jumps p (m,) that change during the construction of a field."""

    instance: Instance
    alpha: Floats
    beta: Floats
    p: Ints

    @classmethod
    def of(cls, field: CrossField) -> FreeField:
        """The same angles and jumps, free to change."""
        return cls(field.instance, field.alpha, field.beta, field.p)

    @property
    def x(self) -> Floats:
        """Both angles, (alpha, beta), shape (2n,)."""
        return np.concatenate([self.alpha, self.beta])

    @x.setter
    def x(self, value: Floats) -> None:
        self.alpha, self.beta = np.split(value, 2)

    @property
    def field(self) -> CrossField:
        """The same angles and jumps as a field."""
        return CrossField(self.instance, self.alpha, self.beta, self.p)

    @property
    def energy(self) -> float:
        """The 2-norm energy."""
        return self.field.energy().total

    def bounded(self, over: Over = never) -> CrossField:
        """The field of least 2-norm energy for these jumps, within the bounds of alpha, beta and p."""
        return fitted(relabelled(self.instance, self.alpha, self.beta, self.p), over)
