"""Descent by the method of Levenberg and Marquardt, with sparse normal equations."""

from __future__ import annotations

from typing import Final

from scipy import sparse

from ..instance.grid import Floats
from ..processes.deadline import Over
from ..smooth.systems import factored
from .equations import Equations

_ROUNDS: Final = 60  # 5 to 25 are usual
_TRIALS: Final = 12  # increases of the damping in a round
_FALL: Final = 2e-4  # least share of the energy that a round has to remove before another one
_DAMPING: Final = 1e-2
_LEAST: Final = 1e-9
_UP: Final = 5.0
_DOWN: Final = 8.0


def descended(equations: Equations, z: Floats, over: Over) -> tuple[float, Floats]:
    """Minimise from heights z, until there is hardly any gain; return the energy reached and its heights."""
    energy, damping = equations.energy(z), _DAMPING
    for _ in range(_ROUNDS):
        if over():
            break
        slope, curvature = equations.model(z)
        diagonal = sparse.diags_array(curvature.diagonal())
        for _ in range(_TRIALS):
            tried = z - factored(curvature + damping * diagonal)(slope)
            reached = equations.energy(tried)
            if reached < energy:
                break
            damping *= _UP
        else:
            break
        fallen, z, energy = energy - reached, tried, reached
        damping = max(damping / _DOWN, _LEAST)
        if fallen <= _FALL * (energy + fallen):
            break
    return energy, z
