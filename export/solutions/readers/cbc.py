"""Solution files of CBC.

    Optimal - objective value -14.40000000
          0 x                     10                    -1.9      number, name, value, reduced cost
    **    3 y                    200                       0      ** before values out of their bounds

Values have 8 significant digits, so violations up to about 1e-7 of a value's size are due to the file.
`printingOptions all` or `rows` puts the rows before the columns. Their numbers then start again, and names
before that must not be columns. Some versions and options omit columns at 0; a file with a value of 0 does
not. A file of an infeasible problem looks the same, and a file of a search without result holds the
relaxation, (no integer solution - continuous used): both hold no point. Layouts: CBC 2.10.8.
"""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from ..statuses import of_cbc
from .text import (
    Cursor,
    RawSolution,
    Reader,
    begins,
    fault,
    labelled_numbers,
    line_after,
    one_line,
    shown,
    without_point,
)

_HEAD = re.compile(rb"([A-Z][^\n]{2,100}?) - objective value +(\S+)")
_MARK: Final = b"\n**"


def parse(data: bytes) -> RawSolution:
    """Read a file. Raises SolutionError for words that are not numbers and files that are cut off."""
    cursor = Cursor(data)
    line = cursor.line("the status and the objective")
    head = _HEAD.fullmatch(line)
    if head is None:
        raise cursor.fault(f"{shown(line)} is not a status and the objective")
    status = of_cbc(head[1].decode(errors="replace"))
    if not status.promises_point:
        return without_point(status, head[1])
    objective = cursor.number(head[2])
    names, numbers = labelled_numbers(
        data.replace(_MARK, b"\n  "), cursor.position, len(data), 4, label=1, numeric=(0, 2)
    )
    starts = np.flatnonzero(np.diff(numbers[:, 0]) <= 0) + 1
    if len(starts) > 1:
        at = line_after(data, cursor.position, int(starts[1]))
        raise fault(data, at, "the numbers start again for the second time")
    first = int(starts[0]) if len(starts) else 0
    values = numbers[first:, 1].copy()
    return RawSolution(
        status,
        one_line(head[1]),
        objective,
        names[first:],
        values,
        omits_zeros=not (values == 0).any(),
        of_rows=names[:first],
    )


READERS: Final = (Reader("cbc", "CBC, the file of its command solution", begins(_HEAD.pattern), parse),)
