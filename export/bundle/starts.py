"""Starting points in the format of each solver for an LP, MPS or .nl file: complete and feasible.

    layout
    list    .mst   lines `name value`                                  Gurobi: model.read(...), or InputFile
    cplex   .mst   XML with one <variable name index value> per column CPLEX: read file.mst, MIP_starts.read
    highs   .sol   style 0: `# Columns n`, lines `name value`          HiGHS: read_solution_file, readSolution
    scip    .sol   lines `name value`                                  SCIP: read file.sol, readSol
    slx     .slx   `NAME`, lines ` C name value`, `ENDATA`             Xpress: readslxsol

Names are those of our files. (.nl and GAMS files hold a starting point themselves.) A start for LP and MPS
has the columns of these files, including lifted products and the column fixed to 1. SCIP reads a nonlinear
objective as an additional variable, under three names: quadobjvar (LP), qmatrixvar (MPS), nlobjvar (.nl). All
three are in its file with the value of the nonlinear part of the objective, and SCIP ignores unknown names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np

from ...models.errors import UnsupportedByFormatError
from ...models.field.field import CrossField
from ...models.formulations.problem import Problem
from ...models.instance.domain import Floats
from ..formats.registry import FORMATS, problem_in_format
from ..solvers_table import SOLVERS, suitability
from ..writing.canonical import CanonicalForm
from ..writing.records import Decimals, Pieces, number_text, render, words
from ..writing.sink import save_file


@dataclass(frozen=True, eq=False)
class Start:
    """A complete point of a problem as a format holds it."""

    problem: Problem
    point: Floats

    @cached_property
    def form(self) -> CanonicalForm:
        """The columns and rows of LP and MPS."""
        return CanonicalForm(self.problem)

    @property
    def objective(self) -> float:
        """The objective at the point, recomputed."""
        return self.problem.objective_value(self.point)

    def lines(self, before: bytes = b"", *, zeros: bool = True) -> Iterator[bytes]:
        """A line `name value` for every column, with shortest round-trip numbers; zeros: include zeros."""
        names, values = self.form.names.all, self.point
        if not zeros:
            at = np.nonzero(values)[0]
            names, values = names.at(at), values[at]
        yield from render([before, names, b" ", words(values), b"\n"], len(values))
        yield before + self.form.one + b" 1\n"

    def activities(self) -> Iterator[bytes]:
        """A line `name value` for every row, constants on its right side."""
        names = self.form.names
        for family in self.problem.rows:
            values = words(family.values(self.point) + family.limit)
            yield from render([names.row(family), b" ", values, b"\n"], family.count)
        if not self.problem.rows:
            yield b"c_ONE 1\n"


def _list_file(start: Start) -> Iterator[bytes]:
    yield f"# MIP start, objective {number_text(start.objective)}\n".encode()
    yield from start.lines()


def _cplex_file(start: Start) -> Iterator[bytes]:
    name = start.problem.instance.name  # letters, digits and underscores
    yield (
        '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>\n'
        '<CPLEXSolutions version="1.2">\n'
        '<CPLEXSolution version="1.2">\n'
        f'<header problemName="{name}" solutionName="start" solutionIndex="0" MIPStartEffortLevel="4"/>\n'
        "<variables>\n"
    ).encode()
    count = start.problem.n_columns
    names, index, values = start.form.names.all, Decimals(np.arange(count)), words(start.point)
    parts: Pieces = [b'<variable name="', names, b'" index="', index, b'" value="', values, b'"/>\n']
    yield from render(parts, count)
    yield b'<variable name="%b" index="%d" value="1"/>\n' % (start.form.one, count)
    yield b"</variables>\n</CPLEXSolution>\n</CPLEXSolutions>\n"


def _highs_file(start: Start) -> Iterator[bytes]:
    yield b"Model status\nUnknown\n\n# Primal solution values\nFeasible\n"
    yield f"Objective {number_text(start.objective)}\n# Columns {start.problem.n_columns + 1}\n".encode()
    yield from start.lines()
    yield b"# Rows %d\n" % start.form.row_count("mps")
    yield from start.activities()


def _scip_file(start: Start) -> Iterator[bytes]:
    yield f"solution status: unknown\nobjective value: {number_text(start.objective)}\n".encode()
    yield from start.lines()
    for name, part in _objective_variables(start).items():
        yield f"{name} {number_text(part)}\n".encode()


def _objective_variables(start: Start) -> dict[str, float]:
    """The variables that represent an objective in SCIP, at the value of its nonlinear part, if any."""
    problem, point = start.problem, start.point
    if problem.objective_degree < 2:
        return {}
    curved = sum(float(np.sum(family.values(point))) for family in problem.objective if family.degree > 1)
    variables = {"nlobjvar": curved}
    if problem.objective_degree == 2:
        index, cost = problem.merged_objective(1)
        squares = start.objective - float(point[index[:, 0]] @ cost) - start.form.constant
        variables |= {"quadobjvar": squares, "qmatrixvar": squares}
    return variables


def _slx_file(start: Start) -> Iterator[bytes]:
    yield f"NAME {start.problem.instance.name}\n".encode()
    yield from start.lines(b" C ")
    yield b"ENDATA\n"


LAYOUTS: Final[dict[str, Callable[[Start], Iterator[bytes]]]] = {
    "list": _list_file, "cplex": _cplex_file, "highs": _highs_file, "scip": _scip_file, "slx": _slx_file,
}  # fmt: skip
"""Functions that write a starting point, by the layout that the table of solvers names."""

STARTS: Final = {name: solver.start for name, solver in SOLVERS.items() if solver.start is not None}
"""The files of starting points, by solver."""


def start_name(stem: str, solver: str) -> str:
    """The name of the file with the starting point of a problem for a solver."""
    return f"{stem}.{solver}.start{STARTS[solver].suffix}"


def complete_start(problem: Problem, field: CrossField) -> Start:
    """The complete point of a field in the columns of the LP and MPS files.

    If LP and MPS cannot hold the problem, in the columns of the .nl file. Raises InstanceError when the field
    is on another instance.
    """
    try:
        held = problem_in_format(problem, FORMATS["mps"])
    except UnsupportedByFormatError:
        held = problem
    return Start(held, held.point(field))


def write_start(problem: Problem, field: CrossField, path: str | Path, solver: str) -> float | None:
    """Write the start in the format of a solver, and return its objective.

    None, and no file, for a solver that takes no start of the problem. Raises InstanceError when the field is
    on another instance, and OutputError.
    """
    start = complete_start(problem, field)
    file = STARTS[solver]
    if suitability(problem, solver).answer == "no" or (file.needs_convex and not start.problem.is_convex):
        return None
    save_file(Path(path), LAYOUTS[file.layout](start))
    return start.objective


def write_starts(problem: Problem, field: CrossField, folder: Path, stem: str) -> dict[str, Path]:
    """Write the starts to the folder, as `stem.gurobi.start.mst`, for each solver that takes the problem.

    Returns the files by solver, none for a problem without integers, where they have no use. Raises as
    `write_start`.
    """
    paths = {solver: folder / start_name(stem, solver) for solver in STARTS if problem.integer.any()}
    return {
        solver: path
        for solver, path in paths.items()
        if write_start(problem, field, path, solver) is not None
    }
