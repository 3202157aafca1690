"""Blocks of equal records as bytes: one template, holes filled by NumPy, no Python per record.

A record is a list of parts: literal bytes, words from a table (names, numbers) or decimal integers. A block of records is a matrix of
bytes, one row a record; parts narrower than their column are padded with NUL, and the padding is dropped in one step.
Memory is one block (some thousand records) however many records there are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from ..models.errors import UnsupportedByFormatError
from ..models.grid import Floats

Bytes = NDArray[np.uint8]

BLOCK: Final = 8192
"""Records per block: their bytes stay in the processor's cache."""

LEAST: Final = 1e-9
MOST: Final = 1e15
"""Readers drop or refuse coefficients outside (LEAST, MOST): formats.md, rule 10 and M23."""


class Part(Protocol):
    """A hole of a record: `width` bytes, filled for the records start..stop."""

    @property
    def width(self) -> int:
        """Bytes of the longest one."""

    def fill(self, out: Bytes, start: int, stop: int) -> None:
        """Write the bytes of these records into `out` [stop - start, width], padded with NUL."""


@dataclass(frozen=True, eq=False)
class Words:
    """Words of a table (k, width), one per record by its code."""

    table: Bytes
    codes: NDArray[Any] | None

    @property
    def width(self) -> int:
        """Bytes of the longest word."""
        return int(self.table.shape[1])

    def fill(self, out: Bytes, start: int, stop: int) -> None:
        """The words of these records."""
        if self.codes is None:
            out[:] = self.table[start:stop]
        else:
            np.take(self.table, self.codes[start:stop], axis=0, out=out, mode="clip")

    def at(self, codes: NDArray[Any]) -> Words:
        """The same table, read through other codes."""
        return Words(self.table, codes if self.codes is None else self.codes[codes])


@dataclass(frozen=True, eq=False)
class Decimals:
    """Integers >= 0 in decimal, one per record, without leading zeros."""

    values: NDArray[Any]

    @property
    def width(self) -> int:
        """Digits of the largest value."""
        return len(str(int(self.values.max(initial=0))))

    def fill(self, out: Bytes, start: int, stop: int) -> None:
        """The digits of these records, leading zeros as padding."""
        values = self.values[start:stop]
        out[:] = digits(values, self.width)
        for place in range(self.width - 1):
            out[values < 10 ** (self.width - 1 - place), place] = 0


@dataclass(frozen=True, eq=False)
class Raw:
    """Values in their own little-endian bytes, one per record: for binary files."""

    values: NDArray[Any]

    @property
    def width(self) -> int:
        """Bytes of one value."""
        return int(self.values.dtype.itemsize)

    def fill(self, out: Bytes, start: int, stop: int) -> None:
        """The bytes of these values."""
        out[:] = (
            np.ascontiguousarray(self.values[start:stop]).view(np.uint8).reshape(stop - start, self.width)
        )


Pieces = Sequence["bytes | Part"]


def render(parts: Pieces, count: int, *, padded: bool = True) -> Iterator[bytes]:
    """The bytes of `count` records, block by block. padded: drop NUL bytes (never for binary records)."""
    if count == 0 or not parts:
        return
    widths = [len(part) if isinstance(part, bytes) else part.width for part in parts]
    ends = np.cumsum(widths)
    buffer = np.empty((min(BLOCK, count), int(ends[-1])), dtype=np.uint8)
    for part, end, width in zip(parts, ends, widths, strict=True):
        if isinstance(part, bytes):
            buffer[:, end - width : end] = np.frombuffer(part, dtype=np.uint8)
    for start in range(0, count, BLOCK):
        stop = min(start + BLOCK, count)
        block = buffer[: stop - start]
        for part, end, width in zip(parts, ends, widths, strict=True):
            if not isinstance(part, bytes):
                part.fill(block[:, end - width : end], start, stop)
        flat = block.reshape(-1)
        yield flat[flat != 0].tobytes() if padded else flat.tobytes()


def digits(values: NDArray[Any], width: int) -> Bytes:
    """Decimal digits with leading zeros, shape (len(values), width)."""
    out = np.empty((len(values), width), dtype=np.uint8)
    rest = values.astype(np.int64)
    for place in range(width - 1, -1, -1):
        rest, digit = np.divmod(rest, 10)
        out[:, place] = digit + ord("0")
    return out


def table(words: Sequence[bytes]) -> Bytes:
    """Words as a matrix of bytes padded with NUL."""
    width = max((len(word) for word in words), default=1)
    return np.frombuffer(b"".join(word.ljust(width, b"\0") for word in words), dtype=np.uint8).reshape(
        len(words), width
    )


def number(value: float) -> str:
    """The shortest text that reads back as exactly this double: 3, 0.1, 1e-06, +inf never."""
    value = float(value)
    if value.is_integer() and abs(value) < MOST:
        return str(int(value))
    return repr(value)


def signed(value: float) -> str:
    """The number after its sign and a blank: `+ 3`, `- 0.5`."""
    return f"- {number(-value)}" if value < 0 else f"+ {number(value)}"


def words(values: Floats | float, text: Callable[[float], str] = number) -> bytes | Words:
    """Numbers as words: literal bytes for one number, a table of the distinct ones for an array."""
    if np.ndim(values) == 0:
        return text(float(values)).encode()
    distinct, codes = np.unique(np.asarray(values, dtype=np.float64) + 0.0, return_inverse=True)
    return Words(table([text(value).encode() for value in distinct.tolist()]), codes)


def check_coefficients(values: Floats | float, where: str) -> None:
    """Nothing, when every coefficient but zero lies in [1e-9, 1e15); else raises UnsupportedByFormatError."""
    size = np.abs(np.atleast_1d(np.asarray(values, dtype=np.float64)))
    wrong = ~np.isfinite(size) | (size >= MOST) | ((size < LEAST) & (size > 0))
    if wrong.any():
        raise UnsupportedByFormatError(
            f"{where} has the coefficient {size[wrong][0]!r}; readers drop or refuse what is outside [1e-9, 1e15): change w, w_strokes or w_beta"
        )
