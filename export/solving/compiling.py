"""What proofs need is compiled once on a machine, in a process of its own that a deadline can cut off."""

from __future__ import annotations

import sys
from pathlib import Path

from ...models.errors import SolverError
from ...models.processes.deadline import Deadline
from ...models.storage import make_folder
from .child import run_child


def compile_proofs(folder: Path, deadline: Deadline) -> None:
    """Nothing, once the functions of proofs are compiled; what is done stays where it is cut off.

    It takes some 15 s. Raises SolverError where they are not by the deadline.
    """
    log = make_folder(folder) / "compiling.log"
    ended = run_child([sys.executable, "-P", "-m", __spec__.name], log, deadline)
    if ended.interrupted:
        raise KeyboardInterrupt
    if ended.code != 0:
        reason = "what proofs compile, once on a machine, was not ready in the time; it goes on from there"
        raise SolverError(f"{reason} the next time (or see the log)", file=log)


def main() -> None:
    """Compile, by a proof of a few pixels."""
    from ...models.proof.prove import prove
    from ...models.sketch.samples import sample

    prove(sample("mouse", 4))


if __name__ == "__main__":
    main()
