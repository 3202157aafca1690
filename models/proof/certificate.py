"""Certificates: the claims of a proof in a file that anyone can check without the code of the prover.

checkers/check_certificate.py reads what this module writes, in the same order and by the same names.
docs/files.md, "Layout of a certificate", describes the arrays. Equal proofs give equal bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..array_archive import Arrays, pack_arrays
from ..errors import CrossfieldError, InputError, InstanceError, OutputError, SolverError, naming
from ..field.field import CrossField, Norm
from ..instance.domain import Floats
from ..instance.file import instance_arrays, instance_of_arrays
from ..instance.instance import Instance
from ..processes.deadline import Progress, silent
from ..processes.job_counts import check_jobs
from ..processes.process_groups import are_interrupts_caught
from ..processes.process_pool import process_pool
from ..search.stroked_parts import stroked_parts
from ..storage import read_bytes, require_suffix, write_bytes
from ..written_files import FORCE, check_targets, is_unchanged
from .checkers import check_certificate, check_orthogonal
from .descent.record import INSTANCE, Claim, Proof

REFUSALS: Final = (check_certificate.NotProvenError, check_certificate.UnreadableError)
"""Errors of the checker for a proof that does not hold."""

_FEW_LABELS, _MANY_LABELS = 400_000, 30_000_000
"""Labels of a proof whose check takes longer than to start processes, and 3 GB of memory."""


def write_certificate(proof: Proof, path: str | Path, *, force: bool = False) -> Claim:
    """Write the certificate of a proof, as far as the checker confirms it, and return what it claims.

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

    Raises
    ------
    InputError
        For a proof that the checker refuses, and for another suffix.
    SolverError
        For a proof without a bound.
    OutputError
        When the file cannot be written, or if another one is in the way.

    """
    path = Path(path)
    require_suffix(path, ".npz")
    check_targets(path.parent, [path.name], force=force)
    if not proof.has_bound:
        reason = proof.reason or "no level was completed"
        raise SolverError(f"is not written: nothing was proven, because {reason}", file=path)
    try:
        checked = proof if proof.proven is not None else check_proof(proof)
    except REFUSALS as error:
        raise InputError(f"would hold a proof that is not valid: {error}", file=path) from error
    except MemoryError as error:
        raise SolverError("is not written: its check takes more memory than there is", file=path) from error
    earlier = None if force else earlier_bound(path, checked.field.instance, checked.norm)
    if earlier is not None and earlier > checked.bound:
        raise OutputError(
            f"has a proof of a higher bound ({earlier:.6g}, now {checked.bound:.6g}); choose another "
            f"name, or replace it with {FORCE}",
            file=path,
        )
    write_bytes(path, pack_arrays(checked.certificate()), force=force)
    return checked


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


def check_proof(
    proof: Proof, jobs: int = 1, progress: Progress = silent, limit: Floats | None = None
) -> Proof:
    """The proof with the checker's findings, and with the bound and the forced jumps that it confirms.

    After Ctrl-C, the proof has only the levels that are checked. KeyboardInterrupt is raised without any, and
    in a block that catches Ctrl-C itself. Last levels whose check takes more memory than a reader grants are
    left out.

    jobs: as of `read_certificate`. limit: of Lemma 1 of orthogonal crosses, where it is known. Raises one of
    `REFUSALS` for a proof that does not hold, and WorkerError when a process dies.
    """
    if proof.field.instance.orthogonal:
        return _confirm(proof, _check_orthogonal(proof, limit))
    while not _takes_memory_of_file(proof) and len(proof.levels) > 1:
        proof = proof.with_levels(len(proof.levels) - 1, "labels")
    arrays, part = replace(proof, bound=0.0).certificate(), stroked_parts(proof.field.instance)
    closed = proof.status == "optimal" or proof.forced == len(part.grid.first)
    has_pieces = "cuts" in arrays or closed
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
        proof = proof.with_levels(len(passed.bounds), "interrupted")
        pieces = _whole_piece(passed)
    else:
        pieces = _last_step_arrays(proof, part, passed, has_pieces=has_pieces)
    proof = replace(proof, bound=0.0, arrays=proof.arrays | pieces)
    return _confirm(proof, check_certificate.check_last_step(proof.certificate(), passed))


def _check_orthogonal(proof: Proof, limit: Floats | None) -> check_certificate.Findings:
    arrays = replace(proof, bound=0.0).certificate()
    memory = check_certificate.memory_for(len(pack_arrays(arrays)), check_orthogonal.MORE_ROOM)
    findings: check_certificate.Findings = check_orthogonal.check_arrays(arrays, limit, memory)
    return findings


def _confirm(proof: Proof, proven: check_certificate.Findings) -> Proof:
    """The proof with what the checker confirms."""
    ended = "optimal" if proven.status == "optimal" else proof.ended
    return proof.confirmed(proven, bound=proven.bound, ended=ended)


def _takes_memory_of_file(proof: Proof) -> bool:
    """Whether the check of a proof takes at most the memory that its certificate may take."""
    arrays = proof.certificate()
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
    processes = min(jobs, len(levels)) if _FEW_LABELS <= labels <= _MANY_LABELS else 1
    with process_pool(processes) as pool:

        def pass_all(work: Callable[..., Any], tasks: list[Any]) -> Iterator[Any]:
            passes = map(work, tasks) if processes == 1 else pool.map(work, tasks)
            for number, level_pass in enumerate(passes, 1):
                progress(f"checked {number} of {len(tasks)} levels")
                yield level_pass

        yield pass_all


def _whole_piece(passed: check_certificate.PassedLevels) -> Arrays:
    """A last step that proves nothing: because there is one, the checker gives the last level its combs."""
    size = 2 * (len(passed.terms.first) + len(passed.terms.white))
    return {"cuts": np.array([-1], np.int32), "multipliers": np.zeros((1, size))}


def _last_step_arrays(
    proof: Proof, part: Instance, passed: check_certificate.PassedLevels, *, has_pieces: bool
) -> Arrays:
    """The cuts and the multipliers of the last step; none unless it has pieces.

    The prover's boxes are a little larger than the checker's, so its pieces cover these as a rule.

    part: the instance on the parts of its mask that have a stroke.
    """
    from .descent.last_step import fit_to_boxes, minimise_on_boxes  # loads solvers

    terms, last, size = passed.terms, passed.last, 2 * (len(passed.terms.first) + len(passed.terms.white))
    if last is None or not has_pieces:
        return {"cuts": np.zeros(0, np.int32), "multipliers": np.zeros((0, size))}
    if "cuts" in proof.arrays:
        with suppress(check_certificate.NotProvenError):
            return fit_to_boxes(part, terms, last, proof.arrays, proof.bound)
    return minimise_on_boxes(part, terms, last, proof.energy).pieces


def read_certificate(
    path: str | Path, *, on: Instance | None = None, jobs: int = 1, progress: Progress = silent
) -> Claim:
    """Read and check a certificate, and return its claim, which holds.

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
    energy = field.energy(proven.norm).total
    return Claim(field, energy, bound, proven.forced, proven.norm).confirmed(proven)


