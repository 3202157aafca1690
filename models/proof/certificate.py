"""Certificates: the claims of a proof in a file that anyone can check without the code of the prover.

An .npz with equal bytes for equal proofs. It holds the arrays of a field file (models/field/file.py; the
format is another), with the claim in its head: status, energy, bound and the number of levels. For each
level, with the prefixes `level_0_`, `level_1_`, ...:

    h           (1,)    spacing
    alpha, beta (n,)    centres
    ranges      (n, 4)  first step and number of labels of alpha, then of beta
    allowed             a bit for each label
    scale       (m,)    of each pair's message
    wide        (m,)    whether its whole numbers are among steps_32 rather than steps_16
    steps_16, steps_32  the messages one after the other: what a pair gives to the allowed labels of its
                        earlier pixel, each number less the one before, which compresses well; sums are
                        modulo 2^32; in other norms than 2, steps_32 and steps_64, modulo 2^64
    quads       (q,)    clusters: the lower left pixels of their quads, ascending
    table_scale (4q,)   of each table
    table_steps         the tables of each cluster one after the other, as whole numbers of their scales, each
                        number less the one before

The share of a pair's later pixel is not stored, because the best one follows from the earlier pixel's
(models/proof/check_certificate.py, 3). So half of a level's shares are enough. They are whole numbers
times a scale, and for any values of them the resulting bound is valid.

If cells were cut into parts, there is also:

    branches    (levels, 4) for each level, what it covers: the level that left these cells; the pixel of the
                cut, or -1 for all cells; 0 for the cells below a step of alpha, 1 for those above, 2 and 3
                the same for beta; the step

In other norms than 2 there are also:

    slopes      (n,)    of the stroke terms
    multipliers (2m + 2n,)  of A, B, R and beta, which prove the least energy on the last boxes; if these are
                        cut, those of one piece after the other
    cuts                only if the boxes are cut: for each piece, before its parts, the pixel where it is
                        cut into three, or -1 for a piece that stays whole
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Final, cast

import numpy as np

from ..arguments import check_arguments
from ..array_archive import Arrays, Packing
from ..errors import InputError, InstanceError, SolverError, naming
from ..field.field import CrossField, Norm
from ..instance.file import instance_arrays, instance_of_arrays
from ..instance.instance import Instance
from ..processes.deadline import Over, Stop, stop_function
from ..storage import read_bytes, write_bytes
from . import check_certificate
from .check_certificate import Verdict, Way
from .clusters import clusters_on, table_sizes
from .encoding import messages_of, tables_of
from .lattice import Lattice
from .record import Claim, LevelRecord, Proof
from .state import Indices

REFUSALS: Final = (check_certificate.RefusedError, check_certificate.UnreadableError)
"""Errors of the checker for a proof that does not hold."""

_PREFIX: Final = "instance_"
_PIXEL: Final = 1.0  # effort for each pixel, besides that for its labels
_LABELS: Final = 2_300.0  # allowed ones, checked and compressed per unit of effort
_COSTS: Final = 25_000.0  # of pairs in alpha or in beta, per unit of effort
_TERMS: Final = 2_000_000.0  # an alpha of one pixel and an allowed label of its neighbour, per unit of effort
_QUAD: Final = 2.7  # effort for each quad with tables, besides that for their numbers
_NUMBERS: Final = 7_000.0  # of tables, per unit of effort
_SPARE_TIME: Final = 1.1  # safety factor: the machine may become busier


@dataclass(frozen=True, eq=False)
class Certificate(Claim):
    """A checked claim: no field has an energy below the bound.

    Parameters
    ----------
    field
        The field. With status `optimal`, its energy is the minimum.
    energy
        Its energy in the norm.
    bound
        Proven lower bound of the energy of all fields.
    verdict
        Findings of the checker.

    """

    verdict: Verdict

    @property
    def norm(self) -> Norm:
        """The norm of the energy."""
        found: Norm = self.verdict.norm
        return found

    @property
    def forced(self) -> int:
        """The number of pairs whose jump equals the field's in every field that could be better."""
        return self.verdict.forced


