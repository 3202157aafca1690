"""Blocks of equal records as bytes: one template, holes filled by NumPy, no Python per record.

A record is a list of parts: literal bytes, words from a table (names, numbers) or decimal integers. A block
of records is a matrix of bytes, one row per record. Literals are laid out once; a hole is filled for all
records of the block by one strided copy of whole words. Words of different length in a block are
padded with NUL, and the padding is dropped in one step. Names of one family all have one length, so most
blocks have none. Memory is one block for any number of records.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from ...models.errors import UnsupportedByFormatError
from ...models.formulations.names import Bytes, digits
from ...models.instance.domain import Bools, Floats

Cells = NDArray[Any]
"""Words of equal length, one item each."""
Texts = NDArray[np.bytes_]

BLOCK: Final = 8192
"""Records per block: their bytes stay in the processor's cache."""
_BITS: Final = 16  # optional pieces whose patterns are numbered without renumbering

LEAST_COEFFICIENT: Final = 1e-9
COEFFICIENT_LIMIT: Final = 1e15
"""Readers drop or refuse coefficients outside (LEAST, MOST): docs/format-rules.md, W5 and M23."""

_FEW: Final = 100
"""Whole numbers within so small a range are numbered without sorting."""


class Hole(Protocol):
    """A hole of a record, filled for the records start..stop."""

    @property
    def width(self) -> int:
        """Bytes of the longest text."""

    def cells(self, start: int, stop: int) -> tuple[Cells, bool]:
        """The bytes of these records, one item each, and whether some are padded with NUL."""


@dataclass(frozen=True, eq=False)
class Words:
    """Words of a table (k, width), one per record by its code; without codes, in order."""

    table: Bytes
    codes: NDArray[Any] | None

    @property
    def width(self) -> int:
        """Bytes of the longest word."""
        return int(self.table.shape[1])

    @cached_property
    def _has_padding(self) -> bool:
        return bool((self.table[:, -1] == 0).any())

    @cached_property
    def _words(self) -> Cells:
        return cells_of_rows(np.ascontiguousarray(self.table))

    def cells(self, start: int, stop: int) -> tuple[Cells, bool]:
        """The words of these records."""
        words = self._words[start:stop] if self.codes is None else self._words.take(self.codes[start:stop])
        return words, self._has_padding

    def at(self, codes: NDArray[Any]) -> Words:
        """Return this table with other codes."""
        return Words(self.table, codes if self.codes is None else self.codes[codes])


@dataclass(frozen=True, eq=False)
class Decimals:
    """Integers >= 0 in decimal, one per record, without leading zeros."""

    values: NDArray[Any]

    @property
    def width(self) -> int:
        """Digits of the largest value."""
        return len(str(int(self.values.max(initial=0))))

    def cells(self, start: int, stop: int) -> tuple[Cells, bool]:
        """The digits of these records; without padding if all have the same number, as in most blocks."""
        values = self.values[start:stop]
        width, least = len(str(int(values.max()))), len(str(int(values.min())))
        out = digits(values, width)
        for place in range(width - least):
            out[values < 10 ** (width - 1 - place), place] = 0
        return cells_of_rows(out), least < width


@dataclass(frozen=True, eq=False)
class RawValues:
    """Values as little-endian bytes, one per record: for binary files."""

    values: NDArray[Any]

    @property
    def width(self) -> int:
        """Bytes of one value."""
        return int(self.values.dtype.itemsize)

    def cells(self, start: int, stop: int) -> tuple[Cells, bool]:
        """These values."""
        return self.values[start:stop], False


@dataclass(frozen=True, eq=False)
class TaggedWords:
    """Words after a tag that all records share: names of one family."""

    tag: bytes
    words: Words

    @property
    def width(self) -> int:
        """Bytes of the longest one."""
        return len(self.tag) + self.words.width

    def at(self, codes: NDArray[Any]) -> TaggedWords:
        """Return these names with other codes."""
        return TaggedWords(self.tag, self.words.at(codes))


Piece = bytes | Hole | TaggedWords
Pieces = Sequence[Piece]


@dataclass(frozen=True, eq=False)
class OptionalPieces:
    """Pieces that only some records have."""

    present: Bools
    pieces: Pieces


def render(parts: Sequence[Piece | OptionalPieces], count: int, *, padded: bool = True) -> Iterator[bytes]:
    """The bytes of `count` records, block by block. padded: drop NUL bytes (never for binary records)."""
    if count == 0 or not parts:
        return
    template = _Template(parts)
    for start in range(0, count, BLOCK):
        line, gaps = template.line(start, min(start + BLOCK, count))
        yield line[line != 0].tobytes() if padded and gaps else line.tobytes()


