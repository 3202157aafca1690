"""Proofs: a field, and a lower bound of the energy of all fields."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

from ..arguments import check_count
from ..errors import InputError
from ..field.field import CrossField, Norm, check_norm
from ..instance.instance import Instance
from ..processes.blas_threads import one_thread
from ..processes.child_program import WorkerError
from ..processes.compilation import crew
from ..processes.deadline import Deadline, Progress, Stop, silent, stop_function
from ..processes.job_counts import check_jobs
from ..processes.limits import Limits
from ..processes.process_groups import are_interrupts_caught, catch_interrupts
from ..search.stroked_parts import extended, restricted, stroked_parts
from .certificate import REFUSALS, check_proof
from .compiling import compile_proofs
from .descent.absolute_descent import AbsoluteDescent
from .descent.descent import Descent, Termination
from .descent.orthogonal import prove_orthogonal
from .descent.record import Proof


@one_thread()
def prove(
    instance: Instance,
    *,
    norm: Norm = 2,
    start: CrossField | None = None,
    limits: Limits | None = None,
    work: int | None = None,
    seed: int = 0,
    jobs: int = 2,
    progress: Progress = silent,
    stop: Stop | None = None,
) -> Proof:
    """Find a field of low energy, and prove a lower bound of the energy of all fields.

    The proof of an instance in the gauge `box`, with its field, is that of the same sketch in the gauge
    `strokes`. The bound holds for both gauges, because every field in `box` has a field in `strokes` of at
    most its energy. Without a time limit the same arguments give the same proof, for any number of threads.
    Ctrl-C ends the proof with its best field and bound, and its check with the levels checked by then. The
    first proof on a machine compiles its functions before the time limit begins, in up to a minute.

    Orthogonal crosses, on any domain, have a proof of their own, on one thread. It has the same properties.
    With a time limit, a level is begun only if its check is expected to end in time. On surfaces with few
    strokes, charges give a first bound in about half of the time at most, or in all of it if they prove 80 %
    then. Up to 6,000 points without such a bound, the coarsest level is completed under any time limit,
    so there is a certificate.

    The checker of certificates checks the levels at the end, after the time limit; for orthogonal crosses
    within it. Bound, status and forced jumps are those that it confirms, and `write_certificate` writes them.

    Parameters
    ----------
    instance
        The instance.
    norm
        2; 1 for absolute values, which `milp-mccormick` minimises; or `mixed` for absolute values of the
        smoothness and squares of stroke and skew terms, which `miqp-mccormick` minimises.
    start
        A field to begin with where, improved, it is lower than the first field.
    limits
        Time limit of the proof without its check, relative gap at which to end (0 asks for optimality), and
        threads (0: as many as `jobs`). If the limit ends the first level, `levels` is empty, and the bound is
        that of charges, or 0. None: no time limit, and a gap of 0.
    work
        Number of labels, counted at each rounding, after which to end: a limit that no clock decides.
    seed
        Seed of the searches for better fields.
    jobs
        Number of processes of these searches, and of the check of many labels.
    progress
        Receives a line of text every few passes.
    stop
        A function that returns whether to stop, or an event. The proof so far is then returned.

    Returns
    -------
    Proof
        The field, its energy, the bound, and the levels that prove it.

    Raises
    ------
    InputError
        For another norm, one other than 2 where crosses are orthogonal, weights of pairs where they are
        not, and for too few or too many jobs or threads.
    InstanceError
        For a start on another instance, and where no field is found that has the prescribed indices.
    SolverError
        When the functions of proofs cannot be compiled.

    """
    check_norm(norm)
    if instance.orthogonal and norm != 2:
        raise InputError(f"orthogonal crosses have proofs in the norm 2 only, not {norm!r}; leave it out")
    if instance.pair_weights is not None and not instance.orthogonal:
        raise InputError(
            f"{instance.name} has weights of pairs, which proofs cover for orthogonal crosses only; "
            "leave pair_weights out, or make the instance orthogonal"
        )
    check_count("seed", seed)
    if work is not None:
        check_count("work", work, 1)
    instance = instance.with_gauge("strokes")
    start = None if start is None else start.on_instance(instance)
    check_jobs(jobs)
    chosen, asked = limits or Limits(math.inf, gap=0.0), stop_function(stop)
    with catch_interrupts() as interrupted, crew(chosen.threads or jobs) as threads:

        def is_over() -> bool:
            return interrupted() or asked()

        end = chosen.deadline()
        seconds = end.left()
        compile_proofs(progress, is_over, orthogonal=instance.orthogonal)
        began = time.monotonic()
        ends = Termination(Deadline.after(seconds, end.clock), is_over, chosen.gap, work or math.inf)
        if instance.orthogonal:
            proven, limit = prove_orthogonal(instance, start, ends, progress, seed)
            return _checked_proof(proven, lambda: check_proof(proven, limit=limit), progress)
        part = stroked_parts(instance)
        start = None if start is None else restricted(start, part)
        kind = Descent if norm == 2 else AbsoluteDescent
        first = kind.first_field(part, norm, start, ends.is_over)
        descent = kind(norm, part, first, ends, threads, seed, jobs, progress)
        proof = descent.proof(0.0, descent.run())
    field = extended(proof.field, instance)
    energy = field.energy(norm).total
    proof = replace(proof, field=field, energy=energy, seconds=time.monotonic() - began)
    return _checked_proof(proof, lambda: check_proof(proof, chosen.threads or jobs, progress), progress)


def _checked_proof(proof: Proof, check: Callable[[], Proof], progress: Progress) -> Proof:
    """The part of a proof that a check confirms: no level, with the reason, where it fails."""
    if not proof.has_bound:
        return proof
    ended, reason = proof.ended, ""
    try:
        progress("checking the levels")
        return check()
    except KeyboardInterrupt:
        if are_interrupts_caught():
            raise
        ended = "interrupted"
    except MemoryError:
        reason = "the check of its levels takes more memory than there is"
    except (*REFUSALS, WorkerError) as error:
        reason = f"the check of its levels failed: {error}"
    return replace(proof, bound=0.0, forced=0, levels=(), arrays={}, ended=ended, reason=reason)
