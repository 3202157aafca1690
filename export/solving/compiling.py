"""What proofs need is compiled once on a machine, in a process of its own that a deadline can cut off.

Two such processes wait for one another, and the second finds all done.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from filelock import FileLock

from ...models.errors import SolverError
from ...models.processes.deadline import Deadline
from ...models.processes.groups import kill, start
from ...models.storage import make_folder
from .child import run_child

_COMMAND: Final = [sys.executable, "-P", "-m", __spec__.name]


@contextmanager
def compiling() -> Iterator[None]:
    """What is done meanwhile, while all is compiled in the background unless it is."""
    if is_compiled():
        yield
        return
    none = subprocess.DEVNULL
    # Ctrl-C is for its parent, which ends it.
    with start(_COMMAND, stdin=none, stdout=none, stderr=none) as child:
        try:
            yield
        finally:
            kill(child)


def compile_proofs(folder: Path, deadline: Deadline) -> None:
    """Nothing, once the functions of proofs are compiled; what is done stays where it is cut off.

    It takes some 10 s. Raises SolverError where they are not by the deadline.
    """
    log = make_folder(folder) / "compiling.log"
    ended = run_child(_COMMAND, log, deadline)
    if ended.interrupted:
        raise KeyboardInterrupt
    if ended.code != 0:
        reason = "what proofs compile, once on a machine, was not ready in the time; it goes on from there"
        raise SolverError(f"{reason} the next time (or see the log)", file=log)


def is_compiled() -> bool:
    """Whether all functions of proofs are compiled."""
    from ...models.processes.compiled import all_compiled
    from ...models.proof import prove  # noqa: F401 - with it all of them are imported

    return all_compiled()


def main() -> None:
    """Compile, by a proof of a few pixels."""
    from ...models.processes.compiled import place
    from ...models.proof.prove import prove
    from ...models.sketch.samples import sample

    if is_compiled():
        return
    with FileLock(place() / "compiling.lock"):
        if not is_compiled():
            prove(sample("mouse", 4))


if __name__ == "__main__":
    main()
