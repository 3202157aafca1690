"""Compilation of the functions of proofs, once per machine, in a child process that can be stopped.

Two such processes wait for each other, and the second finds everything compiled.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from filelock import FileLock

from ...models.errors import CrossfieldError, SolverError
from ...models.processes.child import Child, KilledError
from ...models.processes.control import WorkerError
from ...models.processes.deadline import Clock, Over, Progress, never
from ...models.storage import make_folder


@contextmanager
def compiling() -> Iterator[None]:
    """Compile the functions of proofs in the background, unless they are; stop at the end of the context."""
    if is_compiled():
        yield
        return
    with Child() as child:
        threading.Thread(target=_compile_in, args=(child,), daemon=True).start()
        yield


def _compile_in(child: Child) -> None:
    with suppress(CrossfieldError):  # the child was ended, or fails again when a proof needs the functions
        child.call(compile_all)


def compile_proofs(
    folder: Path, progress: Progress, stop: Over = never, clock: Clock = time.monotonic
) -> float:
    """Compile the functions of proofs unless they are; return the seconds that it took, 0 if they are.

    It takes up to a minute, and no time limit includes it. folder: where the output is kept if the work
    fails. progress: receives a line if there is something to compile. stop: returns whether to stop; what is
    compiled by then stays. clock: measures the seconds. Raises KeyboardInterrupt when `stop` or Ctrl-C stops
    the work, and SolverError when the work fails.
    """
    if is_compiled():
        return 0.0
    begin = clock()
    progress("compiling the functions of proofs, once on this machine, before the time limit begins")
    log = make_folder(folder) / "compiling.log"
    try:
        with Child() as child:
            child.call(compile_all, log=log, stop=stop)
    except (KilledError, KeyboardInterrupt) as error:
        log.unlink(missing_ok=True)
        raise KeyboardInterrupt from error
    except WorkerError as error:
        raise SolverError(f"the functions of proofs were not compiled: {error}", file=log) from error
    log.unlink(missing_ok=True)
    return clock() - begin


def is_compiled() -> bool:
    """Whether the functions of proofs are compiled."""
    from ...models.processes.compiled import all_compiled
    from ...models.proof import prove  # noqa: F401 - it imports all of them

    return all_compiled()


def compile_all() -> None:
    """Compile the functions of proofs, by the certificate of a few pixels and by a pass with a cluster."""
    from ...models.processes.compiled import crew, place
    from ...models.proof.certificate import write_certificate
    from ...models.proof.dual import Dual
    from ...models.proof.lattice import Lattice
    from ...models.proof.prove import prove
    from ...models.sketch.samples import sample

    if is_compiled():
        return
    with FileLock(place() / "compiling.lock"):
        if is_compiled():
            return
        proof = prove(sample("mouse", 4))
        with crew(1) as hands:
            dual = Dual(Lattice.whole(proof.field, 2), hands)
            dual.add_clusters(1, proof.field)
            dual.ascend(1)
        with TemporaryDirectory() as folder:
            write_certificate(proof, Path(folder) / "certificate.npz")
