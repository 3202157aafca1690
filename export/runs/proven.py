"""Certificates of proofs, or the reasons why there is none."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from ...models.errors import SolverError

if TYPE_CHECKING:
    from ...models.proof.descent.record import Claim, Proof

_REMEDY: Final = "give it more time or memory, a smaller gap, or a smaller instance"


def certify(proof: Proof, path: Path) -> Claim:
    """Write the certificate of a proof to `path`.

    Raises SolverError, with the reason, for a proof without a bound, InputError for a proof that the checker
    refuses, and OutputError when the file cannot be written. A file of an earlier call then stays.
    """
    from ...models.proof.certificate import write_certificate

    if not proof.has_bound or (proof.proven is not None and proof.bound <= 0 and proof.status == "gap"):
        reason = proof.reason or f"it ended ({proof.ended}) before a bound was proven; {_REMEDY}"
        raise SolverError(f"nothing was proven, and there is no certificate: {reason}")
    return write_certificate(proof, path)
