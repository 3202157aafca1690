"""AMPL solution files (.sol): text and binary are read, text is written.

Text, as the AMPL Solver Library writes it (writesol.c, readsol.c of ampl/asl and ampl/mp):

    optimal solution found          message: Bonmin and Couenne begin with an empty line
                                    an empty line
    Options
    3                               number k of options, the first number of the .nl file
    1
    1
    0
    2                               number of constraints
    0                               number of dual values that follow: all or none
    5                               number of variables
    5                               number of values that follow: all or none
    10                              dual values, then values, in the order of the .nl file
    ...
    objno 0 0                       objective's number and solve code; code or line may be missing
    suffix ...                      suffixes and other text, not needed here

The options are those of the .nl file: ours have no tolerance (vbtol), and their .sol have the Options block,
without which duals and values could not be distinguished. The fourth option of ours is the stamp of the
problem (export/writing/stamps.py). The binary form has the same parts as records
between their lengths, as in Fortran: integers of 4 bytes, numbers of 8, low byte first.

The solve code states only `solved`. It counts as a global proof only if the message names a solver that
proves global optimality. Ipopt, Knitro and Bonmin (exact for convex problems) do not, and Couenne is
excluded because it reports Optimal at its time limit (AmplNLWriter.jl#160). Codes: ampl/mp,
include/mp/common.h.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from ....models.errors import SolutionError
from ....models.instance.domain import Floats
from ....models.storage import replacing
from ...statuses import status_of_ampl
from ...writing.stamps import digits_of_option, stamp_option
from .grammar import HEAD, EntryForm, line_error, place_of_entry, quoted
from .text import Cursor, RawSolution, Reader, one_line, read_entries, starts_with

_OPTIONS = re.compile(rb"^Options[ \t]*\n", re.MULTILINE)
_OBJNO = re.compile(rb"^objno\b.*", re.MULTILINE)
_CODE = re.compile(rb"objno[ \t]+\d{1,9}(?:[ \t]+(-?\d{1,9}))?[ \t]*")
_NUMBERS: Final = EntryForm("value")
_MOST_OPTIONS: Final = 16
_CODE_DIGITS: Final = 3
_OUR_OPTIONS: Final = (1, 1, 0)  # and the stamp, as in the first line of our .nl files
_LONGEST_MESSAGE: Final = 10_000
_OPTIONS_WORD: Final = b"Options"
_MAGIC: Final = b"\x06\0\0\0binary\x06\0\0\0"


def _recognises_text(head: bytes) -> bool:
    return _OPTIONS.search(head) is not None


def parse_text(data: bytes) -> RawSolution:
    """Read a text file. Raises SolutionError if it is cut off or numbers do not fit."""
    heading = _OPTIONS.search(data, 0, HEAD)
    assert heading
    cursor = Cursor(data, heading.end())
    counts = _read_counts(cursor)
    values = _read_values(cursor, counts)
    code = _read_code(cursor)
    return _solution(data[: heading.start()], code, values, counts)


class _Counts(NamedTuple):
    """The four counts of the Options block, and the digits of the stamp among the options."""

    rows: int
    duals: int
    columns: int
    values: int
    stamps: frozenset[str] = frozenset()

    @property
    def complaint(self) -> str | None:
        """The contradiction between the counts, if any."""
        if self.duals in {0, self.rows} and self.values in {0, self.columns}:
            return None
        return (
            f"{self.duals} dual values are announced for {self.rows} constraints "
            f"and {self.values} values for {self.columns} variables, where all or none should be"
        )


def _read_counts(cursor: Cursor) -> _Counts:
    count = cursor.count("the number of options")
    if count > _MOST_OPTIONS:
        raise cursor.fault(f"{count} options are announced")
    options = [cursor.integer("an option") for _ in range(count)]
    rows, duals, columns, values = (cursor.count("a count of rows, columns or values") for _ in range(4))
    counts = _Counts(rows, duals, columns, values, _stamps(options))
    if counts.complaint:
        raise cursor.fault(counts.complaint)
    return counts


def _stamps(options: Sequence[int]) -> frozenset[str]:
    """Digits of the stamp in the options, which only our .nl files have."""
    ours = len(options) == len(_OUR_OPTIONS) + 1 and tuple(options[:-1]) == _OUR_OPTIONS
    return digits_of_option(options[-1]) if ours else frozenset()


def _read_values(cursor: Cursor, counts: _Counts) -> Floats:
    """The primal values; the cursor moves behind them."""
    needed = counts.duals + counts.values
    numbers = read_entries(cursor.data, cursor.position, _NUMBERS)
    held = len(numbers.values)
    if held > needed:
        place = place_of_entry(cursor.data, cursor.position, needed)
        raise line_error(cursor.data, place, "there are more numbers than announced")
    if held < needed:
        next_lines = cursor.data[numbers.end :].lstrip().split(b"\n", 1)
        if len(next_lines) > 1 and not _OBJNO.match(next_lines[0]):
            raise line_error(cursor.data, numbers.end, _NUMBERS.fault(next_lines[0]))
        raise cursor.fault(f"{needed} numbers are announced, {held} whole lines follow; the file is cut off")
    cursor.position = numbers.end
    return numbers.values[counts.duals :].copy()


def _read_code(cursor: Cursor) -> int | None:
    """The solve code, or None when the file has none, or one that may be cut off."""
    match = _OBJNO.search(cursor.data, cursor.position)
    if match is None:
        return None
    cursor.position = match.start()
    line = cursor.line("the solve code")
    code = _CODE.fullmatch(line)
    if code is None:
        raise cursor.fault(f"{quoted(line)} is not the number of the objective and a solve code")
    digits = code[1] or b""
    is_complete = (
        cursor.data.endswith(b"\n") or not cursor.at_end or digits == b"0" or len(digits) == _CODE_DIGITS
    )
    return int(digits) if digits and is_complete else None


def _solution(message: bytes, code: int | None, values: Floats, counts: _Counts) -> RawSolution:
    words = one_line(message)
    if code is not None and 0 <= code <= 99 and not values.size:
        raise SolutionError("the file states solved but holds no values; let the solver write the file again")
    status = status_of_ampl(code, words, with_point=values.size > 0)
    return RawSolution(status, words, None, None, values, rows=counts.rows, stamps=counts.stamps)


def parse_binary(data: bytes) -> RawSolution:
    """Read a binary file. Raises SolutionError if it is cut off or does not fit."""
    records = _Records(data, len(_MAGIC))
    message = b"\n".join(iter(records.take, b""))
    counts = records.take_counts()
    duals, values = records.take_numbers("dual values"), records.take_numbers("values")
    if (duals.size, values.size) != (counts.duals, counts.values):
        raise records.fault(
            f"{counts.duals} dual values and {counts.values} values are announced, "
            f"{duals.size} and {values.size} follow"
        )
    if np.isnan(values).any():
        raise records.fault("one of the values is not a number")
    return _solution(message, records.take_code(), values, counts)


@dataclass
class _Records:
    """A position in a binary file that moves on record by record."""

    data: bytes
    position: int

    def fault(self, text: str) -> SolutionError:
        return SolutionError(f"byte {self.position}: {text}; let the solver write the file again")

    def take(self) -> bytes:
        """The next record."""
        start = self.position + 4
        length = self._length(self.position)
        end = start + length
        if self._length(end) != length:
            raise self.fault(f"a record of {length} bytes does not end at its stated length")
        self.position = end + 4
        return self.data[start:end]

    def _length(self, at: int) -> int:
        if at + 4 > len(self.data):
            raise self.fault("the file is cut off in this record")
        return int.from_bytes(self.data[at : at + 4], "little")

    def take_counts(self) -> _Counts:
        """The counts of the Options record."""
        record = self.take()
        size = len(record) - len(_OPTIONS_WORD)
        if not record.startswith(_OPTIONS_WORD) or size % 4:
            raise self.fault("no Options record follows the message")
        count, *numbers = struct.unpack(f"<{size // 4}i", record[len(_OPTIONS_WORD) :]) or (0,)
        if not 0 <= count <= _MOST_OPTIONS or len(numbers) != count + 4:
            raise self.fault(f"the Options record of {len(record)} bytes announces {count} options")
        *options, rows, duals, columns, values = numbers
        return self._check_counts(_Counts(rows, duals, columns, values, _stamps(options)))

    def _check_counts(self, counts: _Counts) -> _Counts:
        if min(counts[:4]) < 0 or counts.complaint:
            raise self.fault(counts.complaint or "a count is negative")
        return counts

    def take_numbers(self, kind: str) -> Floats:
        record = self.take()
        if len(record) % 8:
            raise self.fault(f"{len(record)} bytes cannot hold {kind} of 8 bytes")
        return np.frombuffer(record, "<f8").astype(np.float64)

    def take_code(self) -> int | None:
        """The solve code, or None when the file has none."""
        if self.position == len(self.data):
            return None
        record = self.take()
        if len(record) not in {4, 8}:
            raise self.fault(f"a record of {len(record)} bytes stands where the solve code should")
        return int(struct.unpack("<2i", record)[1]) if len(record) == 8 else None


def write_ampl_sol(
    path: str | Path,
    message: str,
    primal: Floats,
    rows: int,
    code: int,
    *,
    columns: int | None = None,
    stamp: str = "",
) -> Path:
    """Write an AMPL solution file in text form and return its path.

    primal: values (n,) in the order of the .nl file, or empty when there is no point; then `columns` gives n.
    rows: number of constraints. code: solve code as in the head of this module. stamp: of the problem, if it
    is to identify it. Reading gives the same numbers, bit by bit.

    Raises SolutionError when a value is not finite, OutputError when the file cannot be written.
    """
    primal = np.asarray(primal, dtype=np.float64)
    if not np.isfinite(primal).all():
        raise SolutionError("the solver returned a value that is not finite; nothing was written", file=path)
    options = (*_OUR_OPTIONS, *([stamp_option(stamp)] if stamp else []))
    numbers = (len(options), *options, rows, 0, len(primal) if columns is None else columns, len(primal))
    with replacing(path) as stream:
        stream.writelines(_text_parts(message, primal, numbers, code))
    return Path(path)


def _text_parts(message: str, primal: Floats, numbers: tuple[int, ...], code: int) -> Iterator[bytes]:
    """The text of a file; numbers: the count of options, the options, and the four counts."""
    lines = message[:_LONGEST_MESSAGE].strip().splitlines()
    words = (one_line(line.encode(errors="replace")) for line in lines)
    # An empty line or this word would end the message.
    harmless = ({"": " ", "Options": "Options."}.get(line, line) for line in words)
    head = ["\n".join(harmless), "", "Options", *numbers]
    yield "\n".join(map(str, head)).encode() + b"\n"
    for start in range(0, len(primal), HEAD):
        text = "\n".join(map(repr, primal[start : start + HEAD].tolist())) + "\n"
        yield text.replace(".0\n", "\n").encode()
    yield f"objno 0 {code}\n".encode()


BINARY: Final = Reader("ampl-binary", "AMPL .sol, binary", starts_with(_MAGIC), parse_binary)
TEXT: Final = Reader("ampl-text", "AMPL .sol, text", _recognises_text, parse_text)