@check_arguments
def write_certificate(proof: Proof, path: str | Path, *, stop: Stop | None = None) -> Certificate:
    """Write the certificate of a proof, as far as the checker confirms it.

    The certificate may claim less than the proof. The same proof gives the same bytes.

    Parameters
    ----------
    proof
        The proof.
    path
        The file to write.
    stop
        A function that returns whether to stop, or an event, for a proof that is not checked yet. The
        certificate then has only the levels that were checked before.

    Returns
    -------
    Certificate
        What the file claims.

    Raises
    ------
    InputError
        For a proof that the checker refuses.
    SolverError
        For a proof without levels, and when `stop` ends the check before the coarsest level is checked.
    OutputError
        When the file cannot be written.

    """
    path = Path(path)
    if not proof.levels:
        raise SolverError("is not written: nothing was proven, because no level was completed", file=path)
    try:
        checked = proof if proof.verdict is not None else checked_proof(proof, stop_function(stop))
    except check_certificate.StoppedError as error:
        reason = "is not written: the time was over before the coarsest level of the proof was checked"
        raise SolverError(reason, file=path) from error
    except REFUSALS as error:
        raise InputError(f"would hold a proof that is not valid: {error}", file=path) from error
    except MemoryError as error:
        raise SolverError("is not written: its check takes more memory than there is", file=path) from error
    verdict, packing = cast("Verdict", checked.verdict), Packing()
    count = len(verdict.levels)
    written = replace(checked, levels=checked.levels[:count], branches=checked.branches[:count])
    packing.add(_arrays(written) | _head(written))
    write_bytes(path, packing.finish())
    return Certificate(written.field, written.energy, written.bound, verdict)


def checked_proof(proof: Proof, over: Over) -> Proof:
    """The proof with the checker's findings, and with the bound and the forced jumps that it confirms.

    over: returns whether to end the check. The proof then has the bound of the levels checked before. Raises
    StoppedError if there are none, and one of `REFUSALS` for a proof that does not hold.
    """
    verdict = check_certificate.check(_arrays(proof) | _head(replace(proof, bound=0.0)), over, _quick_way())
    ended = "optimal" if verdict.status == "optimal" else proof.ended
    found = replace(proof, bound=verdict.bound, forced=verdict.forced, ended=ended)
    object.__setattr__(found, "verdict", verdict)
    return found


@check_arguments
def read_certificate(path: str | Path, *, on: Instance | None = None) -> Certificate:
    """Read and check a certificate.

    Field, instance, energy, bound and status come from the arrays that the checker has checked.

    Parameters
    ----------
    path
        The file.
    on
        The instance that the field must be on, if given.

    Returns
    -------
    Certificate
        The claim, which holds.

    Raises
    ------
    InputError
        For an unreadable file, another instance, and a claim that does not hold.
    InstanceError
        For a field or an instance that breaks its rules.

    """
    path = Path(path)
    try:
        arrays = check_certificate.unpacked(read_bytes(path, check_certificate.MOST_BYTES))
        head = check_certificate.head_of(arrays)
        with naming(path):
            field = _field(arrays)
        if on is not None and field.instance.sha256 != on.sha256:
            raise InputError(
                f"is a certificate of another instance ({field.instance.summary}), not of {on.summary}",
                file=path,
            )
        verdict = _checked(arrays)
    except check_certificate.RefusedError as error:
        raise InputError(f"is refused as a certificate: {error}", file=path) from error
    except check_certificate.UnreadableError as error:
        raise InputError(f"is not a certificate: {error}", file=path) from error
    except MemoryError as error:
        raise InputError("takes more memory to check than there is", file=path) from error
    return Certificate(field, field.energy(verdict.norm).total, head["bound"], verdict)


def _checked(arrays: Arrays) -> Verdict:
    """Verdict of the checker, which takes the quick way where loading it takes less time than it saves."""
    if sum(array.size for array in arrays.values()) < check_certificate.LARGE:
        return check_certificate.check(arrays)
    return check_certificate.check(arrays, way=_quick_way())


def _field(arrays: Arrays) -> CrossField:
    """The field of a certificate; its instance must not round the arrays, which alone are proven."""
    parts = {name.removeprefix(_PREFIX): array for name, array in arrays.items() if name.startswith(_PREFIX)}
    field = CrossField(instance_of_arrays(parts), arrays["alpha"], arrays["beta"], arrays["p"])
    written = instance_arrays(field.instance)
    for name, array in parts.items():
        if not np.array_equal(array, written[name]):
            raise InstanceError(f"array {_PREFIX + name!r} is not as crossfield writes it; prove it again")
    return field


@cache
def _quick_way() -> Way:
    """The checker's way with compiled products, whose least sums are the same numbers.

    It is on one thread: most of the work is in many short calls of NumPy, and two threads take longer.
    """
    from ..processes.compiled import compiled_if_needed  # loads Numba

    return Way(check_certificate.in_loops(partial(compiled_if_needed, in_any_order=True)))


