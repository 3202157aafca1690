"""Lines of text files that programs write: their encoding, and rows of numbers."""

from __future__ import annotations

import codecs
import re
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .errors import CrossfieldError, InputError, quote_line

Lines = list[tuple[int, bytes]]
"""Lines of a file and their numbers, from 1."""

_NUMBERS: Final = re.compile(
    rb"(?:[ \t]*+[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?(?![^ \t]))*+[ \t]*+"
)
_NOTATIONS: Final = (
    (re.compile(rb"\d,\d"), "; write decimal points instead of commas"),
    (re.compile(rb"[\d.][dD][-+]?\d"), "; write exponents with E instead of Fortran's D"),
)
"""Notations of numbers that no reader takes, and remedies."""


def plain_text(data: bytes, error: type[CrossfieldError] = InputError) -> bytes:
    r"""The text in UTF-8 without a byte order mark, with \n at the end of its lines. Raises the error."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        try:
            data = data.decode("utf-16").encode()
        except UnicodeError:
            raise error("the text in UTF-16 is damaged or cut off; save it again") from None
    data = data.removeprefix(codecs.BOM_UTF8)
    return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in data else data


def filled_lines(text: bytes, first: int = 1) -> Lines:
    """The lines of a text, as `plain_text` returns it, that are not blank; first: number of the first one."""
    return [(number, line) for number, line in enumerate(text.split(b"\n"), first) if line.strip()]


def number_rows(
    rows: Lines,
    width: int = 0,
    meaning: str = "",
    error: type[CrossfieldError] = InputError,
    *,
    more: bool = False,
) -> NDArray[np.float64]:
    """The first numbers (k, width) of lines. Raises the error that names the line and the meaning.

    width: numbers of a line; 0 for any, which are returned as (k, 1). more: whether more may follow in a
    line.
    """
    words: list[bytes] = []
    for number, line in rows:
        row = line.split()
        if len(row) < width or (len(row) > width > 0 and not more):
            raise error(f"line {number}: has {len(row)} numbers; give {width}, {meaning}")
        if not _NUMBERS.fullmatch(line):
            remedy = next((remedy for notation, remedy in _NOTATIONS if notation.search(line)), "")
            raise error(f"line {number}: holds something other than numbers: {quote_line(line)}{remedy}")
        words += row[: width or None]
    return np.array(words, dtype=np.float64).reshape(-1, width or 1)
