"""Blocks of equal records as bytes: one template, holes filled by NumPy, no Python per record.

A record is a list of parts: literal bytes, words from a table (names, numbers) or decimal integers. A block
of records is a structured array with a field for each part, which is filled for all records by one strided
copy of whole words. Words of different length in a block are padded with NUL, and the padding is dropped in
one step. Names of one family all have one length, so most blocks have none. Memory is one block for any
number of records.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from ...models.errors import UnsupportedByFormatError
from ...models.formulations.names import Bytes, digits
from ...models.instance.domain import Floats

Cells = NDArray[Any]
"""Words of equal length, one item each."""
Texts = NDArray[np.bytes_]

BLOCK: Final = 8192
"""Records per block: their bytes stay in the processor's cache."""

LEAST_COEFFICIENT: Final = 1e-9
COEFFICIENT_LIMIT: Final = 1e15
"""Readers drop or refuse coefficients outside (LEAST, MOST): docs/format-rules.md, W5 and M23."""


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


def render(parts: Pieces, count: int = 1) -> Iterator[bytes]:
    """The bytes of `count` records, block by block; literals are filled again when a width changes."""
    pieces: list[bytes | Hole] = []
    for part in parts:
        pieces += [part.tag, part.words] if isinstance(part, TaggedWords) else [part]
    pieces = [piece for piece in pieces if not isinstance(piece, bytes) or piece]
    records = np.empty(0, "V1")
    for start in range(0, count if pieces else 0, BLOCK):
        size = min(BLOCK, count - start)
        holes = {id(hole): hole.cells(start, start + size) for hole in pieces if not isinstance(hole, bytes)}
        cells = [np.void(piece) if isinstance(piece, bytes) else holes[id(piece)][0] for piece in pieces]
        kind = np.dtype([(f"{place}", cell.dtype) for place, cell in enumerate(cells)])
        is_new = records.dtype != kind
        records = np.empty(size, kind) if is_new else records[:size]
        for place, cell in enumerate(cells):
            if is_new or cell.ndim:
                records[f"{place}"] = cell
        line = records.view(np.uint8)
        yield (line[line != 0] if any(gaps for _, gaps in holes.values()) else line).tobytes()


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
    runs = np.flatnonzero(np.append(True, doubles[1:] != doubles[:-1])[: len(doubles)])
    distinct, codes = np.unique(doubles[runs], return_inverse=True)  # families have few runs of equal numbers
    return Words(bytes_of_texts(text(distinct)), np.repeat(codes, np.diff(runs, append=len(doubles))))


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
