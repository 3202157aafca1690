"""Discrete costs of labels whose sum never exceeds the energy of the fields that the labels represent.

Round every cross x_i to a vertex of its cell: alpha up or down by a threshold t, beta by another, both
uniform, so that the means are right (bilinear weights). Let pixels share the thresholds; at an odd jump p
the pair takes 1 - t for one of its betas. Each difference of a pair, A and B, then becomes one of two
neighbouring values of spacing h with the right mean: its variance is at most h^2/4. The law of a pixel's
vertex does not depend on how its pairs are coupled, so one law per pixel and one per pair fit together:
they are feasible for the local polytope. Hence with

    pair    c = min over p of 2 (A^2 + B^2) - h^2              E[c] <= 2 (a^2 + b^2)
    stroke  w (min over lines and turns of R^2 - h^2/2)         E[.] <= w r^2,  R rounded in alpha and beta
    skew    w_beta (beta^2 - h^2/4)                             E[.] <= w_beta beta^2

every lower bound of the discrete problem over that polytope, from any messages, is a lower bound of the
energy of all fields whose crosses lie in cells with four allowed vertices.

Where the centre of a black pixel has its line u within pi/4 of the stroke, u may lose another amount at the
label (k, l): 0 where k + l = 0, h^2 where |k + l| = 1, else h^2/2. With the weights f, g in alpha and beta, R
has the variance h^2 (f (1 - f) + g (1 - g)). In the cells that touch k + l = 0 the mean loss exceeds it by
h^2 (f^2 + g^2 - 3 f g/2) or h^2 (1 - f - g)^2; elsewhere it is h^2/2 or more. u stays the line of this turn
there, because h <= pi/8.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..instance.angles import wrap
from ..instance.grid import Floats
from ..instance.instance import HALF, QUARTER
from ..smooth.systems import stroke_weight
from .common_lattice import CommonLattice
from .lattice import Lattice


def pair_deduction(h: float) -> float:
    """Deduction of a pair's discrete cost from the cost of its two labels: h^2."""
    return h * h


def unary_costs(lattice: Lattice) -> Floats:
    """D of each label, flat: skew and stroke term with their deductions; inf for labels not allowed."""
    if isinstance(lattice, CommonLattice):
        return lattice.unary_costs()
    instance, h = lattice.instance, lattice.h
    alpha, beta = lattice.angles
    cost: Floats = instance.skew_coefficient * (beta**2 - h * h / 4)
    weight = stroke_weight(instance)[lattice.pixel]
    at = np.flatnonzero(weight)
    cost[at] += weight[at] * _misfit(lattice, at, alpha[at], beta[at])
    cost[~lattice.allowed] = np.inf
    return cost


def _misfit(lattice: Lattice, at: NDArray[np.int64], alpha: Floats, beta: Floats) -> Floats:
    """The squared angle from the stroke to the nearer line, less its deduction, at some labels."""
    instance, h = lattice.instance, lattice.h
    pixel, steps = lattice.pixel[at], lattice.steps
    target = np.zeros(instance.grid.size)
    target[instance.stroke_index] = instance.target
    u, v = alpha + beta - target[pixel], alpha + HALF - beta - target[pixel]
    own = wrap((lattice.alpha + lattice.beta - target)[pixel], -HALF, np.pi)
    away = np.abs(steps[0][at] + steps[1][at])
    black = (lattice.offset[pixel] == 0) & (np.abs(own) < QUARTER)
    lost = np.where(black & (away <= 1), away, 0.5)
    u, v = wrap(u, -HALF, np.pi), wrap(v, -HALF, np.pi)
    return np.minimum(u * u - lost * h * h, v * v - h * h / 2)
