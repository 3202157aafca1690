"""The AMPL Solver Library, for .nl: Debian's gjh_asl_json, which tells what it reads as JSON.

It evaluates at the starting point of a file. A segment x at the end of a copy of the file is that point, and
outweighs an earlier one.
"""

from __future__ import annotations

import json
import re
import struct
from pathlib import Path
from typing import Any, Final

import numpy as np

from ....models.instance.grid import Floats
from .protocol import Refused, file_names, started
from .reading import Evaluation, Points

_TOLD: Final = 1e-5
"""It prints bounds with six digits."""


def version() -> str:
    """Its version, and that of the library."""
    said = started("asl", "-v")
    found = re.search(r"Version (\S+).*ASL\((\d+)\)", said.stdout + said.stderr)
    return f"{found[1]} (ASL {found[2]})" if found else "unknown"


def at_start(path: Path) -> dict[str, Any]:
    """What the library says of an .nl file, with values at its start; leaves a .json beside it."""
    done = started("asl", str(path.with_suffix("")), folder=path.parent)
    if done.returncode:
        words = (done.stdout + done.stderr).strip()[-200:]
        raise Refused(f"gjh_asl_json ends with code {done.returncode}: {words}")
    said: dict[str, Any] = json.loads(path.with_suffix(".json").read_text("utf-8"))
    return said


def with_start(data: bytes, point: Floats) -> bytes:
    """The bytes of an .nl file with that starting point, in the order of the file."""
    if data.startswith(b"b"):
        entries = b"".join(struct.pack("<id", place, value) for place, value in enumerate(point.tolist()))
        return data + b"x" + struct.pack("<i", len(point)) + entries
    lines = "".join(f"{place} {value!r}\n" for place, value in enumerate(point.tolist()))
    return data + f"x{len(point)}\n{lines}".encode()


def evaluate(path: Path, points: Points) -> Evaluation:
    """The .nl file as the library reads it; it does not tell which columns are integer, but counts them."""
    columns, rows = file_names(path)
    data, copy = path.read_bytes(), Path("point.nl").resolve()
    told: list[dict[str, Any]] = []
    for point in points.of(columns):
        copy.write_bytes(with_start(data, point))
        told.append(at_start(copy))
    lower, upper = _bounds(told[0]["variable bounds"], len(columns))
    row_lower, row_upper = _bounds(told[0].get("constraint bounds", {}), len(rows))
    values = [said["initial evaluations"] for said in told]
    return Evaluation(
        columns,
        lower,
        upper,
        None,
        rows,
        row_lower,
        row_upper,
        np.array([value["objective function"]["0"]["value"] for value in values]),
        np.array([[value["constraints"][str(row)] for row in range(len(rows))] for value in values]).reshape(
            len(values), len(rows)
        ),
        rounding=_TOLD,
        discrete=_discrete(told[0]["problem statistics"]),
    )


def _bounds(told: dict[str, list[float]], count: int) -> tuple[Floats, Floats]:
    ends = np.array([told[str(place)] for place in range(count)], dtype=float).reshape(count, 2)
    return ends[:, 0], ends[:, 1]


def _discrete(statistics: dict[str, Any]) -> int:
    """Number of binary and integer columns in the header's five groups."""
    return sum(
        value for key, value in statistics.items() if re.search(r"integer|binary", key) and "total" not in key
    )