def _check_any(
    data: bytes, path: Path, jobs: int, progress: Progress
) -> tuple[CrossField, float, check_certificate.Findings]:
    """Field, claimed bound and findings of the checker, for either kind of crosses."""
    arrays = check_certificate.unpack_archive(data)
    head = check_certificate.refuse_damage(check_certificate.json_of)(arrays, "head")
    if head.get("format") == check_orthogonal.FORMAT:
        memory = check_certificate.memory_for(len(data), check_orthogonal.MORE_ROOM)
        proven: check_certificate.Findings = check_orthogonal.check_arrays(arrays, memory=memory)
    else:
        check_certificate.check_sizes(arrays, len(data))
        with _pass_function(arrays, jobs, progress) as pass_all:
            proven = check_certificate.check_arrays(arrays, pass_all)
    with naming(path):
        return _field_of(arrays), head["bound"], proven


def _field_of(arrays: Arrays) -> CrossField:
    """The field of a certificate; its instance must not round the arrays, which alone are proven."""
    parts = {name: array for name, array in arrays.items() if name.startswith(INSTANCE)}
    instance = instance_of_arrays({name.removeprefix(INSTANCE): array for name, array in parts.items()})
    field = CrossField(
        instance, arrays["alpha"], arrays.get("beta", np.zeros(instance.domain.size)), arrays["p"]
    )
    written = {INSTANCE + name: array for name, array in instance_arrays(instance).items()}
    if instance.domain.kappa is not None:
        parts["kappa"], written["kappa"] = arrays["kappa"], instance.domain.kappa
    for name, array in parts.items():
        if name not in written or not np.array_equal(array, written[name]):
            raise InstanceError(f"array {name!r} is not as crossfield writes it; prove it again")
    return field
