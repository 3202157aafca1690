"""Solution files of Gurobi: .sol and .json; lists like its .sol: of COPT, of MIPLIB, and plain ones.

    # Solution for model obj               comment lines, which vary; the first may be missing
    # Objective value = -1.44e+01
    x 10                                   name and value of every column, zeros too

A .sol has no status: the point counts as feasible. A MIP start (.mst) looks like one
and holds only the integer columns. The .json (GRBwrite, attribute names of the Gurobi manual) has more facts:

    { "SolutionInfo": { "Status": 2, "ObjVal": ..., "ObjBound": ..., ... },
      "Vars": [ { "VarName": "x", "X": 10}, ... ]}

Columns at 0 are omitted unless JSONSolDetail is 1. Then each has a list PoolNX of its values in further
solutions too, which are not read: X is the incumbent. Without a solution there is no Vars, and bounds are
1e+100. Layouts: Gurobi 13.0.3.

MIPLIB's .sol begins with `=obj= value`, and columns at 0 may be omitted. `=infeas=` instead denotes an
infeasible instance (MIPLIB's solution checker). There is no other status: a point counts as feasible.
"""

from __future__ import annotations

import json
import re
from typing import Any, Final

from ....models.errors import SolutionError
from ....models.instance.grid import Floats
from ..statuses import GUROBI, Status
from .text import (
    Bytes,
    Cursor,
    RawSolution,
    Reader,
    begins,
    is_number,
    named_numbers,
    named_pairs,
    shown,
    without_point,
)

_MARK = re.compile(rb"# ?(?:Solution for model|Objective value|MIP start)\b", re.IGNORECASE)
_OBJECTIVE = re.compile(rb"# ?Objective value ?=? *(\S+)", re.IGNORECASE)
_START = re.compile(rb"# ?MIP start\b", re.IGNORECASE)
_LINES_TO_TELL: Final = 5
_INFINITE: Final = 1e100

_POINTLESS: Final = {Status.INFEASIBLE, Status.UNBOUNDED}


def _recognises(head: bytes) -> bool:
    """Whether a file with this start is a .sol of Gurobi, or a list of names and values without comments."""
    if _MARK.match(head):
        return True
    lines = head[: head.rfind(b"\n") + 1].splitlines()
    lines = lines[next((at for at, line in enumerate(lines) if not line.startswith(b"#")), len(lines)) :]
    return bool(lines) and all(map(_is_pair, lines[:_LINES_TO_TELL]))


def _is_pair(line: bytes) -> bool:
    words = line.split()
    return (
        len(words) == 2 and not words[0].startswith(b"=") and not is_number(words[0]) and is_number(words[1])
    )


def parse(data: bytes) -> RawSolution:
    """Read a .sol. Raises SolutionError for a MIP start, no values, and words that are not numbers."""
    cursor, objective = Cursor(data), None
    while data.startswith(b"#", cursor.position):
        line = cursor.line("the end of a comment")
        if _START.match(line):
            raise cursor.fault("this is a MIP start, with the integer columns only; the .sol is needed")
        if found := _OBJECTIVE.fullmatch(line):
            objective = cursor.number(found[1])
    names, values = named_numbers(data, cursor.position, len(data), 2)
    if not len(values):
        raise SolutionError("the file holds no values; let the solver write it again")
    return RawSolution(Status.FEASIBLE, "", objective, names, values)


def parse_miplib(data: bytes) -> RawSolution:
    """Read a .sol of MIPLIB. Raises SolutionError for words that are not numbers, and for a cut."""
    cursor = Cursor(data)
    label, *rest = cursor.line("the objective").split()
    if label == b"=infeas=":
        return without_point(Status.INFEASIBLE, label)
    if label != b"=obj=" or len(rest) != 1:
        raise cursor.fault(f"{shown(b' '.join([label, *rest]))} is not =obj= and a number")
    objective = cursor.number(rest[0])
    names, values = named_numbers(data, cursor.position, len(data), 2)
    return RawSolution(Status.FEASIBLE, "", objective, names, values, omits_zeros=True)


def parse_json(data: bytes) -> RawSolution:
    """Read the incumbent in a .json. Raises SolutionError for damaged JSON and invalid values."""
    content = _document(data)
    information, variables = content.get("SolutionInfo"), content.get("Vars")
    if not isinstance(information, dict) or not isinstance(information.get("Status"), int):
        raise SolutionError("the SolutionInfo has no Status; let Gurobi write the file again")
    status, words = GUROBI.get(
        information["Status"], (Status.ERROR, f"Gurobi's status {information['Status']}")
    )
    if variables is None or status in _POINTLESS:
        if status is Status.OPTIMAL_GLOBAL:
            raise SolutionError("the file states optimal but holds no Vars; let Gurobi write it again")
        return without_point(status.without_point, words)
    names, values = _columns(variables)
    objective, bound = _finite(information.get("ObjVal")), _finite(information.get("ObjBound"))
    return RawSolution(status, words, objective, names, values, omits_zeros=True, bound=bound)


def _finite(value: Any) -> float | None:
    """A number that is below Gurobi's infinity, else None."""
    return float(value) if type(value) in {int, float} and abs(value) < _INFINITE else None


def _document(data: bytes) -> dict[str, Any]:
    try:
        content = json.loads(data, object_pairs_hook=_object, parse_int=_integer)
    except json.JSONDecodeError as error:
        raise SolutionError(
            f"line {error.lineno}: the JSON is damaged or cut off at column {error.colno}; "
            "let Gurobi write the file again"
        ) from error
    except (ValueError, RecursionError) as error:
        raise SolutionError("the JSON is damaged; let Gurobi write the file again") from error
    if not isinstance(content, dict):
        raise SolutionError("the JSON holds no SolutionInfo; let Gurobi write the file again")
    return content


def _integer(text: str) -> int | float:
    """A whole number; a float if it is so long that converting it would take time."""
    return int(text) if len(text) < 19 else float(text)


def _object(pairs: list[tuple[str, Any]]) -> Any:
    """A variable as the pair of its name and value, which saves memory; other objects as a dictionary."""
    content = dict(pairs)
    return (content["VarName"], content.get("X", 0)) if "VarName" in content else content


def _columns(variables: Any) -> tuple[Bytes, Floats]:
    if not isinstance(variables, list) or not all(map(_is_column, variables)):
        raise SolutionError("Vars is not a list of names and values; let Gurobi write the file again")
    return named_pairs([name for name, _ in variables], [value for _, value in variables])


def _is_column(entry: Any) -> bool:
    return isinstance(entry, tuple) and isinstance(entry[0], str) and type(entry[1]) in {int, float}


READERS: Final = (
    Reader("gurobi-json", "Gurobi .json", begins(rb'\s*\{\s*"SolutionInfo"'), parse_json),
    Reader("miplib", "MIPLIB .sol", begins(rb"=obj=|=infeas="), parse_miplib),
    Reader("gurobi", "Gurobi .sol, or any list of names and values", _recognises, parse),
)
