"""Citation and licences of a library, as its specification states them for each sketch.

The paper is cited by its title alone, because nothing else about it is certain.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from ..plan.spec import Sketch

LICENCES: Final = (
    "CC0-1.0",
    *(f"CC-{kind}-4.0" for kind in ("BY", "BY-SA", "BY-NC", "BY-ND", "BY-NC-SA", "BY-NC-ND")),
    "MIT",
)
"""SPDX identifiers of known licences."""

PAPER: Final = (
    "Extrapolating curvature lines in rough concept sketches using mixed-integer nonlinear optimization"
)
REFERENCES: Final = (
    f"{PAPER}: the formulations, whose equation numbers are in the names of the rows",
    (
        "E. Iarussi, D. Bommes and A. Bousseau: BendFields: Regularized curvature fields from rough concept "
        "sketches, ACM Transactions on Graphics 34 (2015), no. 3, 24:1-24:16, doi:10.1145/2710026: "
        "the problem"
    ),
)


def licence_terms(sketches: Sequence[Sketch]) -> dict[str, Any]:
    """Return the licences of sketches for the texts of a library.

    licence: the known licence of all sketches, or empty; known: identifiers of all known licences; lines:
    one per sketch with its origin.
    """
    stated = list(dict.fromkeys(sketch.origin.get("license", "") for sketch in sketches))
    known = [licence for licence in stated if licence in LICENCES]
    licence = known[0] if len(stated) == len(known) == 1 else ""
    return {"licence": licence, "known": known, "lines": list(map(_line, sketches))}


def _line(sketch: Sketch) -> str:
    licence = sketch.origin.get("license", "no licence is stated; ask its author before you share it")
    others = [f"{key}: {sketch.origin[key]}" for key in ("author", "source") if key in sketch.origin]
    return f"{sketch.name}: {'; '.join([licence, *others])}"
