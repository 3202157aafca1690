"""The table of readers of solution files, and the choice among them by content."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from ....models.errors import InputError, SolutionError, naming
from ....models.input_limits import MAX_SOLUTION
from ....models.packed import unpack, unpack_start
from ....models.storage import read_bytes
from ....models.text_rows import plain_text
from ...statuses import Status, claim_of, status_of_gams
from ...writing.stamps import digits_in_columns, digits_in_text
from . import ampl, cplex, documents, glpk
from .grammar import HEAD, Scan, float_of, line_error
from .listings import TEXT_LAYOUTS
from .siblings import log_of, sibling_of
from .text import Claim, RawSolution, Reader, choose_solution, one_line, reader_of

_NEAR_ONE: Final = 1e-5
_BANNER: Final = re.compile(rb"^ *\*\*\* ([^*\n]{3,100}?) \*\*\* *$", re.MULTILINE)
"""How a search of BARON ended; the last one counts."""
_SMALLER: Final = "let the solver write it without columns at 0"


def _claim_of_highs(scan: Scan) -> tuple[Status, str]:
    status, words = claim_of(scan.status, "highs")
    if status.is_optimal and "none" in scan.claims:
        raise line_error(scan.data, scan.places["none"], "the file is Optimal but holds no point")
    denied = scan.claims.get("primal", b"").lower() not in {b"feasible", b""}
    return status.without_point if denied else status, words


def _claim_of_gams(scan: Scan) -> tuple[Status, str]:
    return status_of_gams(int(scan.status), int(scan.claims["solver"]))


def _claim_of_baron(scan: Scan) -> tuple[Status, str]:
    *_, last = _BANNER.findall(scan.data)
    status, words = claim_of(one_line(last), "baron-res")
    if not scan.begun and "point" in scan.claims:
        raise SolutionError("the file is cut off: points were found, and the table of the best is not there")
    if not status.is_optimal:
        return status if scan.begun else status.without_point, words
    if not scan.begun:
        return Status.INFEASIBLE, words
    if "none" in scan.claims:
        return Status.UNBOUNDED, words
    if "early" in scan.claims:
        return Status.FEASIBLE, words
    if {"epsa", "epsr"} <= scan.claims.keys():
        objective, *gaps = (float_of(scan.claims[group]) for group in ("objective", "epsa", "epsr"))
        scan.claims["bound"] = repr(objective - max(gaps[0], gaps[1] * abs(objective))).encode()
    return status, words


def _claim_by(*layouts: str) -> Claim:
    """The claim of a text that states a status in words of these layouts, or none."""
    return lambda scan: claim_of(scan.status, *layouts) if scan.status else _SILENT


_SILENT: Final = Status.FEASIBLE, ""

_CLAIMS: Final[dict[str, Claim]] = {
    "highs": _claim_of_highs,
    "gams-csv": _claim_of_gams,
    "baron-res": _claim_of_baron,
    "gams-listing": _claim_of_gams,
    "scip": _claim_by("scip"),
    "cbc": _claim_by("cbc"),
}
"""Functions that return the claim of a text, by layout; the others may use words of any program."""

_LISTS: Final = tuple(
    reader_of(layout, _CLAIMS.get(layout.name, _claim_by(layout.name, "other"))) for layout in TEXT_LAYOUTS
)
PLAIN: Final = _LISTS[-4:]
"""Readers of lists without a mark of their program, for files that no other reader recognises."""

READERS: Final[tuple[Reader, ...]] = (
    ampl.BINARY,
    *documents.READERS,
    cplex.READER,
    glpk.READER,
    *_LISTS[: -len(PLAIN)],
    ampl.TEXT,
    *PLAIN,
)
"""The table of readers. Plain lists are the last."""


def read_raw(path: str | Path, solution: int | None = None) -> RawSolution:
    """Read a solution file; its content determines its kind, and gzip, bzip2 and xz are unpacked.

    solution: number of the solution in a file with several, by default the best. Raises InputError when the
    file cannot be opened, is packed and damaged, or holds more than MAX_SOLUTION bytes or memory allows;
    SolutionError when it is empty, malformed or of
    an unknown kind.
    """
    data = read_bytes(path, MAX_SOLUTION, _SMALLER)
    with naming(path):
        return parse_raw(unpack(data, MAX_SOLUTION, _SMALLER), solution)


def parse_raw(data: bytes, solution: int | None = None) -> RawSolution:
    """Read the content of a solution file. Raises SolutionError."""
    if not data or data.isspace():
        raise SolutionError("the file is empty; the solver's log should give the reason")
    binary = ampl.BINARY.recognises(data[:HEAD])
    text = data if binary else plain_text(data, SolutionError)
    head, readers = text[:HEAD], recognising_readers(text)
    if not readers:
        known = "; ".join(reader.description for reader in READERS)
        python = "for name, value in values.items(): print(name, value, file=answer)"
        unknown = (
            f"this is not a solution file of a known kind; give one of these: {known}; in Python: {python}"
        )
        raise SolutionError(sibling_of(head) or log_of(head) or unknown)
    if len(readers) > 1:
        kinds = " and ".join(reader.description for reader in readers)
        raise SolutionError(f"the text holds answers of several kinds: {kinds}; leave one of them in it")
    raw = choose_solution(readers[0].parse(text), solution)
    return replace(raw, reader=readers[0].name, stamps=raw.stamps | _stated_stamps(head, raw))


def recognising_readers(text: bytes) -> list[Reader]:
    """The readers that recognise a text, as `plain_text` returns it; an answer may stand in other text."""
    head = text[:HEAD]
    if sibling_of(head):
        return []
    marked = [reader for reader in READERS if reader not in PLAIN and reader.recognises(head)]
    if marked:
        return marked
    plain = [] if log_of(head) else [reader for reader in PLAIN if reader.recognises(head)]
    if plain or len(text) <= HEAD:
        return plain[:1]
    return [reader for reader in _LISTS if reader not in PLAIN and reader.recognises(text)]


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


def head_of(data: bytes) -> bytes:
    """The first bytes of a file, unpacked, as `plain_text` returns them; as they are if they are damaged."""
    with suppress(InputError):
        return plain_text(unpack_start(data, HEAD))
    return data[:HEAD]
