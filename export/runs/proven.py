"""Proven bounds for the fields of a run, with the certificate that holds them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ...models.errors import SolverError
from ...models.proof.checkers.check_certificate import gap_of, status_of
from ...models.proof.descent.record import Proof

if TYPE_CHECKING:
    from ...models.proof.descent.record import Claim

_ENDED: Final = {
    "time": "the time limit ended before a bound was proven; increase it",
    "interrupted": "the proof was interrupted before its check confirmed a bound",
    "work": "the limit of work ended before a bound was proven; increase it",
    "gap": "the requested gap allows the bound 0; request a smaller one",
    "labels": "the next level would have too many labels",
    "memory": "its levels take more memory than there is",
}
"""Reasons of a proof without a bound, by what ended it."""


@dataclass(frozen=True)
class ProvenBound:
    """The claim that no field has a 2-norm energy below `bound`, with its proof in the file `certificate`."""

    bound: float
    certificate: Path

    @classmethod
    def write(cls, proof: Proof, path: Path) -> ProvenBound:
        """Return the result of a proof, with its certificate at `path`. Errors are those of `certify`."""
        return cls(certify(proof, path).bound, path)

    def facts(self, energy: float) -> dict[str, Any]:
        """Bound and relative gap of a field with that 2-norm energy, and whether the gap is zero."""
        optimal = status_of(energy, self.bound) == "optimal"
        return {
            "bound_2_norm": self.bound,
            "gap_2_norm": gap_of(energy, self.bound),
            "proven_optimal": optimal,
        }

    def document(self, energy: float) -> dict[str, Any]:
        """The facts of the best field, with the status and the certificate's name, for a report."""
        facts = self.facts(energy)
        status = "optimal" if facts.pop("proven_optimal") else "gap"
        return {"status": status, **facts, "certificate": self.certificate.name}


def certify(proof: Proof, path: Path) -> Claim:
    """Write the certificate of a proof to `path`.

    Raises SolverError, with the reason, for a proof without a bound, InputError for a proof that the checker
    refuses, and OutputError when the file cannot be written. A file of an earlier call then stays.
    """
    from ...models.proof.certificate import write_certificate

    if not proof.levels or (proof.proven is not None and proof.bound <= 0 and proof.status == "gap"):
        reason = proof.reason or _ENDED.get(proof.ended, "its levels prove no bound above 0")
        raise SolverError(f"nothing was proven, and there is no certificate: {reason}")
    return write_certificate(proof, path)
