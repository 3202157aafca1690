"""Check a point of an instance of the library with exact arithmetic: `python check_point.py MODEL POINT`.

One file, Python 3.9 or newer, nothing to install, no solver.

MODEL   a .mps or .mps.gz of the library
POINT   a solution file of HiGHS, SCIP, CBC, Gurobi, Xpress (.slx), MIPLIB, GAMS (our CSV) or another program
        with names and values in lines, or a list of them. A column that is left out is 0, or what it is
        fixed to.

Both files may be packed with gzip, bzip2 or xz.

The objective and the violations of bounds, rows and integrality are exact: the numbers are the decimals in
the files, and no sum or product is rounded.

Exit code 0: feasible within the tolerance; 1: not feasible, or the file claims another objective; 2: wrong
usage or a file that cannot be used. A claimed objective must agree within 1e-5 of its size, or of 1: solvers
round theirs to about 1e-6.
"""

from __future__ import annotations

import argparse
import bz2
import decimal
import gzip
import lzma
import re
import sys
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from decimal import Decimal
from typing import IO, Any, NoReturn, Optional, TypeVar

from ...solutions.readers.grammar import HEAD, LineError, Scan, plain_numbers, plain_text, spellings
from ...solutions.readers.listings import TEXT_LAYOUTS

ZERO, HALF, ONE = Decimal(0), Decimal("0.5"), Decimal(1)
EXACT = decimal.Context(prec=20_000, traps=[decimal.Inexact, decimal.InvalidOperation, decimal.Overflow])
"""Arithmetic that raises an error rather than round; sums of products take some 3,000 digits."""

INFINITE = Decimal("1e20")  # bounds from here on are none, as in all solvers

LONGEST_LINE = 1 << 20
MOST_BYTES = 1 << 30  # of a file, unpacked: a small .gz that holds more is a trap
MOST_BYTES_OF_POINT = 1 << 28
LONGEST_NUMBER = 100
GREATEST_EXPONENT = 400

BOUNDS = {
    "LO": (("lower",), True),
    "UP": (("upper",), True),
    "FX": (("lower", "upper"), True),
    "FR": (("lower", "upper"), False),
    "MI": (("lower",), False),
    "PL": (("upper",), False),
}
"""Kinds of bounds: the ends that they set, and whether a value follows."""

