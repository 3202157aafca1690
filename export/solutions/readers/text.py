"""The content of a solution file, before it is mapped to a problem, and fast parsing of its columns of text.

A regular expression checks megabytes of text at a time, without line numbers; the place of an error is
determined only when one occurs.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import repeat
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....models.errors import SolutionError
from ....models.instance.grid import Floats
from ..statuses import Status

if TYPE_CHECKING:  # the driver of a solver needs neither the writers nor the formulations
    from ...writing.canonical import Order

Bytes = NDArray[np.bytes_]

TOKEN_LIMIT: Final = 63
"""Longest name or number, in bytes. Names of this package have at most 15, numbers at most 24."""

HEAD: Final = 1 << 16
"""Number of bytes at the start of a file that determine its format."""

_PIECE: Final = 1 << 20  # bytes processed at once: their words take some ten times as much
_WORD: Final = rb"(?=[^\0- ]{1,%d}+[ \t\n])" % TOKEN_LIMIT
_NUMBER = re.compile(
    rb"[-+]?(?:1\.#inf0*|inf(?:inity)?|(?:\d+(?:\.\d*)?|\.\d+)(?:[ed][-+]?\d+)?)", re.IGNORECASE
)
_NOT_TEXT = re.compile(rb"[^\t -\xff]")
_WINDOWS_INFINITY = re.compile(rb"1\.#inf0*", re.IGNORECASE)
_FORTRAN = bytes.maketrans(b"dD", b"eE")
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
    without names. bound: the solver's dual bound, or None. of_rows: names (k,) that the file lists as names
    of rows, whose values are left out.
    stamps: digits of the problem's stamp, or the first of them, wherever the solver repeated it. reader: name
    of the reader of the file.
    rounded: how the program writes all digits, if it rounded them, or empty. pool: all solutions of a file
    that holds several, in its order.
    """

    status: Status
    message: str
    objective: float | None
    names: Bytes | None
    values: Floats
    omits_zeros: bool = False
    rows: int | None = None
    order: Order = "nl"
    bound: float | None = None
    of_rows: Bytes | None = None
    stamps: frozenset[str] = frozenset()
    reader: str = ""
    rounded: str = ""
    pool: tuple[RawSolution, ...] = ()

    @property
    def has_point(self) -> bool:
        """Whether the file holds a point; a file without values is the point 0 if zeros are omitted."""
        return self.values.size > 0 or self.omits_zeros


def pooled(solutions: Sequence[RawSolution]) -> RawSolution:
    """The content of a file with one or more solutions; by default the first of them."""
    first, *others = solutions
    return replace(first, pool=(first, *others)) if others else first


def choose(raw: RawSolution, number: int | None = None) -> RawSolution:
    """The solution of a pool with a number from 1, by default the best; its message states which it is.

    The best is that of least objective if each states one, else the first. Raises SolutionError for a
    number that the file does not have.
    """
    pool = raw.pool or (raw,)
    if number is None:
        objectives = [np.inf if each.objective is None else each.objective for each in pool]
        number = 1 + (int(np.argmin(objectives)) if np.isfinite(objectives).all() else 0)
    if not 1 <= number <= len(pool):
        raise SolutionError(f"there is no solution {number} in it; choose one of 1 to {len(pool)}")
    if len(pool) == 1:
        return raw
    chosen = pool[number - 1]
    place = f"solution {number} of {len(pool)}"
    return replace(chosen, message=f"{chosen.message}; {place}" if chosen.message else place)


def without_point(status: Status, message: bytes | str, *, rows: int | None = None) -> RawSolution:
    """The content of a file without a point; the message is put on one line."""
    words = one_line(message if isinstance(message, bytes) else message.encode())
    return RawSolution(status, words, None, np.empty(0, dtype="S1"), np.empty(0), rows=rows)


@dataclass(frozen=True)
class Reader:
    """A reader of one kind of file.

    recognises: whether a file with these first bytes is of this kind. parse: reads a whole file. Raises
    SolutionError. text: both receive lines that end as on Unix.
    """

    name: str
    description: str
    recognises: Callable[[bytes], bool]
    parse: Callable[[bytes], RawSolution]
    text: bool = True


def begins(pattern: bytes) -> Callable[[bytes], bool]:
    """Return a test for a Reader: whether a file's first bytes match a regular expression."""
    compiled = re.compile(pattern)
    return lambda head: compiled.match(head) is not None


class NamedValues(NamedTuple):
    """Values by name: values (n,) with NaN for missing ones, and the numbers of missing and unknown names."""

    values: Floats
    missing: int
    unknown: int


