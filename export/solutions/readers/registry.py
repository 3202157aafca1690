"""The table of readers of solution files, and the choice among them by content."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import zlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np

from ....models.errors import SolutionError, naming
from ....models.input_limits import MAX_SOLUTION
from ....models.storage import read_bytes
from ...statuses import HIGHS, Status, status_of_cbc, status_of_gams, status_of_scip, status_of_words
from ...writing.stamps import digits_in_columns, digits_in_text
from . import ampl, baron, cplex, glpk, gurobi
from .grammar import HEAD, Scan, error_at, plain_text
from .layouts import LAYOUTS
from .text import Claim, RawSolution, Reader, reader_of, refuse_faults

_NEAR_ONE: Final = 1e-5
_SMALLER: Final = "let the solver write it without columns at 0"
_PACKED: Final[dict[bytes, Callable[[io.BytesIO], Any]]] = {
    b"\x1f\x8b": lambda stream: gzip.GzipFile(fileobj=stream),
    b"BZh": bz2.BZ2File,
    b"\xfd7zXZ\0": lzma.LZMAFile,
}
"""How files that begin so are unpacked."""


def _claim_of_highs(scan: Scan) -> tuple[Status, str]:
    status = HIGHS.get(scan.status, Status.ERROR)
    if status is Status.OPTIMAL_GLOBAL and "none" in scan.claims:
        raise error_at(scan.data, scan.places["none"], "the file is Optimal but holds no point")
    denied = scan.claims.get("primal", b"").lower() not in {b"feasible", b""}
    return status.without_point if denied else status, scan.status


def _claim_of_gams(scan: Scan) -> tuple[Status, str]:
    return status_of_gams(int(scan.status), int(scan.claims["solver"]))


def _claim_by(table: Callable[[str], Status]) -> Claim:
    """The claim of a text that states a status in words, or none."""
    return lambda scan: (table(scan.status) if scan.status else Status.FEASIBLE, scan.status)


_CLAIMS: Final[dict[str, Claim]] = {
    "highs": _claim_of_highs,
    "gams-csv": _claim_of_gams,
    "scip": _claim_by(status_of_scip),
    "cbc": _claim_by(status_of_cbc),
}
"""Functions that return the claim of a text, by layout; the others state a status in words at most."""

*_LISTS, _PLAIN = (
    reader_of(layout, _CLAIMS.get(layout.name, _claim_by(status_of_words))) for layout in LAYOUTS
)

READERS: Final[tuple[Reader, ...]] = (
    ampl.BINARY,
    gurobi.READER,
    cplex.READER,
    glpk.READER,
    baron.READER,
    *_LISTS,
    ampl.TEXT,
    _PLAIN,
)
"""The table of readers: the first that recognises a file reads it. A plain list has no mark, and is last."""


def read_raw(path: str | Path) -> RawSolution:
    """Read a solution file; its content determines its kind, and gzip, bzip2 and xz are unpacked.

    Raises InputError when the file cannot be opened or has more than MAX_SOLUTION bytes, SolutionError when
    it is empty, malformed or of an unknown kind.
    """
    data = read_bytes(path, MAX_SOLUTION, _SMALLER)
    with naming(path):
        return parse_raw(_unpack(data))


def parse_raw(data: bytes) -> RawSolution:
    """Read the content of a solution file. Raises SolutionError."""
    if not data or data.isspace():
        raise SolutionError("the file is empty; the solver's log should give the reason")
    binary = ampl.BINARY.recognises(data[:HEAD])
    with refuse_faults():
        text = data if binary else plain_text(data)
    head = text[:HEAD]
    reader = reader_for(head)
    if reader is None:
        known = "; ".join(reader.description for reader in READERS)
        raise SolutionError(
            "this is not a solution file of a known kind, but may be a model, a start, a report or a log; "
            f"give one of these: {known}"
        )
    raw = reader.parse(text)
    return replace(raw, reader=reader.name, stamps=raw.stamps | _stated_stamps(head, raw))


def reader_for(head: bytes) -> Reader | None:
    """The reader of a file with these first bytes, as `plain_text` returns them; None for an unknown kind."""
    return next((reader for reader in READERS if reader.recognises(head)), None)


def _stated_stamps(head: bytes, raw: RawSolution) -> frozenset[str]:
    """Digits of the stamps (`Problem.stamp`) that a solver repeats in a message, a name or a column.

    Raises SolutionError for a column that is fixed to 1 and has another value.
    """
    names = np.empty(0, "S1") if raw.names is None else raw.names
    chosen = np.strings.find(np.strings.upper(names), b"ONE_") >= 0
    for name, value in zip(names[chosen].tolist(), raw.values[chosen].tolist(), strict=True):
        if digits_in_columns([name]) and not abs(value - 1) <= _NEAR_ONE:
            raise SolutionError(
                f"{name.decode(errors='replace')} has the value {value:g}, but it is fixed to 1: names and "
                "values do not belong together; let the solver write the file again"
            )
    return digits_in_text(head) | digits_in_columns(names[chosen].tolist())


def _unpack(data: bytes) -> bytes:
    """The content of a packed file, or the data themselves. Raises SolutionError."""
    content = _unpack_start(data, MAX_SOLUTION + 1)
    if len(content) > MAX_SOLUTION:
        raise SolutionError(f"unpacks to more than {MAX_SOLUTION} bytes; {_SMALLER}")
    return content


def head_of(data: bytes) -> bytes:
    """The first bytes of a file, unpacked, as `plain_text` returns them; as they are if they are damaged."""
    with suppress(SolutionError), refuse_faults():
        return plain_text(_unpack_start(data, HEAD))
    return data[:HEAD]


def _unpack_start(data: bytes, limit: int) -> bytes:
    """At most `limit` bytes of a packed file, or of the data themselves. Raises SolutionError."""
    opened = next((opened for start, opened in _PACKED.items() if data.startswith(start)), None)
    if opened is None:
        return data[:limit]
    try:
        stream = opened(io.BytesIO(data))
        # Piece by piece: to read a length makes room for all of it.
        pieces = islice(iter(lambda: stream.read(HEAD), b""), -(-limit // HEAD))
        return b"".join(pieces)[:limit]
    except (OSError, EOFError, zlib.error, lzma.LZMAError) as error:
        raise SolutionError("the packed file is damaged or cut off; pack it again") from error
