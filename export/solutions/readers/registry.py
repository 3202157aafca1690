"""The table of readers of solution files, and the choice among them by content."""

from __future__ import annotations

import codecs
import gzip
import io
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from ....models.errors import SolutionError, naming
from ....models.input_limits import MAX_SOLUTION
from ....models.storage import read_bytes
from ...writing.stamps import digits_in_columns, digits_in_text
from . import ampl, baron, cbc, cplex, documents, gams, glpk, gurobi, highs, scip, xpress
from .text import HEAD, RawSolution, Reader, choose, with_unix_ends

_GZIP: Final = b"\x1f\x8b"
_SMALLER: Final = "let the solver write it without columns at 0"

_MODULES = (highs, documents, gurobi, cplex, scip, xpress, cbc, glpk, gams, baron, ampl)
READERS: Final[tuple[Reader, ...]] = tuple(reader for module in _MODULES for reader in module.READERS)
"""The table of readers: the first that recognises a file reads it; no real file matches two."""


def read_raw(path: str | Path, solution: int | None = None) -> RawSolution:
    """Read a solution file; its content determines its kind, and gzip is unpacked.

    solution: number of the solution in a file with several, by default the best. Raises InputError when the
    file cannot be opened or has more than MAX_SOLUTION bytes, SolutionError when it is empty, malformed or of
    an unknown kind.
    """
    data = read_bytes(path, MAX_SOLUTION, _SMALLER)
    with naming(path):
        return parse_raw(_unpacked(data), solution)


def parse_raw(data: bytes, solution: int | None = None) -> RawSolution:
    """Read the content of a solution file, ignoring a byte order mark. Raises SolutionError."""
    data = _without_mark(data)
    if not data or data.isspace():
        raise SolutionError("the file is empty; the solver's log should give the reason")
    head = with_unix_ends(data[:HEAD])
    for reader in READERS:
        if reader.recognises(head):
            raw = choose(reader.parse(with_unix_ends(data) if reader.text else data), solution)
            return replace(raw, reader=reader.name, stamps=raw.stamps | _stamps(head, raw))
    known = "; ".join(reader.description for reader in READERS)
    raise SolutionError(f"this is not a solution file of a known kind; give one of these: {known}")


def _without_mark(data: bytes) -> bytes:
    """The text after a byte order mark, in UTF-8: Windows writes marks, and sometimes UTF-16."""
    if not data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.removeprefix(codecs.BOM_UTF8)
    try:
        return data.decode("utf-16").encode()
    except UnicodeError as error:
        raise SolutionError("the text in UTF-16 is damaged or cut off; save it again") from error


def _stamps(head: bytes, raw: RawSolution) -> frozenset[str]:
    """Digits of the stamps (`Problem.stamp`) that a solver repeats in a message, a name or a column."""
    names = np.empty(0, "S1") if raw.names is None else raw.names
    columns = names[np.strings.find(np.strings.upper(names), b"ONE_") >= 0]
    return digits_in_text(head) | digits_in_columns(columns.tolist())


def _unpacked(data: bytes) -> bytes:
    if not data.startswith(_GZIP):
        return data
    try:
        content = gzip.GzipFile(fileobj=io.BytesIO(data)).read(MAX_SOLUTION + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise SolutionError("the packed file is damaged or cut off; pack it again") from error
    if len(content) > MAX_SOLUTION:
        raise SolutionError(f"unpacks to more than {MAX_SOLUTION} bytes; {_SMALLER}")
    return content