PACKED = {b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ\0": lzma.open}
"""How files that begin so are unpacked."""

DECIMAL = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
CLAIM = Decimal("1e-5")  # how far the objective may be from a claimed one, as a part of its size, or of 1
MARK = "\ufeff"  # a byte order mark, which some editors put before a text
ADDED = re.compile(
    r"ONE(?:_[0-9a-f]{11})?|Constant|(?:MPS_)?Rg.*|nlobjvar|quadobjvar|qmatrixvar|objconstvar|~r_\d+|objvar|"
    r"ONE_VAR_CONSTANT|GAMS_OBJECTIVE",
    re.IGNORECASE,
)
"""Columns that solvers and their readers add to a model; in a point they are passed over."""

STAMP = re.compile(r"(?:sha256_|\b(?:t_)?ONE_)([0-9a-f]{11})", re.IGNORECASE | re.ASCII)
"""The first digits of a problem's hash, in the name of a model, a column or an objective."""

Entry = tuple[int, Decimal]
Product = tuple[int, int, Decimal]
Matrix = dict[tuple[int, int], Decimal]
Excess = tuple[Decimal, str]
Interval = tuple[Optional[Decimal], Optional[Decimal]]
Content = TypeVar("Content")


class BadInputError(Exception):
    """A file or an argument that cannot be used; the message is one line."""


@dataclass
class ModelColumn:
    """A column: bounds, None where there is none, and whether it is integer."""

    name: str
    integer: bool
    lower: Decimal | None = None
    upper: Decimal | None = None


@dataclass
class Row:
    """A row or the objective: sense N, L, G or E, right side, linear entries, products."""

    name: str
    sense: str
    side: Decimal = ZERO
    linear: list[Entry] = field(default_factory=list)
    products: list[Product] = field(default_factory=list)

    def value(self, point: Sequence[Decimal]) -> Decimal:
        """The exact value of its left side at a point."""
        total = sum((factor * point[at] for at, factor in self.linear), ZERO)
        return sum((factor * point[i] * point[j] for i, j, factor in self.products), total)

    def interval(self) -> Interval:
        """The least and the greatest value that its left side may take."""
        return None if self.sense == "L" else self.side, None if self.sense == "G" else self.side


@dataclass
class Model:
    """A model: columns and rows by name, the objective, and the stamps of problems in its names."""

    columns: list[ModelColumn] = field(default_factory=list)
    number: dict[str, int] = field(default_factory=dict)
    rows: dict[str, Row] = field(default_factory=dict)
    objective: Row | None = None
    stamps: set[str] = field(default_factory=set)

    def row(self, name: str) -> Row:
        """The row of that name, or the objective."""
        if self.objective is not None and name == self.objective.name:
            return self.objective
        if name not in self.rows:
            raise BadInputError(f"there is no row {name[:40]}")
        return self.rows[name]

    def value(self, point: Sequence[Decimal]) -> Decimal:
        """The objective at a point, its constant included."""
        assert self.objective is not None
        return self.objective.value(point) - self.objective.side

    def column(self, name: str) -> int:
        """The number of the column of that name."""
        if name not in self.number:
            raise BadInputError(f"there is no column {name[:40]}")
        return self.number[name]


@dataclass
class PointReport:
    """Result of the check of a point.

    Objective, lines of the report, the worst violation of each kind, and whether the point has the objective
    that its file claims, if it claims one.
    """

    objective: Decimal
    lines: list[tuple[str, str]]
    violations: dict[str, Excess]
    agrees: bool = True

    @property
    def worst(self) -> Decimal:
        """The largest violation of all."""
        return max(value for value, _ in self.violations.values())


# ---------------------------------------------------------------------------------------------------- reading


def number(text: str) -> Decimal:
    """The exact value of a decimal number."""
    if len(text) <= LONGEST_NUMBER and DECIMAL.fullmatch(text):
        value = Decimal(text)
        if abs(value.adjusted()) <= GREATEST_EXPONENT:
            return value
    raise BadInputError(f"{text[:40]!r} is not a finite number of reasonable length")


def stamps_in(text: str) -> set[str]:
    """The stamps of problems in a text."""
    return {digits.lower() for digits in STAMP.findall(text)}


def _require(condition: object, otherwise: str) -> None:
    """Raise the error unless the condition holds."""
    if not condition:
        raise BadInputError(otherwise)


def opened(raw: IO[bytes]) -> IO[bytes]:
    """A file, unpacked where it is packed."""
    start = raw.read(6)
    raw.seek(0)
    unpack: Any = next((unpack for mark, unpack in PACKED.items() if start.startswith(mark)), None)
    return raw if unpack is None else unpack(raw)


@contextmanager
def reading(path: str) -> Iterator[IO[bytes]]:
    """The content of a file, unpacked; errors are those of bad input."""
    try:
        with open(path, "rb") as raw, opened(raw) as stream:  # noqa: PTH123 - a path as it was typed is enough
            yield stream
    except UnicodeDecodeError:
        raise BadInputError("is not a text file") from None
    except (EOFError, zlib.error, gzip.BadGzipFile, lzma.LZMAError):
        raise BadInputError("the packed file is damaged or cut off") from None
    except OSError as error:
        raise BadInputError(f"cannot be read: {(error.strerror or str(error)).lower()}") from None


def lines_of(path: str) -> Iterator[tuple[int, str]]:
    """The lines of a text file with their numbers from 1."""
    total = 0
    with reading(path) as stream:
        for at, line in enumerate(iter(lambda: stream.readline(LONGEST_LINE), b""), 1):
            total += len(line)
            _require(len(line) < LONGEST_LINE and total <= MOST_BYTES, "is unreasonably long")
            text = line.decode("utf-8")
            yield at, text[len(MARK) :] if at == 1 and text.startswith(MARK) else text


class MpsReader:
    """Reads the free MPS of a library section by section: ROWS to BOUNDS, QUADOBJ, QCMATRIX, ENDATA."""

    def __init__(self) -> None:
        self.model = Model()
        self.numbers: dict[str, Decimal] = {}  # coefficients are few, so each is converted once
        self.integer = False
        self.current: tuple[str, set[str]] = ("", set())
        self.seen: set[tuple[str, str]] = set()  # (section, row) or (end of a bound, column)
        self.matrices: dict[tuple[str, str], Matrix] = {}
        self.matrix: Matrix = {}
        self.readers = {
            "ROWS": self.row,
            "COLUMNS": self.entries,
            "RHS": self.side,
            "BOUNDS": self.bound,
            "QUADOBJ": self.product,
            "QCMATRIX": self.product,
        }

    def read(self, lines: Iterable[tuple[int, str]]) -> Model:
        """The model that the lines hold."""
        section = ""
        for at, line in lines:
            words = line.split()
            if not words or line.startswith("*"):
                continue
            try:
                if not line[0].isspace():
                    section = words[0]
                    self.begin(section, words[1:])
                else:
                    _require(section in self.readers, "stands outside of every section")
                    self.readers[section](words)
            except BadInputError as error:
                raise BadInputError(f"line {at}: {error}") from None
            if section == "ENDATA":
                return self.finished()
        raise BadInputError("holds no ENDATA; it is cut off, or no MPS file")

    def begin(self, section: str, words: list[str]) -> None:
        """Begin a section, whose line may hold more words."""
        if section in ("QUADOBJ", "QCMATRIX"):
            self.matrix = self.matrices.setdefault((section, words[0] if words else ""), {})
        elif section == "NAME":
            self.model.stamps.update(stamps_in(" ".join(words)))
        elif section not in self.readers and section != "ENDATA":
            raise BadInputError(f"the section {section[:20]} is not known here")

    def value(self, text: str) -> Decimal:
        """A number, converted once."""
        if text not in self.numbers:
            self.numbers[text] = number(text)
        return self.numbers[text]

    def row(self, words: list[str]) -> None:
        """Read a row; the N row is the objective."""
        if len(words) != 2 or words[0] not in ("N", "L", "G", "E"):
            raise BadInputError("a row needs a sense N, L, G or E and a name")
        sense, name = words
        model = self.model
        if name in model.rows or (model.objective and model.objective.name == name):
            raise BadInputError(f"the row {name[:40]} is there twice")
        if sense != "N":
            model.rows[name] = Row(name, sense)
        else:
            _require(model.objective is None, "a model has one objective")
            model.objective = Row(name, sense)

    def entries(self, words: list[str]) -> None:
        """Read entries of a column, or a marker of integer columns."""
        if len(words) == 3 and words[1] == "'MARKER'":
            _require(words[2] in ("'INTORG'", "'INTEND'"), f"the marker {words[2][:20]} is not known")
            self.integer = words[2] == "'INTORG'"
            return
        name, model = words[0], self.model
        if name != self.current[0]:
            _require(name not in model.number, f"the entries of column {name[:40]} do not follow each other")
            model.stamps.update(stamps_in(name))
            model.number[name] = len(model.columns)
            model.columns.append(ModelColumn(name, self.integer))
            self.current = (name, set())
        for row, value in _pairs(words, 1):
            if row in self.current[1]:
                raise BadInputError(f"column {name[:40]} has two entries in row {row[:40]}")
            self.current[1].add(row)
            model.row(row).linear.append((len(model.columns) - 1, self.value(value)))

    def side(self, words: list[str]) -> None:
        """Read right sides, after the name of their set; that of the objective is minus its constant."""
        for name, value in _pairs(words, len(words) % 2):
            if ("RHS", name) in self.seen:
                raise BadInputError(f"{name[:40]} is there twice")
            self.seen.add(("RHS", name))
            self.model.row(name).side = self.value(value)

    def bound(self, words: list[str]) -> None:
        """Read a bound: kind, name of the set, column, and a value where the kind has one."""
        kind = words[0]
        if kind not in BOUNDS:
            raise BadInputError(f"the kind of bound {kind[:20]} is not known here")
        ends, valued = BOUNDS[kind]
        fits = len(words) == (4 if valued else 3)
        _require(fits, "a bound needs a kind, a set, a column, and a value where the kind has one")
        name = words[2]
        column = self.model.columns[self.model.column(name)]
        value = self.limit(words[3], ends) if valued else None
        for end in ends:
            if (end, name) in self.seen:
                raise BadInputError(f"{name[:40]} has two {end} bounds")
            self.seen.add((end, name))
        if "lower" in ends:
            column.lower = value
        if "upper" in ends:
            column.upper = value

    def limit(self, text: str, ends: tuple[str, ...]) -> Decimal | None:
        """The value of a bound, None for an infinite one, which must leave the column free on its side."""
        value = self.value(text)
        if abs(value) < INFINITE:
            return value
        _require(ends == (("upper",) if value > 0 else ("lower",)), f"the bound {text[:20]} leaves no value")
        return None

    def product(self, words: list[str]) -> None:
        """Read an entry of a quadratic section."""
        _require(len(words) == 3, "an entry of a matrix needs two columns and a value")
        key = (self.model.column(words[0]), self.model.column(words[1]))
        if key in self.matrix:
            raise BadInputError(f"the entry {words[0][:40]} {words[1][:40]} is there twice")
        self.matrix[key] = self.value(words[2])

    def finished(self) -> Model:
        """The model, once every column is bounded and matrices belong to their rows."""
        _require(self.model.objective is not None, "holds no objective")
        for column in self.model.columns:  # solvers differ on bounds that are left out
            for end in ("lower", "upper"):
                _require((end, column.name) in self.seen, f"{column.name[:40]} has no {end} bound")
        for (section, name), matrix in self.matrices.items():
            held = self.model.row(name) if name else self.model.objective
            assert held is not None
            held.products += _products(section, matrix)
        return self.model


def _pairs(words: list[str], start: int) -> Iterator[tuple[str, str]]:
    """Names and values from a word on."""
    _require(len(words) >= start + 2 and (len(words) - start) % 2 == 0, "a name or a number is missing")
    return ((words[at], words[at + 1]) for at in range(start, len(words), 2))


def _products(section: str, matrix: Matrix) -> list[Product]:
    """The monomials of a matrix: QUADOBJ holds a triangle of twice the matrix, QCMATRIX the whole matrix."""
    triangle = section == "QUADOBJ"
    for (i, j), value in matrix.items():
        fits = i == j or ((j, i) not in matrix if triangle else matrix.get((j, i)) == value)
        _require(
            fits, f"{section} must hold {'one triangle' if triangle else 'both triangles, which are equal'}"
        )
    return [(i, j, HALF * value if triangle and i == j else value) for (i, j), value in matrix.items()]


@dataclass
class NamedPoint:
    """Values by name, the objective that the file claims, if any, and the stamps of problems in it."""

    values: dict[str, Decimal] = field(default_factory=dict)
    claimed: Decimal | None = None
    stamps: set[str] = field(default_factory=set)

    def of(self, columns: Iterable[ModelColumn]) -> list[Decimal]:
        """The values of columns in order: 0 where one is left out, or what it is fixed to."""
        values = []
        for column in columns:
            fixed = column.lower is not None and column.lower == column.upper
            default = column.lower if fixed and column.lower is not None else ZERO
            values.append(self.values.get(column.name, default))
        return values

    def spelled(self, names: Iterable[str]) -> NamedPoint:
        """The point under the names of columns that it has in another case, in quotes or with a prefix."""
        own = {name.lower(): name for name in names}
        known, renamed = set(own.values()), NamedPoint(claimed=self.claimed, stamps=self.stamps)
        for name, value in self.values.items():
            words = [word.decode() for word in spellings(name.encode())] if name not in known else []
            _keep(renamed, next((own[word] for word in words if word in own), name), value)
        return renamed


def read_point(path: str) -> NamedPoint:
    """The point in a file."""
    data = bytearray()
    with reading(path) as stream:
        while piece := stream.read(LONGEST_LINE):
            data += piece
            _require(len(data) <= MOST_BYTES_OF_POINT, "is unreasonably long")
    _require(data.strip(), "holds no point: it is empty")
    try:
        text = plain_text(bytes(data))
        layout = next((layout for layout in TEXT_LAYOUTS if layout.recognises(text[:HEAD])), None)
        _require(
            layout,
            "is not a solution file of a known kind; give one of a solver, or lines of names and values",
        )
        assert layout is not None
        scan = Scan(next(layout.answers(text)), layout)
        entries = [pair for names, values in scan.read() for pair in zip(names, values)]
    except LineError as error:
        raise BadInputError(str(error)) from None
    _require(scan.has_point, "the file holds no point")
    point = NamedPoint(claimed=_value(scan.claims["objective"]) if "objective" in scan.claims else None)
    point.stamps = stamps_in(text[:HEAD].decode("utf-8", "replace"))
    for name, value in entries[scan.first :]:
        point.stamps |= stamps_in(name.decode("utf-8", "replace"))
        _keep(point, name.decode("utf-8", "replace"), _value(value))
    return point


def _value(word: bytes) -> Decimal:
    return number(plain_numbers(word).decode("ascii", "replace"))


def _keep(point: NamedPoint, name: str, value: Decimal) -> None:
    """Keep the value of a column, which may be there twice if the values are equal."""
    _require(point.values.setdefault(name, value) == value, f"{name[:40]} has two values")


# ------------------------------------------------------------------------------------------ MPS against point


def check_model(model: Model, point: NamedPoint) -> PointReport:
    """Check a point against a model without rounding errors."""
    others = sorted(point.stamps - model.stamps) if model.stamps else []
    _require(not others, f"the point is of another problem: it states {''.join(others[:1])}")
    point = point.spelled(model.number)
    foreign = [name for name in point.values if name not in model.number]
    _refuse_foreign([name for name in foreign if not ADDED.fullmatch(name)], len(point.values))
    values = point.of(model.columns)
    objective = model.value(values)
    agrees = point.claimed is None or abs(point.claimed - objective) <= CLAIM * max(ONE, abs(objective))
    integers = [(c, v) for c, v in zip(model.columns, values) if c.integer]
    lines = [
        ("model", f"{len(model.columns)} columns ({len(integers)} integer), {len(model.rows)} rows"),
        ("point", _described(len(point.values) - len(foreign), len(model.columns), foreign)),
        ("problem", "stated in the point" if point.stamps & model.stamps else "not stated in the point"),
        ("objective", _shown(objective)),
    ]
    if point.claimed is not None:
        lines.append(("claimed", f"{point.claimed} (differs by {_brief(abs(point.claimed - objective))})"))
    bounds = [(_outside(v, (c.lower, c.upper)), c.name) for c, v in zip(model.columns, values)]
    violations = {
        "bounds": _worst(bounds),
        "rows": _worst(
            (_outside(row.value(values), row.interval()), row.name) for row in model.rows.values()
        ),
        "integers": _worst((abs(v - _nearest(v)), c.name) for c, v in integers),
    }
    return PointReport(objective, lines, violations, agrees=agrees)


def _refuse_foreign(names: list[str], count: int) -> None:
    of = f"{len(names)} of {count} names are not in the model"
    _require(not names, f"{of}, {''.join(names[:1])[:40]!r} is one; it is of another instance or formulation")


def _described(used: int, columns: int, added: list[str]) -> str:
    text = f"{used} values, {columns - used} columns left out"
    return text + (f", {len(added)} that a solver added passed over" if added else "")


def _nearest(value: Decimal) -> Decimal:
    """The nearest whole number."""
    return value.to_integral_value(decimal.ROUND_HALF_EVEN)


def _outside(value: Decimal, interval: Interval) -> Decimal:
    """How far a value lies outside of an interval."""
    lower, upper = interval
    below = ZERO if lower is None else lower - value
    above = ZERO if upper is None else value - upper
    return max(below, above, ZERO)


def _worst(violations: Iterable[Excess]) -> Excess:
    """The largest violation and its place; the first of equal ones."""
    return max(violations, key=lambda violation: violation[0], default=(ZERO, ""))


# ----------------------------------------------------------------------------------------------------- report


def _shown(value: Decimal) -> str:
    """A value to 17 digits."""
    short = decimal.Context(prec=17).plus(value).normalize()
    return f"{short:f}" if -7 < short.adjusted() < 17 else str(short)


def _brief(value: Decimal) -> str:
    return "0" if value == 0 else f"{float(value):.3g}"


def check(model: str, point: str) -> PointReport:
    """Check the point in a file against the model in another one."""
    with decimal.localcontext(EXACT):
        values = _of_file(point, read_point)
        return _of_file(model, lambda path: check_model(MpsReader().read(lines_of(path)), values))


def _of_file(path: str, read: Callable[[str], Content]) -> Content:
    """Read a file, whose name begins every error."""
    try:
        return read(path)
    except BadInputError as error:
        raise BadInputError(f"{path}: {error}") from None


def main(arguments: Sequence[str] | None = None) -> int:
    """Check a point and print a report; the exit code."""
    try:
        options = _arguments(arguments)
        report = check(options.model, options.point)
    except BadInputError as error:
        print(f"check_point: {error}", file=sys.stderr)
        return 2
    for label, text in report.lines:
        print(f"{label:<10}{text}")
    for kind, (value, place) in report.violations.items():
        print(f"{kind:<10}{_brief(value)}{f' at {place}' if value else ''}")
    feasible = report.worst <= options.tolerance
    print(f"{'feasible' if feasible else 'NOT feasible'} within {_brief(options.tolerance)}")
    if not report.agrees:
        print("NOT the objective that the file claims")
    return 0 if feasible and report.agrees else 1


class _Parser(argparse.ArgumentParser):
    """Reports a wrong argument in one line."""

    def error(self, message: str) -> NoReturn:
        raise BadInputError(f"{message}; see check_point.py --help")


def _arguments(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = _Parser(
        "check_point.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", metavar="MODEL", help=".mps or .mps.gz")
    parser.add_argument("point", metavar="POINT", help="a solution file, or names and values; may be .gz")
    parser.add_argument("--tolerance", default="1e-8", help="greatest violation of a feasible point (1e-8)")
    options = parser.parse_args(arguments)
    options.tolerance = number(options.tolerance)
    _require(options.tolerance >= 0, "the tolerance must not be negative")
    return options


if __name__ == "__main__":
    sys.exit(main())
