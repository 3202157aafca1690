"""Check a point of an instance of the library with exact arithmetic: `python check_point.py MODEL POINT`.

MODEL   a .mps or .mps.gz of the library
POINT   lines `NAME VALUE` as in MIPLIB's .sol; `=obj= VALUE` claims an objective; # begins a comment;
        a column that is left out is 0, or what it is fixed to

One file, Python 3.9 or newer, nothing to install, no solver. The objective and the violations of bounds, rows
and integrality are exact: numbers are the decimals in the files, and no sum or product is rounded.

Exit code 0: feasible within the tolerance; 1: not feasible, or the file claims another objective; 2: wrong
usage or a file that cannot be used. A claimed objective must agree within 1e-5 of its size, or of 1.
"""

from __future__ import annotations

import argparse
import decimal
import gzip
import re
import sys
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from functools import lru_cache
from math import prod
from typing import NamedTuple

ZERO = Decimal(0)
EXACT = decimal.Context(prec=20_000, traps=[decimal.Inexact, decimal.InvalidOperation, decimal.Overflow])
"""Arithmetic that raises an error rather than round; sums of products take some 3,000 digits."""
INFINITE, CLAIM = Decimal("1e20"), Decimal("1e-5")  # bounds from here on are none; see the head
LONGEST_LINE, MOST_BYTES = 1 << 20, 1 << 30  # a small .gz that holds more is a trap
LONGEST_NUMBER, GREATEST_EXPONENT = 100, 400
DECIMAL = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
SECTIONS = ("NAME", "ROWS", "COLUMNS", "RHS", "BOUNDS", "QUADOBJ", "QCMATRIX", "ENDATA")
BOUNDS = {"LO": ["lower"], "UP": ["upper"], "FX": ["lower", "upper"],
          "FR": ["lower", "upper"], "MI": ["lower"], "PL": ["upper"]}  # fmt: skip
"""Kinds of bounds, and the ends that they set."""
FREE = ("FR", "MI", "PL")  # kinds without a value: there is no bound at these ends


class BadInputError(Exception):
    """A file or an argument that cannot be used; the message is one line."""


@dataclass
class Column:
    """A column: whether it is integer, and its bounds by end, None where there is none."""

    integer: bool
    bounds: dict[str, Decimal | None] = field(default_factory=dict)


@dataclass
class Row:
    """A row, or the objective: sense N, L, G or E, right side, and terms: columns and a factor."""

    sense: str
    side: Decimal = ZERO
    terms: list[tuple[tuple[str, ...], Decimal]] = field(default_factory=list)

    def value(self, point: Mapping[str, Decimal]) -> Decimal:
        """The exact value of its left side at a point."""
        return sum((prod((point[name] for name in term), start=factor) for term, factor in self.terms), ZERO)


class PointReport(NamedTuple):
    """Result of a check: objectives, and the worst violation of each kind with its place, and of all."""

    objective: Decimal
    claimed: Decimal | None
    agrees: bool
    violations: dict[str, tuple[Decimal, str]]
    worst: Decimal


def _require(condition: object, otherwise: str) -> None:
    """Raise the error unless the condition holds."""
    if not condition:
        raise BadInputError(otherwise)


@lru_cache(1 << 16)
def number(text: str) -> Decimal:
    """The exact value of a decimal number."""
    if len(text) <= LONGEST_NUMBER and DECIMAL.fullmatch(text):
        value = Decimal(text)
        if abs(value.adjusted()) <= GREATEST_EXPONENT:
            return value
    raise BadInputError(f"{text[:40]!r} is not a finite number of reasonable length")


def lines_of(path: str) -> Iterator[tuple[int, str]]:
    """The lines of a text file, plain or packed by gzip, with their numbers from 1."""
    total = 0
    try:
        with open(path, "rb") as raw:  # noqa: PTH123 - a path as it was typed is enough
            stream = gzip.GzipFile(fileobj=raw) if raw.peek(2)[:2] == b"\x1f\x8b" else raw
            for at, line in enumerate(iter(lambda: stream.readline(LONGEST_LINE), b""), 1):
                total += len(line)
                _require(len(line) < LONGEST_LINE and total <= MOST_BYTES, "is unreasonably long")
                yield at, line.decode("utf-8-sig" if at == 1 else "utf-8")
    except (OSError, EOFError, zlib.error, UnicodeError) as error:
        raise BadInputError(f"cannot be read, it may be damaged: {error}") from None


