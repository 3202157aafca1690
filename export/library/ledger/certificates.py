"""Certificates of 2-norm optima, by a fixed amount of work: every build makes the same."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ....models.field.field import CrossField
from ....models.search.pinned import pinned
from .points import Known, ours

METHOD: Final = "prove"
_MOST_WORK: Final = 20_000_000
"""Labels, counted at each rounding, after which a proof ends: some minutes."""
_MOST_BYTES: Final = 2_000_000
"""A larger certificate is left out: it is of a proof that has left a gap."""


@dataclass(frozen=True, eq=False)
class Certified:
    """What a certificate says, and the bytes of its file. facts: status, energy and bound."""

    known: Known
    data: bytes
    facts: dict[str, Any]


def certified(start: CrossField) -> Certified | None:
    """A proof that begins at a field, as a certificate; None where that would be large."""
    from ....models.proof.certificate import write_certificate
    from ....models.proof.prove import prove  # it loads what is compiled

    found = prove(start.instance, start=start, work=_MOST_WORK, jobs=1)
    field = pinned(found.field)
    proof = replace(found, field=field, energy=field.energy().total)
    with tempfile.TemporaryDirectory(prefix="crossfield-") as folder:
        path = Path(folder) / "a.certificate.npz"
        said = write_certificate(proof, path)
        data = path.read_bytes()
    facts = {"status": said.status, "energy": said.energy, "bound": said.bound}
    return None if len(data) > _MOST_BYTES else Certified(Known(proof.field, ours(METHOD)), data, facts)
