"""The content of a solution file before it is mapped to a problem, as arrays, and the mapping of names."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import repeat
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....models.errors import SolutionError
from ....models.instance.domain import Floats, Ints
from ...statuses import Status
from .grammar import (
    AGAIN,
    HEAD,
    TOKEN_LIMIT,
    EntryForm,
    Scan,
    TextLayout,
    float_of,
    is_number,
    line_error,
    plain_numbers,
    quoted,
    spellings,
)

if TYPE_CHECKING:  # the driver of a solver needs neither the writers nor the formulations
    from ...writing.canonical import ColumnOrder

Bytes = NDArray[np.bytes_]

_CONTROLS = re.compile(r"[\x00-\x1f\x7f]+")


@cache
def added_columns() -> dict[str, str]:
    """Patterns of the columns that programs add when they read or write a model, by title of the program.

    They represent a constant of the objective, its nonlinear part, or the range of a row. A solution may
    hold them besides the columns of the problem.
    """
    # Not at the top: a solver's child process, which writes such files, would load formulations too.
    from ...solvers_table import PROGRAMS

    ours = {"crossfield": r"ONE(?:_[0-9a-f]{11})?", "Pyomo": r"ONE_VAR_CONSTANT|GAMS_OBJECTIVE"}
    return ours | {program.title: program.adds for program in PROGRAMS.values() if program.adds}


@dataclass(frozen=True, eq=False)
class RawSolution:
    """The content of one solution file.

    status: the solver's claim. message: its own words on one line. objective: its objective value, or None.
    names: byte strings (k,), or None when the format is positional. values: float (k,), in the order of the
    file; infinities may occur, NaN may not. omits_zeros: whether a column that is not listed is 0. rows:
    number of constraints in the file, or None if it does not state them. order: the order of the values
    without names. bound: the solver's dual bound, or None. row_names: names (k,) that the file lists as names
    of rows, whose values are left out.
    stamps: digits of the problem's stamp, or the first of them, wherever the solver repeated it. reader: name
    of the reader of the file.
    digits: how the program writes all digits, if it rounded them, or empty. silent: how it writes its
    status, if its layout has none, or empty. pool: all solutions of a file
    that holds several, in its order.
    """

    status: Status
    message: str
    objective: float | None
    names: Bytes | None
    values: Floats
    omits_zeros: bool = False
    rows: int | None = None
    order: ColumnOrder = "nl"
    bound: float | None = None
    row_names: Bytes | None = None
    stamps: frozenset[str] = frozenset()
    reader: str = ""
    digits: str = ""
    silent: str = ""
    pool: tuple[RawSolution, ...] = ()

    @property
    def has_point(self) -> bool:
        """Whether the file holds a point; a file without values is the point 0 if zeros are omitted."""
        return self.values.size > 0 or self.omits_zeros


def solution_pool(solutions: Sequence[RawSolution]) -> RawSolution:
    """The content of a file with one or more solutions; by default the first of them."""
    first, *further = solutions
    return replace(first, pool=(first, *further)) if further else first


def choose_solution(raw: RawSolution, number: int | None = None) -> RawSolution:
    """The solution of a pool with a number from 1, by default the best; its message states which it is.

    The best is that of least objective if each states one, else the first. Raises SolutionError for a
    number that the file does not have.
    """
    pool = raw.pool or (raw,)
    if number is None:
        objectives = [np.inf if solution.objective is None else solution.objective for solution in pool]
        number = 1 + (int(np.argmin(objectives)) if np.isfinite(objectives).all() else 0)
    if not 1 <= number <= len(pool):
        raise SolutionError(f"there is no solution {number} in it; choose one of 1 to {len(pool)}")
    if len(pool) == 1:
        return raw
    chosen = pool[number - 1]
    place = f"solution {number} of {len(pool)}"
    return replace(chosen, message=f"{chosen.message}; {place}" if chosen.message else place)


def solution_without_point(status: Status, message: bytes | str, *, rows: int | None = None) -> RawSolution:
    """The content of a file without a point; the message is put on one line."""
    words = one_line(message if isinstance(message, bytes) else message.encode())
    return RawSolution(status, words, None, np.empty(0, dtype="S1"), np.empty(0), rows=rows)


Claim = Callable[[Scan], tuple[Status, str]]
"""The status that a text claims, and its words."""


@dataclass(frozen=True)
class Reader:
    """A reader of one kind of file.

    recognises: whether a file with these first bytes is of this kind. parse: reads a whole file. Raises
    SolutionError.
    """

    name: str
    description: str
    recognises: Callable[[bytes], bool]
    parse: Callable[[bytes], RawSolution]


def starts_with(pattern: bytes) -> Callable[[bytes], bool]:
    """Return a test for a Reader: whether a file's first bytes match a regular expression."""
    compiled = re.compile(pattern)
    return lambda head: compiled.match(head) is not None


