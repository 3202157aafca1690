"""JSON documents that hold a solution; a layout is an entry of paths to its columns and claims.

    {"SolutionInfo": {"Status": 2, "ObjVal": ..}, "Vars": [{"VarName": "x", "X": 10}, ..]}              Gurobi
    {"parameters": {"sol_status": 1, ..}, "variables": [{"name": "x", "varValue": 10}, ..], ..}         PuLP
    {"Solver": [{"Termination condition": ..}], "Solution": [{}, {"Variable": {"x": {"Value": 10}}}]}   Pyomo
    {"status": "optimal", "objective": 3, "variables": {"x": 10}}   plain; without claims also {"x": 10}

Gurobi (GRBwrite; attribute names of its manual) omits columns at 0 unless JSONSolDetail is 1; then each has a
list PoolNX of its values in all solutions, the incumbent first. Without a solution there is no Vars, and
bounds are 1e+100. Pyomo omits columns at 0 too. An object with the same key twice is refused.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Any, Final

from ....models.errors import SolutionError
from ...statuses import Status, claim_of
from .grammar import quoted
from .text import (
    RawSolution,
    Reader,
    named_values,
    one_line,
    solution_pool,
    solution_without_point,
    starts_with,
)

_INFINITE: Final = 1e100
_AGAIN: Final = "let the program write the file again"

_POINTLESS: Final = {Status.INFEASIBLE, Status.UNBOUNDED, Status.NO_POINT}

DocumentPath = tuple[str | int | None, ...]
"""Keys and places that lead into a document; None is the only member of an object."""


@dataclass(frozen=True)
class _DocumentLayout:
    """Paths to the columns and claims of a document; table: its rows in the table of statuses."""

    columns: DocumentPath
    status: DocumentPath
    table: str
    objective: DocumentPath = ()
    bound: DocumentPath = ()
    omits_zeros: bool = False


_GUROBI: Final = _DocumentLayout(
    ("Vars",),
    ("SolutionInfo", "Status"),
    "gurobi-json",
    ("SolutionInfo", "ObjVal"),
    ("SolutionInfo", "ObjBound"),
    omits_zeros=True,
)
_CLAIMS: Final = {"status", "objective", "bound"}
_OTHERS: Final = (
    _DocumentLayout(("variables",), ("parameters", "sol_status"), "pulp"),
    _DocumentLayout(
        ("Solution", 1, "Variable"),
        ("Solver", 0, "Termination condition"),
        "other",
        ("Solution", 1, "Objective", None, "Value"),
        ("Problem", 0, "Lower bound"),
        omits_zeros=True,
    ),
)


def parse_gurobi(data: bytes) -> RawSolution:
    """Read the solutions in a .json of Gurobi. Raises SolutionError for damaged JSON and invalid values."""
    content = _document(data)
    if not isinstance(_at(content, _GUROBI.status), int):
        raise SolutionError(f"the SolutionInfo has no Status; {_AGAIN}")
    return _pool(content, _solution(content, _GUROBI))


def parse_document(data: bytes) -> RawSolution:
    """Read a document of PuLP or Pyomo, or a plain one. Raises SolutionError for invalid values."""
    content = _document(data)
    layout = next((known for known in _OTHERS if _at(content, known.status) is not None), None)
    if layout is not None:
        return _solution(content, layout)
    content |= _columns_of_frame(content)
    inner = next((key for key in ("variables", "values", "solution") if key in content), "columns")
    if inner == "columns":
        content |= {inner: {key: value for key, value in content.items() if key not in _CLAIMS}}
    layout = _DocumentLayout((inner,), ("status",), "other", ("objective",), ("bound",))
    return _solution(content, layout)


def _columns_of_frame(content: dict[str, Any]) -> dict[str, Any]:
    """The columns of a data frame of pandas with names and values: its records, columns, or split parts."""
    table = content.get("data")
    if len(content) == 2 and all(isinstance(part, dict) for part in content.values()):
        names, values = content.values()
        table = [[names[row], values.get(row)] for row in names]
    rows = table if isinstance(table, list) else []
    is_table = all(isinstance(row, list) and len(row) == 2 and isinstance(row[0], str) for row in rows)
    return {"variables": list(map(tuple, rows))} if rows and is_table else {}


def _solution(content: dict[str, Any], layout: _DocumentLayout) -> RawSolution:
    """The solution of a document; a status that is no point leaves its values out."""
    code, columns = _at(content, layout.status), _at(content, layout.columns)
    silent = Status.FEASIBLE, ""
    status, words = claim_of(code, layout.table) if isinstance(code, (str, int)) else silent
    if columns is None or status in _POINTLESS:
        if status.is_optimal:
            raise SolutionError(f"the file states optimal but holds no values; {_AGAIN}")
        return solution_without_point(status.without_point, words)
    names, values = named_values(*_columns(columns))
    objective, bound = (_finite_number(_at(content, path)) for path in (layout.objective, layout.bound))
    return RawSolution(
        status, one_line(words.encode()), objective, names, values, layout.omits_zeros, bound=bound
    )


def _at(content: Any, path: DocumentPath) -> Any:
    """The member of a document at a path, or None."""
    for key in path:
        if key is None:
            content = next(iter(content.values()), None) if isinstance(content, dict) else None
        elif isinstance(content, dict):
            content = content.get(key)
        else:
            inside = isinstance(content, list) and isinstance(key, int) and key < len(content)
            content = content[key] if inside else None
    return content if path else None


def _columns(entries: Any) -> tuple[list[str], list[float]]:
    """Names and values of an object, or of a list of pairs. Raises SolutionError for other content."""
    pairs = entries.items() if isinstance(entries, dict) else entries if isinstance(entries, list) else [None]
    columns = [_column(entry) for entry in pairs]
    wrong = next((entry for entry, column in zip(pairs, columns, strict=True) if column is None), None)
    if None in columns or not columns:
        raise SolutionError(f"{quoted(repr(wrong).encode())} is not a name with a value; {_AGAIN}")
    names, values = zip(*columns, strict=True)
    return list(names), list(values)


def _column(entry: Any) -> tuple[str, float] | None:
    if not isinstance(entry, tuple) or len(entry) < 2:
        return None
    name, value = entry[0], entry[1]
    if isinstance(value, dict):
        value = value.get("Value")
    return (name, value) if isinstance(name, str) and type(value) in {int, float} else None


def _pool(content: dict[str, Any], best: RawSolution) -> RawSolution:
    """All solutions of a document of Gurobi; those after the incumbent have no status of their own."""
    objectives = _at(content, ("SolutionInfo", "PoolNObjVal"))
    further = [entry[2] for entry in content.get("Vars") or ()]
    if not best.has_point or not isinstance(objectives, list) or None in further or not further:
        return best
    if any(len(values) != len(objectives) for values in further):
        raise SolutionError(f"not every column has {len(objectives)} values; {_AGAIN}")
    names = [entry[0] for entry in content["Vars"]]
    further_solutions = []
    for at, objective in enumerate(objectives[1:], 1):
        values = named_values(names, [values[at] for values in further])[1]
        further_solutions.append(
            replace(
                best,
                status=Status.FEASIBLE,
                message="",
                objective=_finite_number(objective),
                bound=None,
                values=values,
            )
        )
    return solution_pool([best, *further_solutions])


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
    if isinstance(content, list):
        rows = [list(row.values()) if isinstance(row, dict) else row for row in content]
        content = {"data": rows}
    if not isinstance(content, dict):
        raise SolutionError(f"the JSON holds no solution; {_AGAIN}")
    return content


def _integer(text: str) -> int | float:
    """A whole number; a float if it is so long that converting it would take time."""
    return int(text) if len(text) < 19 else float(text)


def _object(pairs: list[tuple[str, Any]]) -> Any:
    """A column as the tuple of its name and values, which saves memory; other objects as a dictionary."""
    content = dict(pairs)
    if len(content) < len(pairs):
        raise SolutionError(f"an object has a key twice; {_AGAIN}")
    name = content.get("VarName") or next(iter(content.get("VTag") or ()), None)  # tags replace names
    if name is not None:
        return name, content.get("X", 0), content.get("PoolNX")
    if "varValue" in content:
        return content.get("name"), content["varValue"]
    return content


READERS: Final = (
    Reader("gurobi-json", "Gurobi .json", starts_with(rb'\s*\{\s*"SolutionInfo"'), parse_gurobi),
    Reader(
        "json",
        "JSON of PuLP or Pyomo, or of names and values",
        starts_with(rb'\s*(?:\{\s*(?:"(?!SolutionInfo")|\}|\Z)|\[\s*\{)'),  # others begin a message of AMPL
        parse_document,
    ),
)
