"""Certificates: the claims of a proof in a file that anyone can check without the code of the prover.

checkers/check_certificate.py reads what this module writes, in the same order and by the same names.
docs/files.md, "Layout of a certificate", describes the arrays. Equal proofs give equal bytes.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from ..array_archive import Arrays, pack_arrays
from ..errors import CrossfieldError, InputError, InstanceError, OutputError, SolverError, naming
from ..field.field import CrossField, Norm
from ..instance.file import instance_arrays, instance_of_arrays
from ..instance.instance import Instance
from ..processes.deadline import Progress, silent
from ..processes.job_counts import check_jobs
from ..processes.process_groups import are_interrupts_caught
from ..processes.process_pool import process_pool
from ..storage import read_bytes, require_suffix, write_bytes
from ..written_files import FORCE, check_targets, is_unchanged
from .checkers import check_certificate, check_orthogonal
from .checkers.check_certificate import ProvenClaim
from .descent.orthogonal_certificate import OrthogonalProof
from .descent.record import Claim, LevelRecord, Proof

REFUSALS: Final = (check_certificate.NotProvenError, check_certificate.UnreadableError)
"""Errors of the checker for a proof that does not hold."""

_PREFIX: Final = "instance_"
_FEW, _MANY = 400_000, 30_000_000
"""Labels of a proof whose check takes longer than to start processes, and 3 GB of memory."""


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
    proven
        Findings of the checker.

    """

    proven: ProvenClaim

    @property
    def norm(self) -> Norm:
        """The norm of the energy."""
        norm: Norm = self.proven.norm
        return norm

    @property
    def forced(self) -> int:
        """The number of pairs whose jump equals the field's in every field that could be better."""
        return self.proven.forced


def write_certificate(
    proof: Proof | OrthogonalProof, path: str | Path, *, force: bool = False
) -> Certificate:
    """Write the certificate of a proof, as far as the checker confirms it.

    The certificate may claim less than the proof. The same proof gives the same bytes.

    Parameters
    ----------
    proof
        The proof.
    path
        The file to write, with the suffix .npz.
    force
        Whether to replace a file that crossfield has not written or that has changed since, and a certificate
        of a higher bound for the same instance and norm.

    Returns
    -------
    Certificate
        What the file claims.

    Raises
    ------
    InputError
        For a proof that the checker refuses, and for another suffix.
    SolverError
        For a proof without levels.
    OutputError
        When the file cannot be written, or if another one is in the way.

    """
    path = Path(path)
    require_suffix(path, ".npz")
    check_targets(path.parent, [path.name], force=force)
    if not proof.levels:
        reason = proof.reason or "no level was completed"
        raise SolverError(f"is not written: nothing was proven, because {reason}", file=path)
    if isinstance(proof, OrthogonalProof):
        if proof.proven is None:
            raise InputError("would hold a proof that is not valid; prove it again", file=path)
        certificate = Certificate(proof.field, proof.energy, proof.bound, proof.proven)
        return _write_arrays(certificate, proof.certificate(), path, force=force)
    try:
        checked = proof if proof.proven is not None else check_proof(proof)
    except REFUSALS as error:
        raise InputError(f"would hold a proof that is not valid: {error}", file=path) from error
    except MemoryError as error:
        raise SolverError("is not written: its check takes more memory than there is", file=path) from error
    proven = cast("ProvenClaim", checked.proven)
    arrays = _head_arrays(checked) | _proof_arrays(checked) | cast("Arrays", checked.pieces)
    certificate = Certificate(checked.field, checked.energy, checked.bound, proven)
    return _write_arrays(certificate, arrays, path, force=force)


def _write_arrays(certificate: Certificate, arrays: Arrays, path: Path, *, force: bool) -> Certificate:
    """Write the arrays of a certificate, unless an earlier one has a higher bound; return it."""
    earlier = None if force else earlier_bound(path, certificate.field.instance, certificate.norm)
    if earlier is not None and earlier > certificate.bound:
        raise OutputError(
            f"has a proof of a higher bound ({earlier:.6g}, now {certificate.bound:.6g}); choose another "
            f"name, or replace it with {FORCE}",
            file=path,
        )
    write_bytes(path, pack_arrays(arrays), force=force)
    return certificate


def earlier_bound(path: Path, on: Instance, norm: Norm = 2) -> float | None:
    """The bound for an instance in a norm that a certificate in a file proves.

    It was checked when it was written. None without a certificate that crossfield wrote and nobody changed,
    and for another instance or norm.
    """
    if not is_unchanged(path):
        return None
    try:
        arrays = check_certificate.unpack_archive(read_bytes(path, check_certificate.MOST_BYTES))
        head = check_certificate.refuse_damage(check_certificate.json_of)(arrays, "head")
        is_same = _field_of(arrays).instance.sha256 == on.sha256 and head.get("norm", 2) == norm
    except (CrossfieldError, *REFUSALS):
        return None
    return float(head["bound"]) if is_same else None