def reader_of(layout: TextLayout, claim: Claim) -> Reader:
    """The reader of a text layout; claim: what its text claims."""

    def parse(data: bytes) -> RawSolution:
        return solution_pool([_parse_answer(answer, layout, claim) for answer in layout.answers(data)])

    return Reader(layout.name, layout.description, layout.recognises, parse)


def _parse_answer(data: bytes, layout: TextLayout, claim: Claim) -> RawSolution:
    scan = Scan(data, layout)
    pieces = [(np.array(names), float_values(values)) for names, values in scan.read()]
    status, words = claim(scan)
    if not scan.has_point:
        return _without_point(scan, status, words)
    names = np.concatenate([names for names, _ in pieces] or [np.empty(0, "S1")])
    values = np.concatenate([values for _, values in pieces] or [np.empty(0)])
    zeros, first = scan.layout.omits_zeros, scan.first
    rows, bound = scan.claims.get("rows", b""), _number(scan, "bound")
    return RawSolution(
        status,
        one_line("; ".join(filter(None, (words, _note(scan)))).encode()),
        _number(scan, "objective"),
        names[first:],
        values[first:],
        omits_zeros=scan.sparse or (not (values[first:] == 0).any() if zeros is None else zeros),
        rows=int(rows) if re.fullmatch(rb"\d{1,12}", rows) else None,
        bound=bound if bound is not None and np.isfinite(bound) else None,
        row_names=names[:first] if first else None,
        digits=layout.digits,
        silent=layout.silent,
    )


def _note(scan: Scan) -> str:
    """Note about the text for the message."""
    name = scan.cut.decode(errors="replace")
    return f"the last line has no end, so the value of {name} may be cut off" if name else ""


def _without_point(scan: Scan, status: Status, words: str) -> RawSolution:
    """The content of a text without a point. Raises SolutionError when it must have one."""
    silent = "status" not in scan.claims
    if "infeasible" in scan.claims:
        return solution_without_point(Status.INFEASIBLE, words or scan.claims["infeasible"])
    if not {"none", "status"} & set(scan.claims) or (status.needs_point and "none" not in scan.claims):
        raise SolutionError(f"the file holds no values; {AGAIN}")
    return solution_without_point(
        Status.NO_POINT if silent or status is Status.FEASIBLE else status.without_point,
        words or scan.claims.get("none", b""),
    )


def _number(scan: Scan, group: str) -> float | None:
    return float_of(scan.claims[group]) if group in scan.claims else None


class Entries(NamedTuple):
    """Values of entries, indices as far as their form has them, and the position after them."""

    values: Floats
    numbers: Ints
    end: int


def read_entries(data: bytes, start: int, form: EntryForm) -> Entries:
    """The lines of a text that are entries, from a byte position on; a line without an end is none."""
    values, index, end = [np.empty(0)], [np.empty(0, np.int64)], start
    for stop, words in form.read(data, start):
        end = stop
        values.append(float_values(form.column(words, "value")))
        index.append(float_values(form.column(words, "index")).astype(np.int64))
    return Entries(np.concatenate(values), np.concatenate(index), end)


def float_values(words: list[bytes]) -> Floats:
    """The numbers in words that are numbers. Python's own rounding: exact."""
    return np.fromstring(plain_numbers(b" ".join(words)), sep=" ")


class NamedValues(NamedTuple):
    """Values by name: values (n,) with NaN for missing ones, and the numbers of missing and unknown names."""

    values: Floats
    missing: int
    unknown: int


def values_by_name(names: Bytes, raw: RawSolution) -> NamedValues:
    """The values of `names` (n,), unique byte strings, in their order.

    A name that is not in the file is 0 if its format omits zeros, else NaN and counted as missing. Names in
    the file that are not among `names` may be in another case, in quotes, or have the prefix of a transformed
    problem. Others are counted as unknown, except for the columns that programs add.

    Raises SolutionError when the file has no point or no names, gives one name two values, or lists one of
    `names` as the name of a row.
    """
    listed = _listed_names(raw)
    _check_rows(names, raw)
    if np.array_equal(listed, names):
        return NamedValues(raw.values.copy(), 0, 0)
    index = _places(names, listed)
    known = index >= 0
    values = np.full(len(names), 0.0 if raw.omits_zeros else np.nan)
    values[index[known]] = raw.values[known]
    _check_repeats(listed[known], raw.values[known], values[index[known]])
    return NamedValues(values, int(np.isnan(values).sum()), len(_foreign_names(listed[~known])))


def unknown_names(names: Bytes, raw: RawSolution) -> list[bytes]:
    """The names in a file that are neither among `names` nor added by programs."""
    listed = _listed_names(raw)
    return _foreign_names(listed[_places(names, listed) < 0])


def _places(names: Bytes, listed: Bytes) -> NDArray[np.int64]:
    """The place of each listed name among `names`, -1 for an unknown one."""
    place = dict(zip(names.tolist(), range(len(names)), strict=True))
    index = np.fromiter(map(place.get, listed.tolist(), repeat(-1)), np.int64, len(listed))
    unknown = np.flatnonzero(index < 0)
    if len(unknown):
        folded = {name.lower(): at for name, at in place.items()}
        for at, name in zip(unknown.tolist(), listed[unknown].tolist(), strict=True):
            index[at] = next((folded[word] for word in spellings(name) if word in folded), -1)
    return index


