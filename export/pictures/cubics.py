"""Smooth curves through dense points: cubic Beziers that join without a corner.

A line of hundreds of points becomes a few curves that a drawing program can edit.
"""

from __future__ import annotations

import numpy as np

from ...models.instance.grid import Floats
from ...models.sketch.curves import lines_as_cubics


def fitted(points: Floats, tolerance: float) -> Floats:
    """Control points (m, 4, 2) of cubics, end to end, that pass points (k, 2) within the tolerance.

    They are a smoothing spline, periodic for a closed line, that begins and ends at the first and last point.
    """
    from scipy.interpolate import BPoly, PPoly, splev, splprep

    points = points[np.concatenate([[True], (np.diff(points, axis=0) != 0).any(axis=1)])]
    if len(points) < 3:  # no bend
        return lines_as_cubics(points[:-1], points[1:])
    if len(points) == 3:  # a cubic spline needs more
        points = np.insert(points, [1, 2], (points[1:] + points[:-1]) / 2, axis=0)
    weights = np.ones(len(points))
    weights[[0, -1]] = 1e3
    closed = bool((points[0] == points[-1]).all())
    smoothing = len(points) * (tolerance / 2) ** 2
    while True:
        (spline, along), *_ = splprep(points.T, w=weights, s=smoothing, per=closed, full_output=True)
        off = np.linalg.norm(np.transpose(splev(along, spline)) - points, axis=1)
        if off.max() <= tolerance:
            break
        smoothing /= 4
    knots, coordinates, degree = spline
    curves: Floats = np.stack(
        [BPoly.from_power_basis(PPoly.from_spline((knots, each, degree))).c.T for each in coordinates],
        axis=-1,
    )
    curves = curves[np.diff(knots) > 0]
    curves[0, 1] += points[0] - curves[0, 0]
    curves[-1, 2] += points[-1] - curves[-1, 3]
    curves[:, 0] = np.concatenate([points[:1], curves[:-1, 3]])
    curves[-1, 3] = points[-1]
    return curves