def _head(proof: Proof) -> Arrays:
    """The head of a certificate, with the claim of a proof."""
    head = {
        "format": check_certificate.FORMAT,
        "version": check_certificate.VERSION,
        "status": proof.status,
        "energy": proof.energy,
        "bound": proof.bound,
        "levels": len(proof.levels),
        "norm": proof.norm,
    }
    return {"head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8)}


def _arrays(proof: Proof) -> Arrays:
    """The arrays of a proof's certificate without its head."""
    field = proof.field
    arrays: Arrays = {"alpha": field.alpha, "beta": field.beta, "p": field.p}
    arrays |= {_PREFIX + name: array for name, array in instance_arrays(field.instance).items()}
    if proof.norm != 2:
        arrays |= _slopes(proof)
    if any(branch.pixel >= 0 for branch in proof.branches):
        arrays["branches"] = np.array(proof.branches, dtype=np.int32)
    for number, level in enumerate(proof.levels):
        arrays |= {f"level_{number}_{name}": array for name, array in _of_level(level).items()}
    return arrays


def _slopes(proof: Proof) -> Arrays:
    """The slopes of strokes, the multipliers by pairs and pixels, 0 for none, and the cuts by pixels."""
    instance, cuts = proof.levels[0].instance, np.array(proof.cuts, dtype=np.int32)
    n, m, s = instance.grid.size, len(instance.grid.first), len(instance.theta)
    slopes, multipliers = np.zeros(n), np.zeros((np.count_nonzero(cuts < 0), 2 * m + 2 * n))
    slopes[instance.stroke_index] = proof.levels[0].slopes
    if proof.multipliers is not None:
        found = np.atleast_2d(proof.multipliers)
        multipliers[:, : 2 * m] = found[:, : 2 * m]
        multipliers[:, 2 * m + instance.stroke_index] = found[:, 2 * m : 2 * m + s]
        multipliers[:, 2 * m + n :] = found[:, 2 * m + s :]
    arrays = {"slopes": slopes, "multipliers": multipliers.ravel()}
    if len(cuts) > 1:
        arrays["cuts"] = np.where(cuts < 0, -1, instance.stroke_index[cuts]).astype(np.int32)
    return arrays


def _of_level(level: LevelRecord) -> Arrays:
    ranges = (level.alpha_first, level.alpha_count, level.beta_first, level.beta_count)
    return {
        "h": np.array([level.h]),
        "alpha": level.alpha,
        "beta": level.beta,
        "ranges": np.stack(ranges, axis=1).astype(np.int32),
        "allowed": np.packbits(level.allowed),
        **level.messages,
        **level.tables,
    }


def certificate_effort(level: Lattice, quads: Indices) -> float:
    """The expected effort of checking and writing one level of a certificate, with clusters on those quads.

    The unit is a pixel of a level with few labels, whose check takes about 0.6 ms.
    """
    i, j = level.instance.grid.first, level.instance.grid.second
    rows, columns = level.alpha_count.astype(np.float64), level.beta_count.astype(np.float64)
    costs = float(rows[i] @ rows[j] + columns[i] @ columns[j])
    effort = _PIXEL * len(rows) + float(level.allowed_count.sum()) / _LABELS + costs / _COSTS
    effort += float(level.allowed_count[i] @ rows[j]) / _TERMS
    effort += _QUAD * len(quads) + float(table_sizes(level, quads).sum()) / _NUMBERS
    return _SPARE_TIME * effort


def checking_pace() -> float:
    """The expected seconds per unit of the checker's effort.

    The check of a tiny level, some 20 ms, shows them for this machine and its present load.
    """
    instance = Instance("pace", np.ones((6, 6), dtype=bool), np.array([[0, 0]]), np.zeros(1), np.ones(1))
    zero, pairs = np.zeros(instance.grid.size), np.zeros(len(instance.grid.first), dtype=np.int32)
    field = CrossField(instance, zero, zero, pairs)
    at = Lattice.whole(field, 16)
    shares = [np.zeros(at.share_starts(end)[-1]) for end in (instance.grid.first, instance.grid.second)]
    none = clusters_on(at, np.zeros(0, np.int64))
    numbers = messages_of(at, shares, 1.0, slice(0, len(pairs))), tables_of(at, none, 1.0)
    level = LevelRecord.on(at, numbers, bound=0.0, energy=0.0)
    proof = Proof(field, 0.0, 0.0, 0, (level,), 0.0, "time")
    arrays = _arrays(proof) | _head(proof)
    began = time.perf_counter()
    check_certificate.check(arrays, way=_quick_way())
    seconds = time.perf_counter() - began
    return seconds / (certificate_effort(at, none.quads) / _SPARE_TIME)
