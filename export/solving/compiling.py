"""Compilation of the functions of proofs, once per machine, in a child process that a deadline can cut off.

Two such processes wait for each other, and the second finds everything compiled.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock

from ...models.errors import CrossfieldError, SolverError
from ...models.processes.child import Child, KilledError
from ...models.processes.control import WorkerError
from ...models.processes.deadline import Deadline
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
        child.call(compile_clusters)


def compile_proofs(folder: Path, deadline: Deadline) -> None:
    """Compile the functions of proofs unless they are; finished ones stay when the deadline cuts it off.

    It takes some 10 s. Raises SolverError when they are not compiled by the deadline.
    """
    log = make_folder(folder) / "compiling.log"
    try:
        with Child() as child:
            child.call(compile_all, deadline=deadline, log=log)
    except WorkerError as error:
        if isinstance(error, KilledError) and error.interrupted:
            raise KeyboardInterrupt from error
        if isinstance(error, KilledError):
            raise SolverError(
                "the functions of proofs are compiled once per machine, and the time limit ended this; run "
                "it again to continue, or raise --time-limit"
            ) from error
        raise SolverError(f"the functions of proofs were not compiled: {error}", file=log) from error


def is_compiled() -> bool:
    """Whether all functions of proofs are compiled."""
    from ...models.processes.compiled import all_compiled
    from ...models.proof import prove  # noqa: F401 - it imports all of them

    return all_compiled()


def compile_clusters() -> None:
    """Compile the functions that only proofs with clusters call."""
    from ...models.processes.compiled import crew
    from ...models.proof.dual import Dual
    from ...models.proof.lattice import Lattice
    from ...models.search.greedy import greedy_field
    from ...models.sketch.samples import sample

    with crew(1) as hands:
        field = greedy_field(sample("mouse", 4))
        dual = Dual(Lattice.whole(field, 2), hands)
        dual.add_clusters(1, field)
        dual.ascend(1)


def compile_all() -> None:
    """Compile the functions that all proofs call, by a proof of a few pixels."""
    from ...models.processes.compiled import place
    from ...models.proof.prove import prove
    from ...models.sketch.samples import sample

    if is_compiled():
        return
    with FileLock(place() / "compiling.lock"):
        if not is_compiled():
            prove(sample("mouse", 4))
