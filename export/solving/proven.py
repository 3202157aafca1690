"""Proven bounds for the fields of a run, with the certificate that holds them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ...models.proof.check_certificate import gap_of, status_of
from ...models.proof.record import Proof

if TYPE_CHECKING:
    from ...models.proof.certificate import Certificate

NOTHING: Final = "nothing was proven within the time limit: the bound is 0, and there is no certificate"
"""Statement of a proof without a result."""


@dataclass(frozen=True)
class Proven:
    """The claim that no field has a 2-norm energy below `bound`, with its proof in the file `certificate`."""

    bound: float
    certificate: Path

    @classmethod
    def by(cls, proof: Proof | None, path: Path) -> Proven | None:
        """Return the result of a proof, with its certificate at `path`; None without a result.

        Errors are those of `certified`.
        """
        found = certified(proof, path)
        return None if found is None else cls(found.bound, path)

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


def certified(proof: Proof | None, path: Path) -> Certificate | None:
    """Write the certificate of a proof to `path`, if it proves something.

    If nothing is proven, there is none, and a file of an earlier call is removed. Raises InputError for a
    proof that the checker refuses, and OutputError when the file cannot be written.
    """
    path.unlink(missing_ok=True)
    if proof is None or not proof.levels or (proof.verdict is not None and proof.bound <= 0 < proof.energy):
        return None
    from ...models.proof.certificate import write_certificate

    return write_certificate(proof, path)
