"""Search for charges of low energy on surfaces without strokes: docs/orthogonal-proofs.md, section 5.

The sums of residuals round all corners determine the energy where there are no handles, and nearly so with
some. A change of one integer moves a unit to a neighbouring corner; here a unit can move to any corner.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.sparse import csr_array, diags_array

from ..instance.angles import HALF
from ..instance.domain import Floats, Ints, Rings
from ..instance.sparse_systems import factor_matrix
from ..orthogonal.energy import OrthogonalEnergy, lowered
from ..processes.deadline import IsOver

_PULL: Final = 1e-7  # of the Laplacian, which is singular
_UNIT: Final = 1e-9  # of energies: whole numbers, so that rounding errors do not decide ties
_KICKS: Final = 300  # perturbations
_WORK: Final = 5e7  # pairs of corners after which there are no more
_NEAR: Final = 40  # corners to which a perturbation moves a unit


def move_charges(energy: OrthogonalEnergy, rings: Rings, z: Ints, is_over: IsOver) -> Ints:
    """Integers whose charges no move of a unit improves, from others (r,), after some perturbations."""
    count, used = len(rings.defect), energy.weight > 0
    walks = csr_array((rings.sign, rings.pair, rings.start), shape=(count, len(z)))
    resistance = diags_array(np.divide(1.0, energy.weight, where=used, out=np.zeros(len(z))))
    inverse = factor_matrix(walks @ resistance @ walks.T, pull=_PULL)(np.eye(count))
    charge = walks @ (energy.constant / HALF + z)
    of_unit = np.diagonal(inverse)
    apart = np.round((of_unit[:, None] + of_unit - 2 * inverse) / _UNIT).astype(np.int64)
    rng, near = np.random.default_rng(0), np.argsort(apart, axis=1, kind="stable")[:, 1 : _NEAR + 1]
    best = _descend(charge, inverse, apart, is_over)
    for _ in range(min(_KICKS, int(_WORK / count**2))):
        if is_over():
            break
        moved = best.copy()
        corner = np.append(rng.integers(count, size=1), np.nonzero(np.abs(best) > 0.5)[0])
        for here in rng.choice(corner, size=rng.integers(1, 4)):
            there = near[here, rng.integers(near.shape[1])]
            step = np.copysign(1, moved[here])
            moved[[here, there]] -= step, -step
        moved = _descend(moved, inverse, apart, is_over)
        if moved @ inverse @ moved < lowered(float(best @ inverse @ best)):
            best = moved
    return energy.with_charges(z, walks, best)


def _descend(charge: Floats, inverse: Floats, apart: Ints, is_over: IsOver) -> Floats:
    """The charges after the best moves of a unit, one after the other."""
    charge = charge.copy()
    while not is_over():
        potential = np.round(2 * (inverse @ charge) / _UNIT).astype(np.int64)
        gain = apart + potential - potential[:, None]
        here, there = divmod(int(gain.argmin()), len(charge))
        if gain[here, there] >= 0:
            break
        charge[[here, there]] += -1, 1
    return charge
