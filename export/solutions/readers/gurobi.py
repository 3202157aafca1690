"""Solutions of Gurobi as JSON (GRBwrite; attribute names of its manual).

    {"SolutionInfo": {"Status": 2, "ObjVal": ..}, "Vars": [{"VarName": "x", "X": 10}, ..]}

Columns at 0 are omitted unless JSONSolDetail is 1. Without a solution there is no Vars, and bounds are
1e+100. Of a pool (PoolNX) the incumbent is read. An object with the same key twice is refused.
"""

from __future__ import annotations

import json
from typing import Any, Final

from ....models.errors import SolutionError
from ...statuses import GUROBI, Status
from .grammar import quoted
from .text import RawSolution, Reader, named_values, one_line, solution_without_point, starts_with

_INFINITE: Final = 1e100
_AGAIN: Final = "let Gurobi write the file again"
_POINTLESS: Final = {Status.INFEASIBLE, Status.UNBOUNDED, Status.NO_POINT}


def parse(data: bytes) -> RawSolution:
    """Read a file. Raises SolutionError for damaged JSON and invalid values."""
    content = _document(data)
    info = content.get("SolutionInfo")
    if not isinstance(info, dict) or not isinstance(code := info.get("Status"), int):
        raise SolutionError(f"the SolutionInfo has no Status; {_AGAIN}")
    status, words = GUROBI.get(code, (Status.ERROR, f"status {code}"))
    entries = content.get("Vars")
    if entries is None or status in _POINTLESS:
        if status is Status.OPTIMAL_GLOBAL:
            raise SolutionError(f"the file states optimal but holds no values; {_AGAIN}")
        return solution_without_point(status.without_point, words)
    names, values = named_values(*_columns(entries))
    objective, bound = (_finite_number(info.get(key)) for key in ("ObjVal", "ObjBound"))
    return RawSolution(
        status, one_line(words.encode()), objective, names, values, omits_zeros=True, bound=bound
    )


def _columns(entries: Any) -> tuple[list[str], list[float]]:
    """Names and values of a list of columns. Raises SolutionError for other content."""
    listed: list[Any] = entries if isinstance(entries, list) and entries else [None]
    for entry in listed:
        if (
            not isinstance(entry, tuple)
            or not isinstance(entry[0], str)
            or type(entry[1]) not in {int, float}
        ):
            raise SolutionError(f"{quoted(repr(entry).encode())} is not a name with a value; {_AGAIN}")
    return [name for name, _ in listed], [value for _, value in listed]


def _finite_number(value: Any) -> float | None:
    """A number that is below Gurobi's infinity, else None."""
    return float(value) if type(value) in {int, float} and abs(value) < _INFINITE else None


def _document(data: bytes) -> dict[str, Any]:
    try:
        content = json.loads(data, object_pairs_hook=_object, parse_int=_integer)
    except SolutionError:
        raise
    except json.JSONDecodeError as error:
        raise SolutionError(
            f"line {error.lineno}: the JSON is damaged or cut off at column {error.colno}; {_AGAIN}"
        ) from error
    except (ValueError, RecursionError) as error:
        raise SolutionError(f"the JSON is damaged; {_AGAIN}") from error
    if not isinstance(content, dict):
        raise SolutionError(f"the JSON holds no solution; {_AGAIN}")
    return content


def _integer(text: str) -> int | float:
    """A whole number; a float if it is so long that converting it would take time."""
    return int(text) if len(text) < 19 else float(text)


def _object(pairs: list[tuple[str, Any]]) -> Any:
    """A column as the tuple of its name and value, which saves memory; other objects as a dictionary."""
    content = dict(pairs)
    if len(content) < len(pairs):
        raise SolutionError(f"an object has a key twice; {_AGAIN}")
    name = content.get("VarName") or next(iter(content.get("VTag") or ()), None)  # tags replace names
    return content if name is None else (name, content.get("X", 0))


READER: Final = Reader("gurobi-json", "Gurobi .json", starts_with(rb'\s*\{\s*"SolutionInfo"'), parse)
