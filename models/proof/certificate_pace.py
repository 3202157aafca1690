"""Expected time of a certificate: an effort per level, and the present pace of the checker.

The unit of effort is a pixel of a level with few labels, whose check takes about 1.6 ms. 340,000 additions of
the checker take as long, and so does compressing 3,200 labels. The pace depends on the machine and its load,
so it is measured on a tiny level.
"""

from __future__ import annotations

import time
from typing import Final

import numpy as np

from ..field.field import CrossField
from ..instance.instance import Instance
from . import check_certificate
from .certificate import certificate_arrays
from .lattice import Lattice
from .record import LevelRecord, Proof

_ADDITIONS: Final = 340_000.0
_LABELS: Final = 3_200.0
_SPARE: Final = 1.4
"""Factor for the rest of a check, and for a load that rises meanwhile."""
_SIDE: Final = 6  # pixels of the tiny instance
_STEPS: Final = 16  # in pi/2, as on the first level of a proof


def certificate_effort(level: Lattice | LevelRecord) -> float:
    """Return the expected effort of checking and writing one level of a certificate."""
    return _SPARE * (len(level.alpha) + level.work / _ADDITIONS + level.allowed.size / _LABELS)


def checking_pace() -> float:
    """Return the seconds per unit of effort that the checker takes now, measured in some 60 ms."""
    pixels = np.array([[0, 0]])
    instance = Instance("pace", np.ones((_SIDE, _SIDE), dtype=bool), pixels, np.zeros(1), np.ones(1))
    zero, pairs = np.zeros(instance.grid.size), np.zeros(len(instance.grid.first), dtype=np.int32)
    field = CrossField(instance, zero, zero, pairs)
    level = _without_shares(Lattice.whole(field, _STEPS))
    arrays = certificate_arrays(Proof(field, 0.0, 0.0, "gap", 0, (level,), 0.0, "time"), "gap", 0.0)
    began = time.perf_counter()
    check_certificate.check(arrays)
    return (time.perf_counter() - began) / (certificate_effort(level) / _SPARE)


def _without_shares(at: Lattice) -> LevelRecord:
    """Return the record of a lattice on which all shares are 0."""
    grid = at.instance.grid
    first, second = (np.zeros(int(at.share_starts(end)[-1])) for end in (grid.first, grid.second))
    ranges = at.alpha_first, at.alpha_count, at.beta_first, at.beta_count
    return LevelRecord(
        at.h, at.alpha, at.beta, at.p, *ranges, at.allowed, first, second,
        quantum=1.0, bound=0.0, energy=0.0, work=at.work,
    )  # fmt: skip