def values_for(names: Bytes, raw: RawSolution) -> NamedValues:
    """The values of `names` (n,), unique byte strings, in their order.

    A name that is not in the file is 0 if its format omits zeros, else NaN and counted as missing. Names in
    the file that are not among `names` are counted as unknown, except for the columns that programs add.

    Raises SolutionError when the file has no point or no names, gives one name two values, or lists one of
    `names` as the name of a row.
    """
    listed = _listed(raw)
    _check_rows(names, raw)
    if np.array_equal(listed, names):
        return NamedValues(raw.values.copy(), 0, 0)
    place = dict(zip(names.tolist(), range(len(names)), strict=True))
    index = np.fromiter(map(place.get, listed.tolist(), repeat(-1)), np.int64, len(listed))
    known = index >= 0
    values = np.full(len(names), 0.0 if raw.omits_zeros else np.nan)
    values[index[known]] = raw.values[known]
    _check_repeats(listed[known], raw.values[known], values[index[known]])
    added = re.compile("|".join(added_columns().values()).encode(), re.DOTALL)
    strangers = sum(added.fullmatch(name) is None for name in listed[~known].tolist())
    return NamedValues(values, int(np.isnan(values).sum()), strangers)


def _listed(raw: RawSolution) -> Bytes:
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
    if raw.of_rows is None:
        return
    misplaced = raw.of_rows[np.isin(raw.of_rows, names)]
    if len(misplaced):
        name = misplaced[0].decode(errors="replace")
        raise SolutionError(
            f"the column {name} stands before the numbers start again, where rows should; "
            "a line is repeated or out of order; let the solver write the file again"
        )


def _check_repeats(names: Bytes, given: Floats, kept: Floats) -> None:
    clash = given != kept
    if clash.any():
        at = int(np.argmax(clash))
        name = names[at].decode(errors="replace")
        raise SolutionError(
            f"{name} has two values, {given[at]} and {kept[at]}; leave one solution in the file"
        )


def values_in_order(columns: int, rows: int, raw: RawSolution) -> Floats:
    """The primal values (columns,) of a positional file for a problem with that many columns and rows.

    Raises SolutionError when the file has no point or is of a problem of another size.
    """
    _check_point(raw)
    found = raw.values.size
    if (raw.rows, found) != (rows, columns):
        if raw.order != "nl" and (raw.rows, found) == (rows + 1, columns):
            raise SolutionError(
                "the file counts one row too many: this is HiGHS style 2 (GLPK raw); "
                "write it with write_solution_style = 0 (raw) or 4 (sparse)"
            )
        raise SolutionError(
            f"the file is of {found} columns and {raw.rows} rows, the problem has {columns} columns and "
            f"{rows} rows; give the solution of this problem"
        )
    return raw.values.copy()


def one_line(text: bytes) -> str:
    """The words of a text on one line of at most 300 characters, without control characters."""
    return " ".join(_CONTROLS.sub(" ", text[:HEAD].decode(errors="replace")).split())[:300]


def with_unix_ends(data: bytes) -> bytes:
    r"""The text with \n at the end of its lines."""
    return data.replace(b"\r\n", b"\n") if b"\r" in data else data


def fault(data: bytes, position: int, text: str) -> SolutionError:
    """An error with the line of a byte position in a text, and the remedy."""
    line = data.count(b"\n", 0, position) + 1
    return SolutionError(f"line {line}: {text}; let the solver write the file again")


def line_after(data: bytes, position: int, count: int) -> int:
    """Start of the line that comes `count` whole lines after a byte position."""
    ends = np.flatnonzero(np.frombuffer(data, np.uint8, offset=position) == ord("\n"))
    return position + (int(ends[count - 1]) + 1 if count else 0)


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
        """The next line, stripped. Raises SolutionError when the text ends before the line does."""
        end = self.data.find(b"\n", self.position)
        if end < 0:
            raise fault(self.data, self.position, f"the file is cut off where {expected} should be")
        self.before, self.position = self.position, end + 1
        return self.data[self.before : end].strip()

    def after(self, label: bytes, expected: str) -> bytes:
        """The text after a label on the next line, stripped. Raises SolutionError for another label."""
        line = self.line(expected)
        if not line.startswith(label):
            raise self.fault(f"{shown(line)} stands where {expected} should")
        return line.removeprefix(label).strip()

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
            raise self.fault(f"{shown(line)} is not {expected}")
        return int(line)

    def number(self, text: bytes) -> float:
        """A number on the line last read. Raises SolutionError."""
        return _number(self.data, self.before, text)

    def fault(self, text: str) -> SolutionError:
        """An error about the line last read."""
        return fault(self.data, self.before, text)


def shown(text: bytes) -> str:
    """A short quotation for a message."""
    return repr(text[:40].decode(errors="replace"))


def is_number(text: bytes) -> bool:
    """Whether a word is a number in the notation of solvers."""
    return len(text) <= TOKEN_LIMIT and _NUMBER.fullmatch(text) is not None


def number_of(text: bytes) -> float | None:
    """The number in a word in the notation of solvers, or None."""
    return float(_plain(text)) if is_number(text) else None