def check_proof(proof: Proof, jobs: int = 1, progress: Progress = silent) -> Proof:
    """The proof with the checker's findings, and with the bound and the forced jumps that it confirms.

    After Ctrl-C, the proof has only the levels that are checked. KeyboardInterrupt is raised without any, and
    in a block that catches Ctrl-C itself. Last levels whose check takes more memory than a reader grants are
    left out.

    jobs: as of `read_certificate`. Raises one of `REFUSALS` for a proof that does not hold, and WorkerError
    when a process dies.
    """
    while not _takes_memory_of_file(proof) and len(proof.levels) > 1:
        proof = replace(proof, levels=proof.levels[:-1], bound=0.0, forced=0, ended="labels", pieces=None)
    arrays = _head_arrays(replace(proof, bound=0.0)) | _proof_arrays(proof)
    closed = proof.status == "optimal" or proof.forced == len(proof.levels[0].p)
    has_pieces = proof.pieces is not None or closed
    with _pass_function(arrays, jobs, silent) as pass_all:

        def pass_until_interrupted(work: Any, tasks: list[Any]) -> list[Any]:
            passes = list[Any]()
            try:
                for level_pass in pass_all(work, tasks):
                    passes.append(level_pass)  # before the report, which Ctrl-C may interrupt
                    progress(f"checked {len(passes)} of {len(tasks)} levels")
            except KeyboardInterrupt:
                if not passes or are_interrupts_caught():
                    raise
            return passes

        passed = check_certificate.pass_levels(arrays, pass_until_interrupted, has_pieces=has_pieces)
    if len(passed.bounds) < len(proof.levels):
        proof = replace(proof, levels=proof.levels[: len(passed.bounds)], ended="interrupted", pieces=None)
        arrays = _head_arrays(replace(proof, bound=0.0)) | _proof_arrays(proof)
        pieces = _whole_piece(passed)
    else:
        pieces = _last_step_arrays(proof, passed, has_pieces=has_pieces)
    proven = check_certificate.check_last_step(arrays | pieces, passed)
    ended = "optimal" if proven.status == "optimal" else proof.ended
    checked = replace(proof, bound=proven.bound, forced=proven.forced, ended=ended, pieces=pieces)
    object.__setattr__(checked, "proven", proven)
    return checked


def _takes_memory_of_file(proof: Proof) -> bool:
    """Whether the check of a proof takes at most the memory that its certificate may take."""
    arrays = _head_arrays(proof) | _proof_arrays(proof)
    for pack in (False, True):  # packing takes long, and a small level fits without
        with suppress(check_certificate.UnreadableError):
            check_certificate.check_memory(arrays, len(pack_arrays(arrays)) if pack else 0)
            return True
    return False


@contextmanager
def _pass_function(arrays: Arrays, jobs: int, progress: Progress) -> Iterator[Callable[..., Iterator[Any]]]:
    """A function that does the passes over all levels as the checker asks for, and says how many are done."""
    levels = [array for name, array in arrays.items() if name.endswith("_allowed")]
    labels = 8 * sum(array.size for array in levels)
    processes = min(jobs, len(levels)) if _FEW <= labels <= _MANY else 1
    with process_pool(processes) as pool:

        def pass_all(work: Callable[..., Any], tasks: list[Any]) -> Iterator[Any]:
            passes = map(work, tasks) if processes == 1 else pool.map(work, tasks)
            for number, level_pass in enumerate(passes, 1):
                progress(f"checked {number} of {len(tasks)} levels")
                yield level_pass

        yield pass_all


def _head_arrays(proof: Proof) -> Arrays:
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


def _proof_arrays(proof: Proof) -> Arrays:
    """The arrays of a proof's certificate without its head and the pieces of the last steps."""
    field, first = proof.field, proof.levels[0]
    arrays = {_PREFIX + name: array for name, array in instance_arrays(field.instance).items()}
    arrays |= {"alpha": field.alpha, "beta": field.beta, "p": field.p}
    arrays |= {"centre_alpha": first.alpha, "centre_beta": first.beta}
    if proof.norm != 2:
        slopes = np.zeros(first.instance.grid.size)
        slopes[first.instance.stroke_index] = first.slopes
        arrays["slopes"] = slopes
    for number, level in enumerate(proof.levels):
        arrays |= {f"level_{number}_{name}": array for name, array in _level_arrays(level).items()}
    return arrays


def _level_arrays(level: LevelRecord) -> Arrays:
    ranges = (level.alpha_first, level.alpha_count, level.beta_first, level.beta_count)
    return {
        "h": np.array([level.h]),
        "ranges": np.stack(ranges, axis=1).astype(np.int32),
        "allowed": np.packbits(level.allowed),
        **level.shares,
        **level.tables,
    }