class Model:
    """A model: columns and rows by name, and the name of the objective."""

    def __init__(self, path: str) -> None:
        """Read it from the free MPS of a library."""
        self.columns: dict[str, Column] = {}
        self.rows: dict[str, Row] = {}
        self.goal, self._integer = "", False
        section = [""]
        for at, line in lines_of(path):
            words = line.split()
            if not words or line.startswith("*"):
                continue
            if line[0].isspace():
                try:
                    self._read(section, words)
                except (BadInputError, KeyError, ValueError, IndexError) as error:
                    raise BadInputError(f"line {at} does not fit {section[0][:20]}: {error}") from None
            else:
                section = words
                _require(section[0] in SECTIONS, f"line {at}: no section {section[0][:20]!r} is known")
        _require(section[0] == "ENDATA", "holds no ENDATA; it is cut off, or no MPS file")
        _require(self.goal, "holds no objective")
        for name, column in self.columns.items():  # solvers differ on bounds that are left out
            _require(len(column.bounds) == 2, f"{name[:40]} lacks a bound")

    def _read(self, section: list[str], words: list[str]) -> None:
        """Read a line. Raises KeyError for an unknown name or word, ValueError for too many or few words."""
        if section[0] == "ROWS":
            sense, name = words
            self.rows[name] = Row({kind: kind for kind in "NLGE"}[sense])
            self.goal = name if sense == "N" else self.goal
        elif section[0] == "COLUMNS" and words[1] == "'MARKER'":
            self._integer = {"'INTORG'": True, "'INTEND'": False}[words[2]]
        elif section[0] == "COLUMNS":
            self.columns.setdefault(words[0], Column(self._integer))
            for row, value in _pairs(words[1:]):
                self.rows[row].terms.append(((words[0],), number(value)))
        elif section[0] == "RHS":
            for row, value in _pairs(words[len(words) % 2 :]):  # a name of the set may come first
                self.rows[row].side = number(value)
        elif section[0] == "BOUNDS":
            kind, _, name, *values = words
            bound = None if kind in FREE else number(values[0])
            if bound is not None and abs(bound) >= INFINITE:
                _require(kind == ("UP" if bound > 0 else "LO"), "leaves no value")
                bound = None
            self.columns[name].bounds.update(dict.fromkeys(BOUNDS[kind], bound))
        else:  # QUADOBJ holds a triangle of twice the matrix of the objective; QCMATRIX all of a row's
            first, second, text = words
            _require({first, second} <= self.columns.keys(), "a column is not known")
            halved = section[0] == "QUADOBJ" and first == second
            matrix = self.rows[{"QUADOBJ": self.goal, "QCMATRIX": section[-1]}[section[0]]]
            matrix.terms.append(((first, second), number(text) / 2 if halved else number(text)))


def _pairs(words: list[str]) -> Iterator[tuple[str, str]]:
    """Names and values in turn. Raises ValueError if one is missing."""
    for at in range(0, len(words), 2):
        name, value = words[at : at + 2]
        yield name, value


def read_point(path: str) -> dict[str, Decimal]:
    """The values of a point by name; `=obj=` is the objective that its file claims."""
    values: dict[str, Decimal] = {}
    for at, line in lines_of(path):
        words = line.split()
        if words and not words[0].startswith("#"):
            _require(len(words) == 2, f"line {at}: a line needs a name and a value, as in MIPLIB's .sol")
            value = number(words[1])
            same = values.setdefault(words[0], value) == value
            _require(same, f"line {at}: {words[0][:40]} has two values")
    _require(values, "holds no point")
    return values


def check_values(model: Model, values: dict[str, Decimal]) -> PointReport:
    """Check values by name against a model without rounding errors."""
    foreign = [name for name in values if name not in model.columns and name != "=obj="]
    of = f"{len(foreign)} of {len(values)} names are not in the model, {''.join(foreign[:1])[:40]!r} is one"
    _require(not foreign, f"{of}; it is of another instance or formulation")
    point: dict[str, Decimal] = {}
    excess: dict[str, list[tuple[Decimal, str]]] = {"bounds": [], "rows": [], "integers": []}
    for name, column in model.columns.items():
        lower, upper = column.bounds["lower"], column.bounds["upper"]
        fixed = lower if lower is not None and lower == upper else ZERO
        value = point[name] = values.get(name, fixed)
        excess["bounds"].append((_outside(value, lower, upper), name))
        if column.integer:
            excess["integers"].append((abs(value - value.to_integral_value()), name))
    for name, row in model.rows.items():
        lower, upper = (None if row.sense in without else row.side for without in ("LN", "GN"))
        excess["rows"].append((_outside(row.value(point), lower, upper), name))
    violations = {kind: max(found, default=(ZERO, "")) for kind, found in excess.items()}
    claimed, goal = values.get("=obj="), model.rows[model.goal]
    objective = goal.value(point) - goal.side
    agrees = claimed is None or abs(claimed - objective) <= CLAIM * max(Decimal(1), abs(objective))
    return PointReport(objective, claimed, agrees, violations, max(violations.values())[0])


def _outside(value: Decimal, lower: Decimal | None, upper: Decimal | None) -> Decimal:
    """How far a value lies outside of an interval."""
    return max(ZERO if lower is None else lower - value, ZERO if upper is None else value - upper, ZERO)


def check(model: str, point: str) -> PointReport:
    """Check the point in a file against the model in another one; errors begin with the name of the file."""
    path = point
    try:
        with decimal.localcontext(EXACT):
            values = read_point(path)
            path = model
            return check_values(Model(path), values)
    except BadInputError as error:
        raise BadInputError(f"{path}: {error}") from None


def main(arguments: Sequence[str] | None = None) -> int:
    """Check a point and print a report; the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", metavar="MODEL")
    parser.add_argument("point", metavar="POINT")
    parser.add_argument("--tolerance", default="1e-8", help="greatest violation of a feasible point (1e-8)")
    options = parser.parse_args(arguments)
    try:
        tolerance = number(options.tolerance)
        _require(tolerance >= 0, "the tolerance must not be negative")
        report = check(options.model, options.point)
    except BadInputError as error:
        print(f"check_point: {error}", file=sys.stderr)
        return 2
    print(f"objective {float(report.objective)!r}")
    if report.claimed is not None:
        print(f"claimed   {report.claimed} (differs by {float(report.claimed - report.objective):.3g})")
    for kind, (value, place) in report.violations.items():
        print(f"{kind:<10}{float(value):.3g}{f' at {place}' if value else ''}")
    feasible = report.worst <= tolerance
    print(f"{'feasible' if feasible else 'NOT feasible'} within {float(tolerance):.3g}")
    if not report.agrees:
        print("NOT the objective that the file claims")
    return 0 if feasible and report.agrees else 1


if __name__ == "__main__":
    sys.exit(main())
