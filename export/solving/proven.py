"""Proven bounds for the fields of a run, with the certificate that holds them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ...models.errors import SolverError
from ...models.processes.deadline import Deadline, Over, never
from ...models.proof.record import EXACT, Proof

if TYPE_CHECKING:
    from ...models.proof.certificate import Certificate

NOTHING: Final = "nothing was proven within the time limit: the bound is 0, and there is no certificate"
"""Statement of a proof without a result."""

_LATE: Final = 0.5  # seconds by which a check may exceed the time limit, rather than drop levels
_LATE_SHARE: Final = 0.05  # of the proof's time, by which it may exceed it as well


@dataclass(frozen=True)
class Proven:
    """The claim that no field has a 2-norm energy below `bound`, with its proof in the file `certificate`."""

    bound: float
    certificate: Path

    @classmethod
    def by(cls, proof: Proof | None, path: Path, deadline: Deadline, stop: Over = never) -> Proven | None:
        """Return the result of a proof, with its certificate at `path`; None without a result.

        Errors are those of `certified`.
        """
        found = certified(proof, path, deadline, stop)
        return None if found is None else cls(found.bound, path)

    def facts(self, energy: float) -> dict[str, Any]:
        """Bound and relative gap of a field with that 2-norm energy, and whether the gap is zero."""
        optimal = energy - self.bound <= EXACT * (1 + energy)
        gap = 0.0 if optimal else (energy - self.bound) / energy
        return {"bound_2_norm": self.bound, "gap_2_norm": gap, "proven_optimal": optimal}

    def document(self, energy: float) -> dict[str, Any]:
        """The facts of the best field, with the status and the certificate's name, for a report."""
        facts = self.facts(energy)
        status = "optimal" if facts.pop("proven_optimal") else "gap"
        return {"status": status, **facts, "certificate": self.certificate.name}


def certified(proof: Proof | None, path: Path, deadline: Deadline, stop: Over = never) -> Certificate | None:
    """Write the certificate of a proof to `path`, if it proves something.

    A proof keeps time for its certificate. If that is not enough, the certificate may end after the deadline,
    by half a second and 5 % of the time of the proof. With still less time it proves less. If nothing is
    proven or no time is left, there is none, and a file of an earlier call is removed. stop: returns whether
    the user requests the end. Raises InputError for a proof that the checker refuses, and OutputError when
    the file cannot be written.
    """
    path.unlink(missing_ok=True)
    if proof is None or not proof.levels:
        return None
    last = deadline.later(_LATE + _LATE_SHARE * proof.seconds)
    if proof.bound <= 0 < proof.energy or last.passed():
        return None
    from ...models.proof.certificate import write_certificate

    try:
        return write_certificate(proof, path, stop=lambda: last.passed() or stop())
    except SolverError:
        return None
