"""The discrete problem of a lattice in dense tables, and its least value over all labellings."""

import numpy as np
from angles import HALF


def discrete(lattice):
    """Own costs (D of each pixel, c of each pair with its pixels) by formula, over all jumps and turns.

    Labels that are not allowed cost infinity.
    """
    instance, grid, h = lattice.instance, lattice.instance.grid, lattice.h
    angles = [lattice.angles(np.arange(s, e)) for s, e in zip(lattice.start, lattice.start[1:], strict=False)]
    unary = [instance.skew_coefficient * (beta**2 - h * h / 4) for _, beta in angles]
    for pixel, theta, w in zip(instance.stroke_index, instance.theta, instance.w, strict=True):
        alpha, beta = angles[pixel]
        centre = lattice.alpha[pixel] + lattice.beta[pixel] - theta
        steps = np.rint((alpha + beta - lattice.alpha[pixel] - lattice.beta[pixel]) / h)
        lines = []
        for turn in np.arange(-4, 5) * np.pi:
            own = abs(centre + turn) < np.pi / 4
            lost = np.where(steps == 0, 0, np.where(abs(steps) == 1, 1, 0.5)) if own else 0.5
            lines.append((alpha + beta - theta + turn) ** 2 - lost * h * h)
            lines.append((alpha + HALF - beta - theta + turn) ** 2 - h * h / 2)
        unary[pixel] = unary[pixel] + instance.stroke_coefficient * w * np.min(lines, axis=0)
    allowed = np.split(lattice.allowed, lattice.start[1:-1])
    unary = [np.where(here, cost, np.inf) for here, cost in zip(allowed, unary, strict=True)]
    pairs = []
    for i, j in zip(grid.first, grid.second, strict=True):
        (ai, bi), (aj, bj) = angles[i], angles[j]
        cost = np.min(
            [
                2 * ((ai[:, None] - aj + HALF * p) ** 2 + ((-1) ** p * bi[:, None] - bj) ** 2)
                for p in range(-8, 9)
            ],
            axis=0,
        )
        pairs.append((i, j, cost - h * h))
    return unary, pairs


def least_labelling(unary, pairs):
    """The least sum over all labellings: pixels are eliminated one by one."""
    tables = [((i,), cost) for i, cost in enumerate(unary)] + [((i, j), cost) for i, j, cost in pairs]
    for pixel in range(len(unary)):
        mine = [table for table in tables if pixel in table[0]]
        scope = sorted({other for table in mine for other in table[0]} - {pixel})
        axes = [pixel, *scope]
        total = np.zeros(())
        for names, values in mine:
            order = np.argsort([axes.index(name) for name in names])
            shape = [len(unary[axis]) if axis in names else 1 for axis in axes]
            total = total + values.transpose(order).reshape(shape)
        tables = [table for table in tables if pixel not in table[0]] + [(tuple(scope), total.min(axis=0))]
    return sum(float(values) for _, values in tables)
