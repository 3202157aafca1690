"""Readers of solution files: one table, and the choice among them by content."""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ..models.errors import SolutionError
from ..models.storage import read_bytes
from . import ampl_sol, highs_sol
from .solution_text import HEAD, RawSolution

_GZIP: Final = b"\x1f\x8b"
_LARGEST: Final = 1 << 31  # bytes that a packed file may unpack to


@dataclass(frozen=True)
class Reader:
    """A reader of one kind of file.

    recognises: whether a file with these first bytes is of this kind. parse: the content of a whole file; raises
    SolutionError.
    """

    name: str
    description: str
    recognises: Callable[[bytes], bool]
    parse: Callable[[bytes], RawSolution]


READERS: Final = (
    Reader(
        highs_sol.NAME, "HiGHS, solution style 0 (raw) or 4 (sparse)", highs_sol.recognises, highs_sol.parse
    ),
    Reader(ampl_sol.BINARY, "AMPL .sol, binary", ampl_sol.recognises_binary, ampl_sol.parse_binary),
    Reader(ampl_sol.TEXT, "AMPL .sol, text", ampl_sol.recognises_text, ampl_sol.parse_text),
)


def read_raw(path: str | Path) -> RawSolution:
    """What a solution file says; its kind is told by its content, and gzip is unpacked.

    Raises InputError when the file cannot be opened, SolutionError when it is empty, of no known kind or malformed.
    """
    data = read_bytes(path)
    try:
        return parse_raw(_unpacked(data))
    except SolutionError as error:
        raise SolutionError(str(error), file=path) from error


def parse_raw(data: bytes) -> RawSolution:
    """What the content of a solution file says. Raises SolutionError."""
    if not data or data.isspace():
        raise SolutionError("the file is empty; the solver's log should say why it wrote no solution")
    head = data[:HEAD]
    for reader in READERS:
        if reader.recognises(head):
            return reader.parse(data)
    known = "; ".join(reader.description for reader in READERS)
    raise SolutionError(f"this is no solution file of a known kind; give one of these: {known}")


def _unpacked(data: bytes) -> bytes:
    if not data.startswith(_GZIP):
        return data
    try:
        content = gzip.GzipFile(fileobj=io.BytesIO(data)).read(_LARGEST + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise SolutionError("the packed file is damaged or cut off; pack it again") from error
    if len(content) > _LARGEST:
        raise SolutionError("the packed file is larger than 2 GiB; unpack it first")
    return content
