"""A proof of a drawing's field in the background, with a line of progress every few passes."""

from __future__ import annotations

import re
import sys
from typing import Any, Final

from ...models.processes.child_program import is_stopped
from ...models.processes.limits import Limits
from .document import Document
from .session import compute_field

SECONDS: Final = 120.0  # of a proof
_LINE: Final = re.compile(r"energy ([-+.\deE]+), bound ([-+.\deE]+)")


def prove_step(data: bytes) -> dict[str, Any]:
    """Energy, bound and gap of a document's instance; progress is written to the standard output."""
    from ...models.proof.prove import prove

    _, field = compute_field(Document.from_bytes(data))
    proof = prove(
        field.instance,
        start=field,
        limits=Limits(SECONDS, gap=0.0, threads=1),
        jobs=1,
        progress=_print_progress,
        stop=is_stopped,
    )
    return {
        "stage": "proof",
        "done": True,
        "energy": proof.energy,
        "bound": proof.bound,
        "gap": proof.gap,
        "status": proof.status,
        "own": field.energy(2).total,
    }


def _print_progress(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def read_progress(text: str) -> dict[str, Any] | None:
    """Energy, bound and gap in the last line of progress with both, or None."""
    lines = _LINE.findall(text)
    if not lines:
        return None
    energy, bound = (max(float(value), 0.0) for value in lines[-1])
    gap = (energy - bound) / energy if energy else 0.0
    return {"stage": "proof", "done": False, "energy": energy, "bound": bound, "gap": gap}
