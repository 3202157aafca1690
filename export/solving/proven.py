"""What is proven of the fields of a run: a bound of the problem, with the certificate that holds it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ...models.errors import SolverError
from ...models.processes.deadline import Deadline
from ...models.proof.record import EXACT, Proof

_CHECKING: Final = 0.8  # share of the time for a certificate; in the rest it is packed


@dataclass(frozen=True)
class Proven:
    """That no field of the instance has a 2-norm energy below `bound`, as the file `certificate` shows."""

    bound: float
    certificate: Path

    def facts(self, energy: float) -> dict[str, Any]:
        """Bound, relative gap, and whether it is none, of a field with that 2-norm energy."""
        optimal = energy - self.bound <= EXACT * (1 + energy)
        gap = 0.0 if optimal else (energy - self.bound) / energy
        return {"bound_2_norm": self.bound, "gap_2_norm": gap, "proven_optimal": optimal}

    def document(self, energy: float) -> dict[str, Any]:
        """The same of the best field, with the status and the certificate's name, for a report."""
        facts = self.facts(energy)
        status = "optimal" if facts.pop("proven_optimal") else "gap"
        return {"status": status, **facts, "certificate": self.certificate.name}


def certified(proof: Proof | None, path: Path, deadline: Deadline) -> Proven | None:
    """What a proof's certificate says, which is at `path` now; None, and no file, where nothing is proven.

    With little time the certificate says less, or nothing. Raises InputError for a proof that the checker
    refuses, and OutputError when the file cannot be written.
    """
    path.unlink(missing_ok=True)
    if proof is None or proof.bound <= 0 < proof.energy:
        return None
    from ...models.proof.certificate import write_certificate

    try:
        return Proven(write_certificate(proof, path, deadline.share(_CHECKING).passed).bound, path)
    except SolverError:
        return None
