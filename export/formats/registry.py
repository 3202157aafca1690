"""The table of file formats, and the one function that writes a problem to a file.

A format states its highest degree. Products beyond it are lifted, which is exact for whole jumps and
declared a relaxation otherwise; any other problem is refused by name before the first byte.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

from ...models.errors import InputError, UnsupportedByFormatError
from ...models.field.field import CrossField
from ...models.formulations.families import ANY_DEGREE
from ...models.formulations.problem import Problem
from ...models.instance.domain import Floats
from ...models.memory import check_memory
from ...models.written_files import check_targets
from ..writing.canonical import CanonicalForm
from ..writing.sink import is_packed, pending_file


@dataclass(frozen=True)
class Format:
    """A file format: its capabilities and its writer.

    degree: greatest degree of a polynomial it holds (99: any function); module: of its writer in this folder;
    has_start: whether it has a place for a starting point; is_default: whether it is written when no format
    is requested; has_constant_column: whether the constant of the objective is the cost of the column fixed
    to 1; command: a line that solves {model} and writes {answer}; answers: suffix of that answer, so that
    those of several formats differ.
    """

    name: str
    summary: str
    degree: int
    module: str
    has_start: bool = False
    is_default: bool = True
    has_constant_column: bool = False
    command: str = ""
    answers: str = ".sol"

    @property
    def suffix(self) -> str:
        """Suffix of its files, with the dot."""
        return f".{self.name}"

    def is_model(self, name: str) -> bool:
        """Whether the file of that name is the model itself, not a list of names or data beside it."""
        return _unpacked_name(Path(name)).endswith(self.suffix)

    def generate(
        self, form: CanonicalForm, header: list[str], start: Floats | None = None
    ) -> Iterator[bytes]:
        """The bytes of a file, as its writer makes them; the module of the writer is loaded only here."""
        options = {"start": start} if self.has_start else {}
        writer = import_module(f"{__package__}.{self.module}")
        content: Iterator[bytes] = writer.generate(form, header, **options)
        return content


FORMATS: Final = {
    entry.name: entry
    for entry in (
        Format(
            "nl", "AMPL .nl with .row and .col, for Ipopt, Bonmin, Couenne, SCIP, Baron, Knitro",
            ANY_DEGREE, "nl", has_start=True, command="bonmin {model} -AMPL",
        ),
        Format(
            "gms", "GAMS model, self-contained, one equation per row",
            ANY_DEGREE, "gams", has_start=True, command="gams {model} --RESULTS={answer}", answers=".csv",
        ),
        Format(
            "lp", "CPLEX-style LP, for Gurobi, CPLEX, HiGHS, SCIP, Xpress, CBC, GLPK",
            2, "lp", has_constant_column=True,
            command='scip -c "read {model}" -c optimize -c "write solution {answer}" -c quit',
            answers=".lp.sol",
        ),
        Format(
            "mps", "free MPS with QUADOBJ and QCMATRIX, for Gurobi, CPLEX, HiGHS, SCIP, Xpress, CBC, GLPK",
            2, "mps", has_constant_column=True,
            command="gurobi_cl ResultFile={answer} {model}", answers=".mps.sol",
        ),
        Format(
            "mod", "AMPL model in the paper's notation with its data in a .dat; the linear ones for GLPK too",
            ANY_DEGREE, "ampl", is_default=False,
        ),
        Format(
            "osil", "OSiL, XML, for SCIP and Optimization Services",
            ANY_DEGREE, "osil", is_default=False, has_constant_column=True,
        ),
        Format(
            "qplib", "QPLIB's own format, at most quadratic",
            2, "qplib", has_start=True, is_default=False,
        ),
        Format("bar", "BARON's own format, polynomials", 4, "baron", has_start=True, is_default=False),
    )
}  # fmt: skip
"""The table of formats; command line, docs and tests are generated from it."""

DEFAULTS: Final = tuple(name for name, entry in FORMATS.items() if entry.is_default)
"""Names of the formats that are written when none is requested."""


@dataclass(frozen=True)
class Written:
    """Result of a write: format, the problem as the file holds it; size and SHA-256 by file name."""

    format: str
    problem: Problem
    files: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def lifted(self) -> str:
        """How products were lifted for this format, empty if they were not."""
        return self.problem.formulation.lifted


@cache
def program_version() -> str:
    """Name and version of this program, as written to files."""
    try:
        return f"crossfield {version('crossfield')}"
    except PackageNotFoundError:
        return "crossfield"


def format_of(path: str | Path) -> Format:
    """The format of a path by its suffix, in upper or lower case and before any `.gz`. Raises InputError."""
    suffix = Path(_unpacked_name(Path(path))).suffix.removeprefix(".")
    if suffix.lower() not in FORMATS:
        raise InputError(
            f"no format has the suffix {suffix!r}; use one of {', '.join(FORMATS)}, with or without .gz",
            file=path,
        )
    return FORMATS[suffix.lower()]


def _unpacked_name(path: Path) -> str:
    """The name of the decompressed file."""
    return path.stem if is_packed(path) else path.name


def problem_in_format(problem: Problem, entry: Format) -> Problem:
    """The problem as the format can hold it: itself, or with products lifted.

    Raises UnsupportedByFormatError, naming an equivalent formulation, when neither fits.
    """
    if entry.degree == ANY_DEGREE or _highest_degree(problem) <= entry.degree:
        return problem
    if _highest_degree(problem) < ANY_DEGREE:
        lifted = problem.lifted
        if _highest_degree(lifted) <= entry.degree:
            return lifted
    instead = problem.formulation.equivalent
    remedy = f"write {instead}, which is the same problem" if instead else "choose nl or gms"
    limit = "quadratic" if entry.degree == 2 else f"polynomials of degree {entry.degree}"
    raise UnsupportedByFormatError(
        f"{entry.name} holds nothing beyond {limit} and cannot carry {problem.name}; {remedy}"
    )


def _highest_degree(problem: Problem) -> int:
    return max(problem.objective_degree, problem.row_degree)


def header_lines(problem: Problem) -> list[str]:
    """Lines of comment that describe the content of a file."""
    formulation, options = problem.formulation, problem.formulation.options
    name, integrality = f"{formulation.name} ({formulation.declaration.source})", "kept"
    if options.relax:
        name, integrality = f"continuous relaxation of {name}", "dropped"
    norms = f"stroke norm {options.stroke_norm}, beta norm {options.beta_norm}"
    lines = [
        f"{program_version()}: {name}, {problem.problem_class}, {formulation.declaration.summary}",
        f"instance {problem.instance.name}, gauge {problem.instance.gauge}, sha256 {problem.instance.sha256}",
        f"facet {options.facet}, {norms}, integrality {integrality}",
    ]
    changes = {"tightened": problem.tightened, "limited": problem.limited, "lifted": formulation.lifted}
    return lines + [f"{how}: {text}" for how, text in changes.items() if text]


def write(
    problem: Problem,
    path: str | Path,
    *,
    start: CrossField | None = None,
    force: bool = False,
) -> Written:
    """Write a problem to a file, as `write` of export/bundle/problem_files.py describes it."""
    path = Path(path)
    entry = format_of(path)
    if start is not None and not entry.has_start:
        holders = ", ".join(name for name, holder in FORMATS.items() if holder.has_start)
        raise UnsupportedByFormatError(
            f"{entry.name} has no place for a start; choose a format that has one ({holders}), or give "
            "formats=[...], which writes a start file for each solver",
            file=path,
        )
    domain = problem.instance.domain
    check_memory(domain.size, "written", domain.kind)
    held = problem_in_format(problem, entry)
    check_targets(path.parent, file_names(path.name, entry.name), force=force)
    form = CanonicalForm(held)
    point = None if start is None else held.point(start)
    written = Written(entry.name, held)
    lines = header_lines(held)
    contents = [entry.generate(form, lines, point), *_companions(entry.name, form, lines)]
    files = zip(map(path.with_name, file_names(path.name, entry.name)), contents, strict=True)
    with ExitStack() as stack:  # the files get their names together, at its end
        for file, content in files:
            written.files[file.name] = stack.enter_context(pending_file(file, content, force=force))
    return written


def file_names(name: str, form: str) -> list[str]:
    """The names of a model and of the files that come with it."""
    stem, packed = Path(_unpacked_name(Path(name))).stem, ".gz" * is_packed(Path(name))
    companions = {"nl": [".row", ".col"], "mod": [f".dat{packed}"]}
    return [name, *(f"{stem}{suffix}" for suffix in companions.get(form, []))]


def _companions(name: str, form: CanonicalForm, lines: list[str]) -> Iterator[Iterator[bytes]]:
    """Companion files: names of an .nl, never compressed, and data of a .mod, compressed like the model."""
    if name == "nl":
        yield form.nl_order.row_file()
        yield form.nl_order.column_file()
    if name == "mod":
        from . import ampl

        yield ampl.generate_data(form.problem, lines)
