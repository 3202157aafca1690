"""The AMPL Solver Library, for .nl: Debian's gjh_asl_json, which reports what it reads as JSON.

It evaluates at the starting point of a file. A segment x at the end of a copy of the file is that point, and
overrides an earlier one.
"""

from __future__ import annotations

import json
import re
import struct
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...models.instance.grid import Floats
from .model_content import Behaviour, Points
from .protocol import file_names, run_program

_ACCURACY: Final = 1e-5
"""Relative accuracy of its bounds, which it prints with six digits."""


def version() -> str:
    """Its version, and the library's."""
    stated = re.search(r"Version (\S+).*ASL\((\d+)\)", run_program("gjh_asl_json", "-v"))
    return f"{stated[1]} (ASL {stated[2]})" if stated else "unknown"


def report_at_start(path: Path) -> dict[str, Any]:
    """The library's report about an .nl file, with values at its start; writes a .json next to the file."""
    run_program("gjh_asl_json", str(path.with_suffix("")), folder=path.parent)
    report: dict[str, Any] = json.loads(path.with_suffix(".json").read_text("utf-8"))
    return report


def add_start(data: bytes, point: Floats) -> bytes:
    """The bytes of an .nl file with that starting point, in the order of the file."""
    if data.startswith(b"b"):
        entries = b"".join(struct.pack("<id", place, value) for place, value in enumerate(point.tolist()))
        return data + b"x" + struct.pack("<i", len(point)) + entries
    lines = "".join(f"{place} {value!r}\n" for place, value in enumerate(point.tolist()))
    return data + f"x{len(point)}\n{lines}".encode()


def evaluate(path: Path, points: Points) -> Behaviour:
    """The .nl file as the library reads it; it reports how many columns are integer, but not which."""
    columns, rows = file_names(path)
    data, copy = path.read_bytes(), Path("point.nl").resolve()
    reports: list[dict[str, Any]] = []
    for point in points.of(columns):
        copy.write_bytes(add_start(data, point))
        reports.append(report_at_start(copy))
    lower, upper = _bounds(reports[0]["variable bounds"], len(columns))
    row_lower, row_upper = _bounds(reports[0].get("constraint bounds", {}), len(rows))
    values = [report["initial evaluations"] for report in reports]
    return Behaviour(
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
        rounding=_ACCURACY,
        discrete=_discrete(reports[0]["problem statistics"]),
    )


def _bounds(stated: dict[str, list[float]], count: int) -> tuple[Floats, Floats]:
    ends = np.array([stated[str(place)] for place in range(count)], dtype=float).reshape(count, 2)
    return ends[:, 0], ends[:, 1]


def _discrete(statistics: dict[str, Any]) -> int:
    """Number of binary and integer columns in the header's five groups."""
    return sum(
        value for key, value in statistics.items() if re.search(r"integer|binary", key) and "total" not in key
    )
