"""Curves that are hidden in turn, and the error there of a field made without them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from crossfield.models.errors import InstanceError
from crossfield.models.field.field import CrossField
from crossfield.models.instance.domain import Floats, Ints
from crossfield.models.instance.instance import Instance

SHORTEST: Final = 3  # fewest stroke pixels of a curve that is hidden
MOST: Final = 0.5  # greatest share of the stroke pixels that a hidden curve may have


@dataclass(frozen=True, eq=False)
class HiddenCurve:
    """A curve of an instance to be hidden.

    number: number of the curve, as in `curves_of`. stroke: int (k,), numbers of its stroke pixels.
    """

    number: int
    instance: Instance
    stroke: Ints

    @cached_property
    def rest(self) -> Instance:
        """The instance without the curve's strokes; its mask and its other strokes stay."""
        shown = np.ones(len(self.instance.theta), dtype=bool)
        shown[self.stroke] = False
        instance = self.instance
        index, theta, w = instance.stroke_index[shown], instance.theta[shown], instance.w[shown]
        return replace(instance, stroke_index=index, theta=theta, w=w)

    def deviation(self, field: CrossField) -> float:
        """The mean angle, in [0, pi/2] radians, from the curve to the nearer line of a field on its grid."""
        if not np.array_equal(field.instance.mask, self.instance.mask):
            raise InstanceError(f"the field is not on the pixels of {self.instance.name}")
        at, theta = self.instance.stroke_index, self.instance.theta
        return float(field.deviation(at[self.stroke], theta[self.stroke]).mean())


def hidden_curves(instance: Instance, curve: Ints, most: int) -> list[HiddenCurve]:
    """Up to `most` curves that can be hidden, those with most stroke pixels first.

    curve: int (s,), number of the only curve at each stroke pixel, negative where several curves meet.
    Curves whose absence would leave a part of the mask without strokes are excluded.
    """
    from scipy import ndimage

    numbers, count = np.unique(curve[curve >= 0], return_counts=True)
    wanted = (count >= SHORTEST) & (count <= MOST * len(curve))
    order = np.argsort(-count[wanted], kind="stable")
    curves: list[HiddenCurve] = []
    part = ndimage.label(instance.mask)[0][tuple(instance.stroke_pixels.T)]
    for number in numbers[wanted][order]:
        hidden = curve == number
        if len(curves) < most and np.isin(part[hidden], part[~hidden]).all():
            curves.append(HiddenCurve(int(number), instance, np.nonzero(hidden)[0].astype(np.int32)))
    return curves


@dataclass(frozen=True)
class Summary:
    """Count, mean and standard error of the values of several drawings."""

    count: int
    mean: float
    error: float

    def __str__(self) -> str:
        return f"{self.mean:.1f} ± {self.error:.1f}"


def summary(values: Floats) -> Summary | None:
    """Count, mean and standard error of values (k,); None for fewer than two."""
    count = len(values)
    if count < 2:
        return None
    return Summary(count, float(values.mean()), float(values.std(ddof=1) / np.sqrt(count)))
