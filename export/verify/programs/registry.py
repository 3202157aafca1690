"""The programs that our files are for, as far as they can be had for free: one table, and how each is reached.

A program's module is imported in a child process only (worker.py). It has

    version() -> str                                 of the program
    read(path) -> Meaning                            the algebra of an LP or MPS file, where it tells it
    evaluate(path, points) -> Evaluation             the behaviour of a file of another format
    solve(path, seconds, solver) -> Outcome          its answer, where it solves

and raises Refused, NotTold or TooLarge. Files come unpacked; the current folder is its own.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Final


class Refused(Exception):  # noqa: N818 - it is an answer
    """What a program says when it does not take a file."""


class NotTold(Exception):  # noqa: N818 - it is an answer
    """What a program read, but does not tell in a form that can be compared."""


class TooLarge(Exception):  # noqa: N818 - it is an answer
    """A file beyond the size of a program's free edition."""


@dataclass(frozen=True)
class Consumer:
    """A program that reads our files.

    algebra, behaviour: the formats of which it tells coefficients, or values. needs: its Python package, or its executable.
    tolerance: relative difference of the numbers that it tells, 0 for equal to the bit. free: what its free edition takes.
    solvers: the solvers that it is asked for (names of EXTERNALS); none when it solves nothing.
    """

    name: str
    title: str
    algebra: tuple[str, ...]
    behaviour: tuple[str, ...]
    needs: str
    install: str
    solvers: tuple[str, ...]
    tolerance: float = 0.0
    free: str = ""

    @property
    def formats(self) -> tuple[str, ...]:
        """The formats it reads."""
        return self.algebra + self.behaviour

    @property
    def present(self) -> bool:
        """Whether it is installed."""
        return (
            shutil.which(self.needs) is not None
            if self.install.startswith("apt ")
            else find_spec(self.needs) is not None
        )


CONSUMERS: Final = {
    entry.name: entry
    for entry in (
        Consumer("highs", "HiGHS", ("lp", "mps"), (), "highspy", "pip install highspy", ("highs",)),
        Consumer("gurobi", "Gurobi", ("lp", "mps"), (), "gurobipy", "pip install gurobipy", ("gurobi",), free="2000 columns and rows, 200 columns with quadratic terms"),
        Consumer("cplex", "CPLEX", ("lp", "mps"), (), "cplex", "pip install cplex", ("cplex",), 1e-15, "1000 columns and 1000 rows"),
        Consumer("xpress", "Xpress", ("lp", "mps"), (), "xpress", "pip install xpress", ("xpress",), free="5000 rows and columns, 200 with quadratic terms"),
        Consumer("scip", "SCIP", ("lp", "mps"), ("nl", "osil"), "pyscipopt", "pip install pyscipopt", ("scip",)),
        Consumer("cbc", "CBC", ("lp", "mps"), (), "cbc", "apt install coinor-cbc", ("cbc",), 1e-6),
        Consumer("glpk", "GLPK", ("lp", "mps"), ("mod",), "glpsol", "apt install glpk-utils", ("glpk",), 1e-14),
        Consumer("asl", "AMPL Solver Library", (), ("nl",), "gjh_asl_json", "apt install gjh-asl-json", ()),
        Consumer("casadi", "CasADi", (), ("nl",), "casadi", "pip install casadi", ("ipopt", "bonmin")),
        Consumer("gams", "GAMS", (), ("gms",), "gamspy_base", "pip install gamspy_base gamspy_baron", ("gams-cplex", "baron"), free="2000 linear or 1000 nonlinear columns and rows, 50 for BARON"),
    )
}  # fmt: skip
"""The table of consumers; the verification, its tests and its documentation are generated from it."""


ADDED: Final = {"baron": "gamspy_baron"}
"""Solvers that their consumer has only with another Python package."""


def lacking(solver: str) -> str:
    """How to install a solver that its consumer lacks; empty when it is there."""
    package = ADDED.get(solver)
    return f"pip install {package}" if package is not None and find_spec(package) is None else ""


def absent() -> dict[str, str]:
    """The consumers that are not here, and how to install them."""
    return {entry.name: entry.install for entry in CONSUMERS.values() if not entry.present}


def program(name: str) -> str:
    """The path of a consumer's executable."""
    return shutil.which(CONSUMERS[name].needs) or CONSUMERS[name].needs


def file_names(path: Path) -> tuple[list[str], list[str]]:
    """Names of columns and of rows of an .nl file, from the .col and .row beside it; the objective's name comes last and is left out."""
    columns, rows = (path.with_suffix(suffix).read_text().split() for suffix in (".col", ".row"))
    return columns, [name for name in rows if name != "obj"]