def _foreign_names(names: Bytes) -> list[bytes]:
    """The names that are not of columns that programs add."""
    added = re.compile("|".join(added_columns().values()).encode(), re.DOTALL | re.IGNORECASE)
    return [name for name in names.tolist() if not any(map(added.fullmatch, spellings(name)))]


def _listed_names(raw: RawSolution) -> Bytes:
    _check_point(raw)
    if raw.names is None:
        raise SolutionError(
            "the file lists values without names; "
            f"it must be read by position, in the order of the .{raw.order} file"
        )
    return raw.names


def _check_point(raw: RawSolution) -> None:
    if not raw.has_point:
        words = f"{raw.status}: {raw.message}" if raw.message else str(raw.status)
        raise SolutionError(
            f"there is no point in it ({words}); give the solver more time or a problem that has a solution"
        )


def _check_rows(names: Bytes, raw: RawSolution) -> None:
    if raw.row_names is None:
        return
    misplaced = raw.row_names[np.isin(raw.row_names, names)]
    if len(misplaced):
        name = misplaced[0].decode(errors="replace")
        raise SolutionError(
            f"the column {name} stands before the numbers start again, where rows should; "
            "a line is repeated or out of order; let the solver write the file again"
        )


def _check_repeats(names: Bytes, first: Floats, last: Floats) -> None:
    clash = first != last
    if clash.any():
        at = int(np.argmax(clash))
        name = names[at].decode(errors="replace")
        raise SolutionError(
            f"{name} has two values, {first[at]} and {last[at]}; leave one solution in the file"
        )


def values_in_order(columns: int, rows: int, raw: RawSolution) -> Floats:
    """The primal values (columns,) of a positional file for a problem with that many columns and rows.

    Raises SolutionError when the file has no point or is of a problem of another size.
    """
    _check_point(raw)
    count = raw.values.size
    if (raw.rows, count) != (rows, columns):
        raise SolutionError(
            f"the file is of {count} columns and {raw.rows} rows, the problem has {columns} columns and "
            f"{rows} rows; give the solution of this problem, of HiGHS in style 0 (raw) or 4 (sparse)"
        )
    return raw.values.copy()


def one_line(text: bytes) -> str:
    """The words of a text on one line of at most 300 characters, without control characters."""
    return " ".join(_CONTROLS.sub(" ", text[:HEAD].decode(errors="replace")).split())[:300]


@dataclass
class Cursor:
    """A position in a text that moves on line by line; for the few lines that are not a column of numbers."""

    data: bytes
    position: int = 0
    before: int = 0  # start of the line last read

    @property
    def at_end(self) -> bool:
        """Whether all lines are read."""
        return self.position >= len(self.data)

    def line(self, expected: str) -> bytes:
        """The next line that is not blank, stripped. Raises SolutionError when there is none."""
        line = b""
        while not line:
            if self.at_end:
                raise line_error(self.data, self.position, f"the file is cut off where {expected} should be")
            end = self.data.find(b"\n", self.position)
            self.before, self.position = self.position, len(self.data) if end < 0 else end + 1
            line = self.data[self.before : self.position].strip()
        return line

    def count(self, expected: str) -> int:
        """The next line as an integer that is not negative. Raises SolutionError."""
        value = self.integer(expected)
        if value < 0:
            raise self.fault(f"{value} is not {expected}")
        return value

    def integer(self, expected: str) -> int:
        """The next line as an integer. Raises SolutionError."""
        line = self.line(expected)
        if not re.fullmatch(rb"-?\d{1,12}", line):
            raise self.fault(f"{quoted(line)} is not {expected}")
        return int(line)

    def number(self, text: bytes) -> float:
        """A number on the line last read. Raises SolutionError."""
        if not is_number(text):
            raise self.fault(f"{quoted(text)} is not a number")
        return float_of(text)

    def fault(self, text: str) -> SolutionError:
        """An error about the line last read."""
        return line_error(self.data, self.before, text)


def named_values(names: list[str], values: Sequence[float] | Floats) -> tuple[Bytes, Floats]:
    """Names and values of a document as arrays. Raises SolutionError for a long name or NaN."""
    long = next((name for name in names if len(name) > TOKEN_LIMIT), None)
    if long is not None:
        raise SolutionError(
            f"the name {quoted(long.encode(errors='replace'))}... has more than {TOKEN_LIMIT} characters; "
            "give the solution of the file that was written"
        )
    numbers_ = np.array(values, dtype=np.float64)
    if np.isnan(numbers_).any():
        at = int(np.argmax(np.isnan(numbers_)))
        raise SolutionError(f"{names[at]} has no value; let the solver write the file again")
    return np.array([name.encode(errors="replace") for name in names] or np.empty(0, "S1")), numbers_