class _Template:
    """The pieces of a record and the bytes of the present block: literals stay, holes are filled again.

    A hole is as wide as the words of its block need, so the matrix is laid out again when a width changes,
    which is rare.
    """

    def __init__(self, parts: Sequence[Piece | OptionalPieces]) -> None:
        self._pieces: list[bytes | Hole] = []
        self._optional: list[tuple[slice, Bools]] = []
        for part in parts:
            first = len(self._pieces)
            for piece in part.pieces if isinstance(part, OptionalPieces) else (part,):
                self._pieces += [piece.tag, piece.words] if isinstance(piece, TaggedWords) else [piece]
            if isinstance(part, OptionalPieces):
                self._optional.append((slice(first, len(self._pieces)), part.present))
        self._parts = {id(piece): piece for piece in self._pieces if not isinstance(piece, bytes)}
        self._widths: list[int] = []

    def line(self, start: int, stop: int) -> tuple[Bytes, bool]:
        """The bytes of these records in a row, and whether there are NUL bytes to drop."""
        cells, padded = {}, False
        for key, part in self._parts.items():
            cells[key], gaps = part.cells(start, stop)
            padded |= gaps
        self._lay_out(cells, stop - start)
        for hole, key in self._holes:
            hole[: stop - start] = cells[key]
        present = [where[start:stop] for _, where in self._optional]
        if all(where.all() for where in present):
            return self._matrix[: stop - start].reshape(-1), padded
        return self._chosen(present), padded

    def _lay_out(self, cells: dict[int, Cells], rows: int) -> None:
        """Set literals and the positions of holes after a width has changed."""
        widths = [
            len(piece) if isinstance(piece, bytes) else cells[id(piece)].dtype.itemsize
            for piece in self._pieces
        ]
        if widths == self._widths:
            return
        self._widths, self._ends = widths, [0, *accumulate(widths)]
        texts = (
            piece if isinstance(piece, bytes) else bytes(width)
            for piece, width in zip(self._pieces, widths, strict=True)
        )
        self._matrix = np.tile(np.frombuffer(b"".join(texts), dtype=np.uint8), (rows, 1))
        self._holes = [
            (self._column(first, cells[id(piece)].dtype), id(piece))
            for first, piece in zip(self._ends, self._pieces, strict=False)
            if not isinstance(piece, bytes)
        ]

    def _column(self, first: int, kind: Any) -> Cells:
        """The column of the matrix that begins at a byte, one item per record."""
        return np.ndarray((len(self._matrix),), kind, self._matrix, first, (self._matrix.shape[1],))

    def _chosen(self, present: Sequence[Bools]) -> Bytes:
        """The bytes of the present records without their missing pieces.

        Few patterns of presence occur: adjacent bytes of one pattern are moved for all of its
        records at once.
        """
        pattern = np.zeros(len(present[0]), dtype=np.intp)
        for number, where in enumerate(present):
            pattern = 2 * pattern + where
            if number >= _BITS:  # a column may be in rows of fifty kinds, as with long cycles
                pattern = np.unique(pattern, return_inverse=True)[1]
        there = np.bincount(pattern)
        records = {number: np.flatnonzero(pattern == number) for number in np.flatnonzero(there).tolist()}
        found = {
            number: self._stretches([bool(where[at[0]]) for where in present])
            for number, at in records.items()
        }
        lengths = np.zeros(len(there), dtype=np.intp)
        lengths[list(found)] = [sum(last - first for first, last in runs) for runs in found.values()]
        ends = np.cumsum(lengths[pattern])
        line = np.empty(ends[-1], dtype=np.uint8)
        for number, runs in found.items():
            at = records[number]
            to = ends[at] - lengths[number]
            for first, last in runs:
                kind = f"V{last - first}"
                anywhere = np.ndarray((len(line) - (last - first) + 1,), kind, line, 0, (1,))
                anywhere[to] = self._column(first, kind)[at]
                to += last - first
        return line

    def _stretches(self, present: Sequence[bool]) -> list[tuple[int, int]]:
        """First and last byte of adjacent pieces in a record that has these optional pieces."""
        cuts = [0]
        for (place, _), there in zip(self._optional, present, strict=True):
            if not there:
                cuts += [self._ends[place.start], self._ends[place.stop]]
        cuts.append(self._ends[-1])
        return [(first, last) for first, last in zip(cuts[::2], cuts[1::2], strict=True) if first < last]


