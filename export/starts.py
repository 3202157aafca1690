"""Starting points as each solver takes them beside an LP, MPS or .nl file: complete and feasible in the formulation's own variables.

    gurobi   .mst   lines `name value`                                  Gurobi: model.read(...), or its command line's InputFile
    cplex    .mst   XML with one <variable name index value> a column   CPLEX: read file.mst, MIP_starts.read
    highs    .sol   style 0: `# Columns n`, lines `name value`           HiGHS: --read_solution_file, readSolution
    scip     .sol   lines `name value`                                   SCIP: read file.sol, readSol
    xpress   .slx   `NAME`, lines ` C name value`, `ENDATA`              Xpress: readslxsol

Names are those of our files. (.nl and GAMS files hold a starting point themselves.) A start for LP and MPS has the columns of these
files: with products lifted where they are lifted, and ONE. SCIP reads a nonlinear objective as a variable of its own, under three
names: quadobjvar (LP), qmatrixvar (MPS), nlobjvar (.nl); all three are in its file with the value of what is not linear in the
objective, and SCIP passes over the ones it does not know.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.sax.saxutils import quoteattr

import numpy as np

from ..models.errors import InputError, UnsupportedByFormatError, UnsupportedBySolverError
from ..models.field import CrossField
from ..models.grid import Floats
from ..models.problem import Problem
from ..models.storage import write_bytes
from .capabilities import takes
from .formats import FORMATS, carried
from .lp import needs_one
from .names import ONE, column_names, family_names
from .records import number


@dataclass(frozen=True, eq=False)
class Start:
    """A complete point of a problem as a format holds it: names and values of all columns, ONE included, and its objective."""

    problem: Problem
    point: Floats

    @property
    def objective(self) -> float:
        """The objective, recomputed."""
        return self.problem.objective_value(self.point)

    def lines(self) -> Iterator[tuple[str, str]]:
        """Name and value of every column, shortest round trip."""
        names = [bytes(row).rstrip(b"\0").decode() for row in column_names(self.problem)]
        yield from zip(names, map(number, self.point.tolist()), strict=True)
        if needs_one(self.problem):
            yield ONE.decode(), "1"

    def activities(self) -> Iterator[tuple[str, str]]:
        """Name and value of every row, constants on its right side."""
        for family in self.problem.rows:
            names = (bytes(row).decode() for row in family_names(family))
            yield from zip(
                names, map(number, (family.values(self.point) + family.limit).tolist()), strict=True
            )
        if not self.problem.rows:
            yield "c_ONE", "1"


def _gurobi(start: Start) -> Iterator[str]:
    yield f"# MIP start, objective {number(start.objective)}"
    for name, value in start.lines():
        yield f"{name} {value}"


def _cplex(start: Start) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>'
    yield '<CPLEXSolutions version="1.2">'
    yield '<CPLEXSolution version="1.2">'
    yield f'<header problemName={quoteattr(start.problem.instance.name)} solutionName="start" solutionIndex="0" MIPStartEffortLevel="4"/>'
    yield "<variables>"
    for place, (name, value) in enumerate(start.lines()):
        yield f'<variable name="{name}" index="{place}" value="{value}"/>'
    yield from ("</variables>", "</CPLEXSolution>", "</CPLEXSolutions>")


def _highs(start: Start) -> Iterator[str]:
    columns = list(start.lines())
    yield from ("Model status", "Unknown", "", "# Primal solution values", "Feasible")
    yield f"Objective {number(start.objective)}"
    yield f"# Columns {len(columns)}"
    for name, value in columns:
        yield f"{name} {value}"
    rows = list(start.activities())
    yield f"# Rows {len(rows)}"
    for name, value in rows:
        yield f"{name} {value}"


def _scip(start: Start) -> Iterator[str]:
    yield "solution status: unknown"
    yield f"objective value: {number(start.objective)}"
    for name, value in start.lines():
        yield f"{name} {value}"
    for name, part in _objective_variables(start).items():
        yield f"{name} {number(part)}"


def _objective_variables(start: Start) -> dict[str, float]:
    """The variables that stand for an objective in SCIP, at what is not linear in it; none where nothing is."""
    problem, point = start.problem, start.point
    if problem.objective_degree < 2:
        return {}
    curved = sum(float(np.sum(family.values(point))) for family in problem.objective if family.degree > 1)
    found = {"nlobjvar": curved}
    if problem.objective_degree == 2:
        index, cost = problem.merged_objective(1)
        constant = float(problem.merged_objective(0)[1][0])
        squares = start.objective - float(point[index[:, 0]] @ cost) - constant
        found |= {"quadobjvar": squares, "qmatrixvar": squares}
    return found


def _xpress(start: Start) -> Iterator[str]:
    yield f"NAME {start.problem.instance.name}"
    for name, value in start.lines():
        yield f" C {name} {value}"
    yield "ENDATA"


@dataclass(frozen=True)
class StartFormat:
    """A format of starting points: the solver, the suffix of its files, their lines, and how they are read.

    convex: whether the solver uses it for convex problems only.
    """

    solver: str
    suffix: str
    lines: Callable[[Start], Iterator[str]]
    use: str
    convex: bool = False


STARTS: Final = {
    entry.solver: entry
    for entry in (
        StartFormat("gurobi", ".mst", _gurobi, "gurobi_cl InputFile=START.mst MODEL.mps"),
        StartFormat("cplex", ".mst", _cplex, "read MODEL.mps, then read START.mst"),
        StartFormat("highs", ".sol", _highs, "highs --read_solution_file START.sol MODEL.mps"),
        StartFormat("scip", ".sol", _scip, "read MODEL.mps (or .nl), then read START.sol"),
        StartFormat("xpress", ".slx", _xpress, "READPROB MODEL.mps, then READSLXSOL START.slx", convex=True),
    )
}  # fmt: skip
"""The table of formats of starting points, by solver."""


def start_of(problem: Problem, field: CrossField) -> Start:
    """The complete point of a field in the columns of the LP and MPS files; those of the .nl file where LP and MPS hold nothing.

    Raises InstanceError when the field is on another instance.
    """
    try:
        held = carried(problem, FORMATS["mps"])
    except UnsupportedByFormatError:
        held = problem
    return Start(held, held.point(field))


def write_start(problem: Problem, field: CrossField, path: str | Path, solver: str) -> float:
    """The objective of the start now in the file, in that solver's format.

    Raises InputError for a solver that has no format of starts, UnsupportedBySolverError for one that does not take the problem;
    InstanceError when the field is on another instance, OutputError.
    """
    if solver not in STARTS:
        raise InputError(f"there is no start format of {solver!r}; choose one of {', '.join(STARTS)}")
    taking = takes(problem, solver)
    if taking.answer == "no":
        raise UnsupportedBySolverError(f"{solver} does not take {problem.name}: {taking.reason}")
    start = start_of(problem, field)
    if STARTS[solver].convex and not start.problem.convex:
        raise UnsupportedBySolverError(
            f"{solver} uses a start of convex problems only, and {problem.name} is not convex there"
        )
    write_bytes(path, "".join(f"{line}\n" for line in STARTS[solver].lines(start)).encode())
    return start.objective


def write_starts(problem: Problem, field: CrossField, folder: str | Path, stem: str) -> dict[str, Path]:
    """The files now in the folder, by solver: `stem.gurobi.mst` and so on, for the solvers that take the problem.

    None for a problem without integers, where these files mean nothing. Raises as `write_start`.
    """
    if not problem.integer.any():
        return {}
    convex = start_of(problem, field).problem.convex
    solvers = [
        name
        for name, entry in STARTS.items()
        if takes(problem, name).answer != "no" and (convex or not entry.convex)
    ]
    paths = {name: Path(folder) / f"{stem}.{name}{STARTS[name].suffix}" for name in solvers}
    for name, path in paths.items():
        write_start(problem, field, path, name)
    return paths
