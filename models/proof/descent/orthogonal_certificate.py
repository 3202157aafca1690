"""Proofs of orthogonal crosses, and their certificates: read and written as those of other crosses."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ...array_archive import Arrays, pack_arrays
from ...field.field import Norm
from ...instance.domain import Floats
from ..checkers import check_orthogonal as checker
from ..checkers.check_certificate import ProvenClaim, memory_for
from .record import Claim


class LevelFacts(NamedTuple):
    """Spacing of the labels in radians, their number, and the bound of a level."""

    h: float
    size: int
    bound: float


@dataclass(frozen=True, eq=False)
class OrthogonalProof(Claim):
    """The best field of orthogonal crosses, and the proven bound.

    Parameters
    ----------
    field, energy, bound, forced, seconds, ended, reason
        As in `Proof`.
    levels
        The last chain of levels, coarsest first.
    arrays
        The arrays of the certificate without its head.
    threshold
        The energy for which the levels were pruned.
    proven
        Findings of the checker; None before the check.

    """

    forced: int
    levels: tuple[LevelFacts, ...]
    seconds: float
    ended: str
    arrays: Arrays
    threshold: float
    norm: Norm = 2
    reason: str = ""
    proven: ProvenClaim | None = field(default=None, repr=False)

    def certificate(self) -> Arrays:
        """The arrays of the certificate, with the claim."""
        head = {name: getattr(self, name) for name in ("status", "energy", "bound", "threshold")}
        head |= {"format": checker.FORMAT, "version": checker.VERSION}
        return {"head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8)} | self.arrays


def check_proof(proof: OrthogonalProof, limit: Floats | None = None) -> OrthogonalProof:
    """The proof with what the checker confirms. limit: of Lemma 1, where it is known.

    Raises NotProvenError or UnreadableError for a proof that does not hold.
    """
    arrays = replace(proof, bound=0.0).certificate()
    proven = checker.check_arrays(arrays, limit, memory_for(len(pack_arrays(arrays)), checker.MORE_ROOM))
    ended = "optimal" if proven.status == "optimal" else proof.ended
    return replace(proof, bound=proven.bound, forced=proven.forced, ended=ended, proven=proven)