def numbers(data: bytes, start: int, stop: int) -> Floats:
    """The numbers in a text that has one on each line from byte `start` to `stop`.

    Raises SolutionError with the line of a word that is not a number, or of a missing new line.
    """
    return labelled_numbers(data, start, stop, 1, label=0, numeric=(0,))[1][:, 0].copy()


def named_numbers(data: bytes, start: int, stop: int, per_line: int) -> tuple[Bytes, Floats]:
    """Names (k,) and values (k,) of a text whose lines are `name value ...` with `per_line` words each.

    Words after the value must be numbers too, and are left out. Raises SolutionError with the line at fault.
    """
    names, values = labelled_numbers(data, start, stop, per_line, label=0, numeric=tuple(range(1, per_line)))
    return names, values[:, 0].copy()


def labelled_numbers(
    data: bytes, start: int, stop: int, per_line: int, *, label: int, numeric: tuple[int, ...]
) -> tuple[Bytes, Floats]:
    """Labels (k,) and numbers (k, len(numeric)) of a text of lines of `per_line` words.

    label, numeric: places of the label and of the numbers among the words of a line; others are left out.
    Raises SolutionError with the line at fault.
    """
    # Not `*+`: in Python 3.11.2 a line that does not match moves the end of such a repetition.
    lines = re.compile(b"(?:%b)*" % _line_of(per_line, numeric), re.IGNORECASE)
    names: list[Bytes] = [np.empty(0, dtype="S1")]
    values = [np.empty((0, len(numeric)))]
    for begin, end in _pieces(data, start, stop):
        read = lines.match(data, begin, end)
        if read is None or read.end() < end:
            raise _line_fault(data, read.end() if read else begin, per_line, numeric)
        words = data[begin:end].split()
        names.append(np.array(words[label::per_line]))
        values.append(np.stack([_floats(words[at::per_line]) for at in numeric], axis=1))
    return np.concatenate(names), np.concatenate(values)


def named_pairs(names: list[str], values: Sequence[float] | Floats) -> tuple[Bytes, Floats]:
    """Names and values of a document as arrays. Raises SolutionError for a long name or NaN."""
    long = next((name for name in names if len(name) > TOKEN_LIMIT), None)
    if long is not None:
        raise SolutionError(
            f"the name {shown(long.encode(errors='replace'))}... has more than {TOKEN_LIMIT} characters; "
            "give the solution of the file that was written"
        )
    numbers_ = np.array(values, dtype=np.float64)
    if np.isnan(numbers_).any():
        at = int(np.argmax(np.isnan(numbers_)))
        raise SolutionError(f"{names[at]} has no value; let the solver write the file again")
    return np.array([name.encode(errors="replace") for name in names] or np.empty(0, "S1")), numbers_


def words_of_line(data: bytes, position: int) -> list[bytes]:
    """The words of the line that begins at a byte position; none at the end of the text."""
    end = data.find(b"\n", position)
    return data[position : len(data) if end < 0 else end].split()


def _line_of(per_line: int, numeric: tuple[int, ...]) -> bytes:
    """Pattern of a line of `per_line` words, of which some are numbers."""
    words = [_WORD + _NUMBER.pattern if at in numeric else _WORD + rb"\S++" for at in range(per_line)]
    return rb"[ \t]*+%b[ \t]*+\n" % rb"[ \t]++".join(words)


def _pieces(data: bytes, start: int, stop: int) -> Iterator[tuple[int, int]]:
    """Start and end of pieces of whole lines."""
    while start < stop:
        end = data.rfind(b"\n", start, min(start + _PIECE, stop)) + 1 or data.find(b"\n", start, stop) + 1
        if not end:
            raise fault(data, start, "the file is cut off in the middle of this line")
        yield start, end
        start = end


def _line_fault(data: bytes, start: int, per_line: int, numeric: tuple[int, ...]) -> SolutionError:
    """The error about the line from byte `start` on, which does not have these words."""
    text = data[start : data.index(b"\n", start)]
    words = text.split()
    if _NOT_TEXT.search(text):
        return fault(data, start, "there is a byte that is not text; the file is damaged")
    if len(words) != per_line:
        return fault(data, start, f"{len(words)} words stand where {per_line} should")
    if max(map(len, words)) > TOKEN_LIMIT:
        return fault(data, start, f"a word is longer than {TOKEN_LIMIT} characters")
    wrong = next(words[at] for at in numeric if not is_number(words[at]))
    return fault(data, start, f"{shown(wrong)} is not a number")


def _floats(words: list[bytes]) -> Floats:
    """The numbers in words that are numbers. Python's own rounding: exact."""
    return np.fromstring(_plain(b" ".join(words)), sep=" ")


def _plain(text: bytes) -> bytes:
    """Numbers in the notation of solvers as Python reads them."""
    text = text.translate(_FORTRAN)
    return _WINDOWS_INFINITY.sub(b"inf", text) if b"#" in text else text


def _number(data: bytes, position: int, text: bytes) -> float:
    value = number_of(text)
    if value is None:
        raise fault(data, position, f"{shown(text)} is not a number")
    return value
