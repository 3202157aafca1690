"""Solution files of MIPLIB: `=obj= value`, then one name and value per line; columns at 0 may be omitted.

`=infeas=` instead denotes an infeasible instance (MIPLIB's solution checker). There is no other status: a
point counts as feasible.
"""

from __future__ import annotations

from typing import Final

from .text import Cursor, RawSolution, Reader, Status, begins, named_numbers, shown, without_point


def parse(data: bytes) -> RawSolution:
    """Read a file. Raises SolutionError for words that are not numbers and for a file that is cut off."""
    cursor = Cursor(data)
    label, *rest = cursor.line("the objective").split()
    if label == b"=infeas=":
        return without_point(Status.INFEASIBLE, label)
    if label != b"=obj=" or len(rest) != 1:
        raise cursor.fault(f"{shown(b' '.join([label, *rest]))} is not =obj= and a number")
    objective = cursor.number(rest[0])
    names, values = named_numbers(data, cursor.position, len(data), 2)
    return RawSolution(Status.FEASIBLE, "", objective, names, values, omits_zeros=True)


READERS: Final = (Reader("miplib", "MIPLIB .sol", begins(rb"=obj=|=infeas="), parse),)
