"""Curves that are hidden in turn, and how far a field made without one is from it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from ..errors import InstanceError
from ..field.field import CrossField
from ..instance.grid import Floats, Ints
from ..instance.instance import Instance

SHORTEST: Final = 3
"""Stroke pixels of the shortest curve that is hidden."""
MOST: Final = 0.5
"""Greatest share of the stroke pixels that one curve may have: beyond, the drawing is hidden and no curve."""


@dataclass(frozen=True, eq=False)
class HiddenCurve:
    """A curve of an instance to be hidden.

    number: of the curve, as in `curves_of`. stroke: int (k,), the numbers of its strokes among all of the
    instance (`every_stroke`), so that of a crossing both are counted.
    """

    number: int
    instance: Instance
    stroke: Ints

    @cached_property
    def rest(self) -> Instance:
        """The instance without the curve's strokes; its mask and its other strokes are the same.

        At a crossing the other stroke stays, as the only one.
        """
        whole = self.instance
        hidden = np.zeros(len(whole.every_stroke[1]), dtype=bool)
        hidden[self.stroke] = True
        first, second = hidden[: len(whole.theta)], hidden[len(whole.theta) :]
        alone = first[whole.crossings] & ~second
        at, stays = whole.crossings[alone], ~(alone | second)
        theta, w, kept = whole.theta.copy(), whole.w.copy(), ~first
        theta[at], w[at], kept[at] = whole.theta_cross[alone], whole.w_cross[alone], True
        single = replace(
            whole,
            theta=theta,
            w=w,
            crossings=whole.crossings[stays],
            theta_cross=whole.theta_cross[stays],
            w_cross=whole.w_cross[stays],
        )
        return single.with_strokes(kept)

    def deviation(self, field: CrossField) -> float:
        """The mean angle from the curve to the nearer line of the crosses on it, in [0, pi/2] radians.

        Crosses at random with lines at right angles have pi/8 on average.
        field: on the same grid. Raises InstanceError for another one.
        """
        if not np.array_equal(field.instance.mask, self.instance.mask):
            raise InstanceError(f"the field is not on the pixels of {self.instance.name}")
        at, theta = self.instance.stroke_terms.pixel, self.instance.every_stroke[1]
        return float(field.deviation(at[self.stroke], theta[self.stroke]).mean())


def hidden_curves(instance: Instance, curve: Ints, most: int) -> list[HiddenCurve]:
    """Up to `most` curves that can be hidden, those with most stroke pixels first.

    curve: int (r,), number of the one curve that each stroke belongs to, in the order of `every_stroke`,
    negative where several run: these are never hidden. Left out are curves of fewer than SHORTEST pixels, of
    more than MOST of all, and those without which a part of the mask has no stroke that the field could
    follow.
    """
    numbers, count = np.unique(curve[curve >= 0], return_counts=True)
    wanted = (count >= SHORTEST) & (count <= MOST * len(curve))
    order = np.argsort(-count[wanted], kind="stable")
    found: list[HiddenCurve] = []
    part = _parts(instance)
    for number in numbers[wanted][order]:
        hidden = curve == number
        if len(found) < most and np.isin(part[hidden], part[~hidden]).all():
            found.append(HiddenCurve(int(number), instance, np.nonzero(hidden)[0].astype(np.int32)))
    return found


@dataclass(frozen=True)
class Summary:
    """Angles of several curves: how many, mean and median in their unit, and the standard error of the mean.

    error: sample deviation over the root of the count; None for a single angle. The curves of one drawing
    are correlated: between drawings their means differ by more.
    """

    count: int
    mean: float
    median: float
    error: float | None


def summary(angles: Floats) -> Summary | None:
    """Count, mean, median and standard error of angles (k,); None of none."""
    count = len(angles)
    if not count:
        return None
    error = float(angles.std(ddof=1) / np.sqrt(count)) if count > 1 else None
    return Summary(count, float(angles.mean()), float(np.median(angles)), error)


def _parts(instance: Instance) -> Ints:
    """The number of the 4-connected part of the mask in which each stroke lies, shape (r,)."""
    from scipy import ndimage

    row, column = instance.every_stroke[0].T
    parts: Ints = ndimage.label(instance.mask)[0][row, column]
    return parts
