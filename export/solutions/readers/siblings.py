"""Files that are taken for answers: what each is, and how to get the right one."""

from __future__ import annotations

import re
from typing import Final

_COMMENTS: Final = rb"\A(?:[ \t]*(?:%b[^\n]*)?\n)*[ \t]*"
_MODEL: Final = "this is a model file; solve it, and give the file that the solver writes"
_BASIS: Final = "this is a basis file, which states the columns at their bounds and no values; {}"
_REPORT: Final = "this is {}, with too few digits for a point; {}"
_OURS: Final = "this is {} of crossfield and no answer; give the file that the solver writes"

_MODELS: Final = (
    _COMMENTS % rb"\\" + rb"(?i:minimi[sz]e|maximi[sz]e|minimum|maximum|min|max)\b[^\n]*\n",  # LP
    _COMMENTS % rb"\*"
    + rb"(?:NAME\b[^\n]*\n\s*)?(?:OBJSENSE\b[^\n]*\n\s*(?:MIN|MAX)\w*\s*\n\s*)?(?:ROWS\b|SETS\b)",  # MPS
    rb"\A[gb]\d+ +\d+ +\d+[ \d]*\s",  # .nl
    _COMMENTS % rb"\*" + rb"\$(?i:off|on)\w+|^(?i:solve +\w+ +using)\b",  # GAMS
    rb"<osil\b",
    rb"\A[^\n]*\n[ \t]*[LDCQ][CBMIG][NBLDCQ]\b[^\n]*\n[ \t]*(?i:min|max)",  # QPLIB
    _COMMENTS % rb"//" + rb"(?:(?:BINARY_|INTEGER_|POSITIVE_)?VARIABLES?\b|OPTIONS\s*\{)",  # .bar
    _COMMENTS % rb"#" + rb"(?:set|param|var|data|model|minimize|maximize)\b[^\n]*[;:={]",  # AMPL
    rb"\A(?:c[^\n]*\n)*p (?:lp|mip) (?:min|max) ",  # GLPK
)
"""Patterns of the starts of model files."""

SIBLINGS: Final[tuple[tuple[bytes, str], ...]] = (
    (
        rb"\A\s*Problem:[^\n]*\nRows:",
        _REPORT.format(
            "a report of GLPK (glpsol -o) or of HiGHS, style 3 (GLPK pretty)",
            "write the solution with glpsol -w, in HiGHS with write_solution_style = 0 (raw) or 4 (sparse)",
        ),
    ),
    (
        rb"\A\s*Columns\n +Index +Status",
        _REPORT.format(
            "HiGHS style 1 (pretty)", "write it with write_solution_style = 0 (raw) or 4 (sparse)"
        ),
    ),
    (
        rb"\A\s*Problem Statistics\s*\nMatrix ",
        _REPORT.format("a report of Xpress (.prt)", "write the .slx with writeslxsol"),
    ),
    (
        rb'\A"[^"\n]*",\s*\d+,\s*\d+,\s*-?\d+,\s*"',
        "this is the header of a solution of Xpress (.hdr), without columns; write the .slx with writeslxsol",
    ),
    (
        rb"\A\f?GAMS +\d[\d.]+ +[^\n]*\n(?![\s\S]*^---- VAR )",
        _REPORT.format("a listing of GAMS", "run the model with --RESULTS=FILE.csv, and give that CSV"),
    ),
    (
        rb"<CPLEXSolution[^>]*>\s*<header[^>]*\sMIPStartEffortLevel=",
        (
            "this is a MIP start (.mst), which CPLEX reads and does not write as an answer; "
            "write the answer with `write FILE.sol`, or solution.write in Python"
        ),
    ),
    (
        rb"\A(?:\*[^\n]*\n)*NAME[^\n]*\n\s*(?:XU|XL|UL|LL|SB|BS)\s",
        _BASIS.format("write a .sol (CPLEX, Gurobi), .slx (Xpress) or solution file (HiGHS)"),
    ),
    (rb"\AHiGHS_basis_file", _BASIS.format("write the solution with HiGHS's option solution_file")),
    (rb"<CPLEXBasis|<basis\b", _BASIS.format("write the answer with `write FILE.sol`")),
    *((pattern, _MODEL) for pattern in _MODELS),
    (
        (
            rb"\A(?:(?:#[^\n]*)?\n)*(?:[A-Z][A-Za-z]+[ \t]+\S+\n)*?"
            rb"(?:TimeLimit|MIPGap|Threads|Seed|MIPFocus|Presolve|Method|OutputFlag|LogFile|\w+Tol)[ \t]"
        ),
        "this is a parameter file of Gurobi (.prm); give the .sol or .json that Gurobi writes",
    ),
    (
        rb"\A(?:[a-z]\w*_\d\d+(?:_\d\d+(?:_[ur])?)?\n){2}",
        "this is a list of the names in an .nl file (.col or .row); give the .sol that the solver writes",
    ),
    (rb'\A\s*\{\s*"format":\s*"crossfield-manifest"', _OURS.format("a manifest")),
    (rb'\A\s*\{\s*"format":\s*"crossfield-instance"', _OURS.format("an instance")),
    (rb'\A\s*\{\s*"format":\s*"crossfield-field"', _OURS.format("a field")),
    (
        rb"\APK\x03\x04",
        (
            "this is a zip archive: a field or certificate of crossfield (.npz), or a packed answer; "
            "unpack it with `unzip FILE`, and give the solver's file"
        ),
    ),
    (rb"\A\x28\xb5\x2f\xfd", "this file is packed with Zstandard; unpack it with `zstd -d FILE`"),
    (rb"\A7z\xbc\xaf", "this file is packed with 7-Zip; unpack it with `7z x FILE`"),
)
"""Patterns of the start of a file, and what to do. The first that is found counts."""

_PATTERNS: Final = tuple((re.compile(pattern, re.MULTILINE), words) for pattern, words in SIBLINGS)


_LOG: Final = re.compile(
    rb"^ *BARON version \d|^Running HiGHS |^(?:LP|QP|MIP|MIQP)\b.* has \d+ rows; \d+ cols; "
    rb"|^Gurobi Optimizer version |^SCIP version |^original problem has \d+ variables|^FICO Xpress .*v\d"
    rb"|^Version identifier: \d|^Welcome to IBM.*CPLEX|^--- GAMS/CPLEX|^IBM ILOG CPLEX",
    re.MULTILINE,
)
"""Starts of logs of BARON, HiGHS, Gurobi, SCIP, Xpress and CPLEX."""


def sibling_of(head: bytes) -> str:
    """Kind of a file that is known to be no answer, by its first bytes, with the remedy; else empty."""
    return next((words for pattern, words in _PATTERNS if pattern.search(head)), "")


def log_of(head: bytes) -> str:
    """Kind of a file that is a solver's log, by its first bytes, with the remedy; else empty."""
    words = "this is a log of a solver, which holds no point; give the solution file that the run wrote"
    return words if _LOG.search(head) else ""
