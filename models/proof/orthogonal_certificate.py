"""Proofs of orthogonal crosses, and their certificates: read and written as those of other crosses."""

from __future__ import annotations

import io
import json
import math
import zipfile
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from ..array_archive import Arrays, pack_arrays
from ..errors import InputError
from ..field.field import CrossField, Norm
from ..instance.domain import Floats
from ..instance.file import instance_arrays, instance_of_arrays
from . import check_orthogonal as checker
from .check_certificate import MOST_BYTES, UnreadableError, parse_array
from .check_orthogonal import ProvenClaim
from .record import Claim

_PREFIX: Final = "instance_"
_LONGEST: Final = 1 << 16  # bytes of a head


@dataclass(frozen=True)
class LevelFacts:
    """Cells of a quarter turn, number of labels, and bound of a level."""

    divisions: int
    size: int
    bound: float

    @property
    def h(self) -> float:
        """The spacing in radians."""
        return math.pi / 2 / self.divisions


@dataclass(frozen=True, eq=False)
class OrthogonalProof(Claim):
    """The best field of orthogonal crosses, and the proven bound.

    Parameters
    ----------
    field, energy, bound, forced, seconds, ended
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
    proven: ProvenClaim | None = field(default=None, repr=False)

    def certificate(self) -> Arrays:
        """The arrays of the certificate, with the claim."""
        head = {
            "format": checker.FORMAT,
            "version": checker.VERSION,
            "status": self.status,
            "energy": self.energy,
            "bound": self.bound,
            "threshold": self.threshold,
        }
        return {"head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8)} | self.arrays

    def packed(self) -> bytes:
        """The bytes of the certificate, equal for equal proofs."""
        return pack_arrays(self.certificate())


def check_proof(proof: OrthogonalProof, limit: Floats | None = None) -> OrthogonalProof:
    """The proof with what the checker confirms. limit: `limits_of` its rows, where it is known.

    Raises NotProvenError or UnreadableError for a proof that does not hold.
    """
    proven = checker.check_arrays(replace(proof, bound=0.0).certificate(), limit)
    ended = "optimal" if proven.status == "optimal" else proof.ended
    return replace(proof, bound=proven.bound, forced=proven.forced, ended=ended, proven=proven)


def is_orthogonal(data: bytes) -> bool:
    """Whether bytes are a certificate of orthogonal crosses, by the head of their archive."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            short = archive.getinfo("head.npy").file_size <= _LONGEST
            return short and checker.FORMAT.encode() in archive.read("head.npy")
    except Exception:  # noqa: BLE001 - a damaged archive can raise anything
        return False


def unpack_arrays(data: bytes) -> Arrays:
    """Unpack the arrays of a certificate, within limits and without pickles. Raises UnreadableError."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            total, methods = sum(member.file_size for member in members), {m.compress_type for m in members}
            names = {member.filename[:-4] for member in members}
            fits = total <= MOST_BYTES and methods <= {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
            if fits and len(names) == len(members):
                return {m.filename[:-4]: parse_array(archive.read(m), m.filename[:40]) for m in members}
    except (UnreadableError, MemoryError):
        raise
    except Exception as error:  # a damaged archive can raise anything
        raise UnreadableError(f"is no .npz that can be read ({type(error).__name__})") from error
    raise UnreadableError("has larger arrays than a certificate may have, or one twice")


def check_bytes(data: bytes) -> tuple[CrossField, float, ProvenClaim]:
    """Field, claimed bound and findings of the checker of a certificate. Raises as `check_arrays`."""
    arrays = unpack_arrays(data)
    proven = checker.check_arrays(arrays)
    parts = {name.removeprefix(_PREFIX): array for name, array in arrays.items() if name.startswith(_PREFIX)}
    instance = instance_of_arrays(parts)
    written = instance_arrays(instance)
    if instance.domain.kappa is not None:
        parts["kappa"], written["kappa"] = arrays["kappa"], instance.domain.kappa
    for name, array in parts.items():
        if name not in written or not np.array_equal(array, written[name]):
            raise InputError(f"array {name!r} of the instance is not as crossfield writes it; prove it again")
    field_ = CrossField(instance, arrays["alpha"], np.zeros(instance.domain.size), arrays["p"])
    return field_, float(checker.head_of(arrays)["bound"]), proven