def _whole_piece(passed: check_certificate.PassedLevels) -> Arrays:
    """A last step that proves nothing: because there is one, the checker gives the last level its combs."""
    size = 2 * (len(passed.terms.first) + len(passed.terms.white))
    return {"cuts": np.array([-1], np.int32), "multipliers": np.zeros((1, size))}


def _last_step_arrays(proof: Proof, passed: check_certificate.PassedLevels, *, has_pieces: bool) -> Arrays:
    """The cuts and the multipliers of the last step; none unless it has pieces.

    The prover's boxes are a little larger than the checker's, so its pieces cover these as a rule.
    """
    from .descent.last_step import fit_to_boxes, minimise_on_boxes  # loads solvers

    terms, last, size = passed.terms, passed.last, 2 * (len(passed.terms.first) + len(passed.terms.white))
    if last is None or not has_pieces:
        return {"cuts": np.zeros(0, np.int32), "multipliers": np.zeros((0, size))}
    instance = proof.levels[0].instance
    if proof.pieces is not None:
        with suppress(check_certificate.NotProvenError):
            return fit_to_boxes(instance, terms, last, proof.pieces, proof.bound)
    return minimise_on_boxes(instance, terms, last, proof.energy).pieces


def read_certificate(
    path: str | Path, *, on: Instance | None = None, jobs: int = 1, progress: Progress = silent
) -> Certificate:
    """Read and check a certificate.

    Field, instance, energy, bound and status come from the arrays that the checker has checked.

    Parameters
    ----------
    path
        The file.
    on
        The instance that the field must be on, if given.
    jobs
        Number of processes that share the levels of crosses of any angle, where that saves time and takes
        less than 3 GB.
    progress
        Receives a line of text after each of these levels.

    Returns
    -------
    Certificate
        The claim, which holds.

    Raises
    ------
    InputError
        For an unreadable file, another instance, a claim that does not hold, and too few or too many jobs.
    InstanceError
        For a field or an instance that breaks its rules.
    CrossfieldError
        When a process dies.

    """
    path = Path(path)
    check_jobs(jobs)
    try:
        data = read_bytes(path, check_certificate.MOST_BYTES)
        field, bound, proven = _check_any(data, path, jobs, progress)
        if on is not None and field.instance.sha256 != on.sha256:
            gauge = on.with_gauge("strokes").sha256 == field.instance.sha256
            remedy = "; choose the gauge strokes: crossfield instance --gauge strokes" if gauge else ""
            raise InputError(
                f"is a certificate of another instance ({field.instance.summary}), "
                f"not of {on.summary}{remedy}",
                file=path,
            )
    except check_certificate.NotProvenError as error:
        raise InputError(f"is refused as a certificate: {error}", file=path) from error
    except check_certificate.UnreadableError as error:
        raise InputError(f"is not a certificate: {error}", file=path) from error
    except MemoryError as error:
        raise InputError("takes more memory to check than there is", file=path) from error
    return Certificate(field, field.energy(proven.norm).total, bound, proven)


def _check_any(
    data: bytes, path: Path, jobs: int, progress: Progress
) -> tuple[CrossField, float, ProvenClaim]:
    """Field, claimed bound and findings of the checker, for either kind of crosses."""
    arrays = check_certificate.unpack_archive(data)
    head = check_certificate.refuse_damage(check_certificate.json_of)(arrays, "head")
    if head.get("format") == check_orthogonal.FORMAT:
        memory = check_certificate.memory_for(len(data), check_orthogonal.MORE_ROOM)
        proven: ProvenClaim = check_orthogonal.check_arrays(arrays, memory=memory)
    else:
        check_certificate.check_sizes(arrays, len(data))
        with _pass_function(arrays, jobs, progress) as pass_all:
            proven = check_certificate.check_arrays(arrays, pass_all)
    with naming(path):
        return _field_of(arrays), head["bound"], proven


def _field_of(arrays: Arrays) -> CrossField:
    """The field of a certificate; its instance must not round the arrays, which alone are proven."""
    parts = {name: array for name, array in arrays.items() if name.startswith(_PREFIX)}
    instance = instance_of_arrays({name.removeprefix(_PREFIX): array for name, array in parts.items()})
    field = CrossField(
        instance, arrays["alpha"], arrays.get("beta", np.zeros(instance.domain.size)), arrays["p"]
    )
    written = {_PREFIX + name: array for name, array in instance_arrays(instance).items()}
    if instance.domain.kappa is not None:
        parts["kappa"], written["kappa"] = arrays["kappa"], instance.domain.kappa
    for name, array in parts.items():
        if name not in written or not np.array_equal(array, written[name]):
            raise InstanceError(f"array {name!r} is not as crossfield writes it; prove it again")
    return field
