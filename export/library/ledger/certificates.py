"""Certificates of 2-norm optima, by a fixed amount of work: every build makes the same one."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ....models.field.field import CrossField
from ....models.instance.instance import Instance
from ....models.proof.certificate import Certificate, read_certificate, write_certificate
from ....models.search.pinned import pinned
from .points import Known, Provenance, ours

METHOD: Final = "prove"
_MOST_WORK: Final = 20_000_000
"""Labels, counted at each rounding, after which a proof ends: some minutes."""
_MOST_BYTES: Final = 2_000_000
"""A larger certificate is left out: it is of a proof that has left a gap."""


@dataclass(frozen=True, eq=False)
class Certified:
    """A checked certificate.

    known: its field; file, data: name and bytes of its file; facts: status, energy and bound.
    """

    known: Known
    file: str
    data: bytes
    facts: dict[str, Any]

    @classmethod
    def of(cls, found: Certificate, file: str, data: bytes, provenance: Provenance) -> Certified:
        """Return it as the checker found it."""
        facts = {"status": found.status, "energy": found.energy, "bound": found.bound}
        return cls(Known(found.field, provenance), file, data, facts)


def certified(start: CrossField, file: str) -> Certified | None:
    """Prove the optimum from a field and return the certificate; None if that would be large.

    file: the name under which it is stored.
    """
    from ....models.proof.prove import prove  # loads compiled functions

    found = prove(start.instance, start=start, work=_MOST_WORK, jobs=1)
    field = pinned(found.field)
    proof = replace(found, field=field, energy=field.energy().total)
    with tempfile.TemporaryDirectory(prefix="crossfield-") as folder:
        path = Path(folder) / "a.certificate.npz"
        claim = write_certificate(proof, path)
        data = path.read_bytes()
    return None if len(data) > _MOST_BYTES else Certified.of(claim, file, data, ours(METHOD))


def certified_by(data: bytes, file: str, on: Instance, provenance: Provenance) -> Certified:
    """Check the bytes of a certificate of an instance. Raises as `read_certificate`."""
    with tempfile.TemporaryDirectory(prefix="crossfield-") as folder:
        path = Path(folder) / file
        path.write_bytes(data)
        return Certified.of(read_certificate(path, on=on), file, data, provenance)