def cells_of_rows(matrix: Bytes) -> Cells:
    """The rows of a matrix of bytes (count, width), each contiguous, as items that NumPy moves as a whole."""
    width = matrix.shape[1]
    kind = f"u{width}" if width in {1, 2, 4, 8} else f"V{width}"
    return matrix.view(kind)[:, 0]


def word_table(words: Sequence[bytes]) -> Bytes:
    """Words as a matrix of bytes padded with NUL."""
    return bytes_of_texts(np.array(words, dtype=np.bytes_) if len(words) else np.zeros(0, "S1"))


def bytes_of_texts(texts: Texts) -> Bytes:
    """An array of texts as a matrix of bytes padded with NUL, as wide as the longest."""
    width = int(np.strings.str_len(texts).max(initial=1))
    return np.ascontiguousarray(texts).view(np.uint8).reshape(len(texts), texts.itemsize)[:, :width]


def texts_of_bytes(matrix: Bytes) -> Texts:
    """The texts in the rows of a matrix of bytes padded with NUL: the inverse of `bytes_of_texts`."""
    return np.ascontiguousarray(matrix).view(f"S{matrix.shape[1]}").ravel()


def number_text(value: float) -> str:
    """The shortest text that reads back as exactly this double: 3, 0.1, 1e-06."""
    value = float(value)
    if value.is_integer() and abs(value) < COEFFICIENT_LIMIT:
        return str(int(value))
    return repr(value)


def number_texts(values: Floats) -> Texts:
    """The shortest texts that read back as exactly these doubles, as from `number_text`."""
    are_whole = (np.rint(values) == values) & (np.abs(values) < COEFFICIENT_LIMIT)
    texts = np.zeros(len(values), dtype="S24")
    for places, some in ((are_whole, values[are_whole].astype(np.int64)), (~are_whole, values[~are_whole])):
        if len(some):
            texts[places] = repr(some.tolist())[1:-1].encode().split(b", ")
    return texts


def signed_texts(values: Floats) -> Texts:
    """The numbers after their sign and a blank: `+ 3`, `- 0.5`."""
    return np.strings.add(np.where(values < 0, b"- ", b"+ "), number_texts(np.abs(values)))


def bound_texts(values: Floats) -> Texts:
    """Numbers, `-inf` or `+inf` (docs/format-rules.md, W4)."""
    return np.where(values == np.inf, np.bytes_(b"+inf"), number_texts(values))


def words(values: Floats | float, text: Callable[[Floats], Texts] = number_texts) -> bytes | Words:
    """Numbers as words: literal bytes for one number or equal ones, else a table of the distinct ones."""
    doubles = np.asarray(values, dtype=np.float64) + 0.0  # no -0.0
    first = doubles.ravel()[:1]
    if len(first) and (doubles == first).all():
        return bytes(text(first)[0])
    distinct, codes = _distinct_numbers(doubles)
    return Words(bytes_of_texts(text(distinct)), codes)


def _distinct_numbers(values: Floats) -> tuple[Floats, NDArray[Any]]:
    """Ascending numbers that include all `values`, and the place of each; few whole ones are not sorted."""
    least, most = (float(values.min()), float(values.max())) if len(values) else (0.0, -1.0)
    few = 0 <= most - least < _FEW and max(-least, most) < COEFFICIENT_LIMIT
    if few and (values == np.rint(values)).all():
        return np.arange(least, most + 1), (values - least).astype(np.uint8)
    distinct, _, codes = np.unique(values, return_index=True, return_inverse=True)
    return distinct, codes


def check_coefficients(values: Floats | float, where: str) -> None:
    """Raise UnsupportedByFormatError unless every nonzero coefficient lies in [1e-9, 1e15)."""
    size = np.abs(np.atleast_1d(np.asarray(values, dtype=np.float64)))
    wrong = ~np.isfinite(size) | (size >= COEFFICIENT_LIMIT) | ((size < LEAST_COEFFICIENT) & (size > 0))
    if wrong.any():
        worst = float(size[wrong][0])
        remedy = _LARGER if worst < LEAST_COEFFICIENT else _SMALLER
        raise UnsupportedByFormatError(
            f"{where} has the coefficient {worst!r}; "
            f"readers drop or refuse values outside [1e-9, 1e15): {remedy}"
        )


_LARGER: Final = (
    "make w, the stroke weight or the skew weight larger (0 removes a term), "
    "or the direction of a stroke that is nearly horizontal exactly 0"
)
_SMALLER: Final = "make the stroke weight or the skew weight smaller"
