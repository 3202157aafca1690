"""Readers of solution files: one table, and the choice among them by content."""

from __future__ import annotations

import codecs
import gzip
import io
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from ....models.errors import SolutionError
from ....models.input_limits import MAX_SOLUTION
from ....models.storage import read_bytes
from . import ampl as ampl_sol
from . import baron as baron_sol
from . import cbc as cbc_sol
from . import cplex as cplex_sol
from . import gams_csv, gams_lst
from . import glpk as glpk_sol
from . import gurobi as gurobi_sol
from . import highs as highs_sol
from . import miplib as miplib_sol
from . import scip as scip_sol
from . import xpress as xpress_sol
from .text import HEAD, RawSolution

_STAMP = re.compile(rb"sha256_[0-9a-f]{12}(?![0-9a-f])")
_GZIP: Final = b"\x1f\x8b"
_SMALLER: Final = "let the solver write it without columns at 0"


@dataclass(frozen=True)
class Reader:
    """A reader of one kind of file.

    recognises: whether a file with these first bytes is of this kind. parse: the content of a whole file, or
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
    Reader(gurobi_sol.JSON, "Gurobi .json", gurobi_sol.recognises_json, gurobi_sol.parse_json),
    Reader(
        gurobi_sol.NAME,
        "Gurobi .sol, or any list of names and values",
        gurobi_sol.recognises,
        gurobi_sol.parse,
    ),
    Reader(cplex_sol.NAME, "CPLEX .sol (XML)", cplex_sol.recognises, cplex_sol.parse),
    Reader(scip_sol.NAME, "SCIP .sol", scip_sol.recognises, scip_sol.parse),
    Reader(xpress_sol.SLX, "Xpress .slx", xpress_sol.recognises_slx, xpress_sol.parse_slx),
    Reader(xpress_sol.ASC, "Xpress .asc", xpress_sol.recognises_asc, xpress_sol.parse_asc),
    Reader(cbc_sol.NAME, "CBC, the file of its command solution", cbc_sol.recognises, cbc_sol.parse),
    Reader(glpk_sol.NAME, "GLPK, glpsol -w", glpk_sol.recognises, glpk_sol.parse),
    Reader(
        gams_csv.NAME,
        "GAMS, the CSV that our models write with --RESULTS",
        gams_csv.recognises,
        gams_csv.parse,
    ),
    Reader(gams_lst.NAME, "GAMS listing (.lst), for the status alone", gams_lst.recognises, gams_lst.parse),
    Reader(
        baron_sol.RESULTS, "BARON results (res.lst)", baron_sol.recognises_results, baron_sol.parse_results
    ),
    Reader(
        baron_sol.TIMES,
        "BARON times (tim.lst), for the status alone",
        baron_sol.recognises_times,
        baron_sol.parse_times,
    ),
    Reader(miplib_sol.NAME, "MIPLIB .sol", miplib_sol.recognises, miplib_sol.parse),
    Reader(ampl_sol.BINARY, "AMPL .sol, binary", ampl_sol.recognises_binary, ampl_sol.parse_binary),
    Reader(ampl_sol.TEXT, "AMPL .sol, text", ampl_sol.recognises_text, ampl_sol.parse_text),
)
"""The table of readers: the first that recognises a file reads it; no real file is recognised by two."""


def read_raw(path: str | Path) -> RawSolution:
    """What a solution file says; its kind is told by its content, and gzip is unpacked.

    Raises InputError when the file cannot be opened or has more than MAX_SOLUTION bytes, SolutionError when
    it is empty, malformed or of no known kind.
    """
    data = read_bytes(path, MAX_SOLUTION, _SMALLER)
    try:
        return parse_raw(_unpacked(data))
    except SolutionError as error:
        raise SolutionError(str(error), file=path) from error


def parse_raw(data: bytes) -> RawSolution:
    """What the content of a solution file says; a byte order mark is passed over. Raises SolutionError."""
    data = _without_mark(data)
    if not data or data.isspace():
        raise SolutionError("the file is empty; the solver's log should say why it wrote no solution")
    head = data[:HEAD]
    for reader in READERS:
        if reader.recognises(head):
            return replace(reader.parse(data), stamp=_stamp(head))
    known = "; ".join(reader.description for reader in READERS)
    raise SolutionError(f"this is no solution file of a known kind; give one of these: {known}")


def _without_mark(data: bytes) -> bytes:
    """The text behind a byte order mark, in UTF-8: Windows writes marks, and UTF-16 at times."""
    if not data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.removeprefix(codecs.BOM_UTF8)
    try:
        return data.decode("utf-16").encode()
    except UnicodeError as error:
        raise SolutionError("the text in UTF-16 is damaged or cut off; save it again") from error


def _stamp(head: bytes) -> str:
    """The stamp (`Problem.stamp`) wherever a solver repeats it, in a name or message; else empty."""
    found = _STAMP.search(head)
    return found[0].decode() if found else ""


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
