"""The one table of solvers: formats, refusals, starts, proofs, and the programs that contain them.

It describes solvers anywhere, not only the installed ones. `crossfield list`, the manifests,
starting points, solving, verification, the library and the docs are generated from it; one entry adds a
solver.

A refusal names a trait of a problem *as the format holds it* (LP and MPS hold (8) and (9) with lifted
products), and its stage. `read`: the file is not taken; `solve`: it is read, but not solved, or not to a
proven optimum. The tests pass each combination to the real solver.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Final, Literal, NamedTuple

import numpy as np

from ..models.errors import UnsupportedByFormatError
from ..models.formulations.declaration import Formulation
from ..models.formulations.problem import Problem
from ..models.instance.instance import Instance
from .formats.registry import FORMATS, problem_in_format
from .licences import licence_error

Stage = Literal["read", "solve", "local"]
Proof = Literal["global", "convex", "local"]


class Refusal(NamedTuple):
    """Reason why a solver does not take a trait, and the stage; `local`: it answers, without proof."""

    stage: Stage
    reason: str


TRAITS: Final[dict[str, Callable[[Problem], bool]]] = {
    "a cosine": lambda p: max(p.objective_degree, p.row_degree) > 4,
    "anything beyond linear": lambda p: max(p.objective_degree, p.row_degree) > 1,
    "quadratic rows": lambda p: p.row_degree == 2,
    "integers and a quadratic objective": lambda p: (
        bool(p.integer.any()) and p.objective_degree == 2 and p.row_degree < 2
    ),
    "a non-convex quadratic objective": lambda p: (
        p.objective_degree == 2 and p.row_degree < 2 and not p.is_convex
    ),
    "integers": lambda p: bool(p.integer.any()),
    "non-convexity": lambda p: not p.is_convex and max(p.objective_degree, p.row_degree) > 1,
}
"""Traits of problems that a solver may refuse."""


@dataclass(frozen=True)
class Program:
    """A Python package or an executable that reads our files, and may contain solvers.

    algebra, behaviour: the formats for which it reports coefficients, or values at points. needs: its
    package, or its executable. tolerance: relative difference of the numbers that it reports, 0 for equal to
    the bit. free: limits of its free edition. adds: pattern of the columns that it adds when it reads or
    writes a model.
    """

    name: str
    title: str
    algebra: tuple[str, ...]
    behaviour: tuple[str, ...]
    needs: str
    install: str
    tolerance: float = 0.0
    free: str = ""
    adds: str = ""

    @property
    def formats(self) -> tuple[str, ...]:
        """The formats it reads."""
        return self.algebra + self.behaviour

    @property
    def missing(self) -> str:
        """Why it cannot be used, and the remedy; empty if it can be used."""
        return self.missing_for(self.title)

    def missing_for(self, title: str) -> str:
        """Why its solver of that title cannot be used, and the remedy; empty if it can be used."""
        executable = self.install.startswith("apt ")
        if (shutil.which(self.needs) if executable else find_spec(self.needs)) is None:
            return f"{title} is not installed; {self.install}"
        if words := licence_error(self.name):
            newer = self.install.replace("install", "install --upgrade")
            return (
                f"{self.title} does not accept its licence ({words}); {newer}, "
                "or install a licence of your own"
            )
        return ""

    @property
    def solvers(self) -> tuple[str, ...]:
        """The names of the solvers that it contains; none if it only reads."""
        return tuple(name for name, solver in SOLVERS.items() if solver.program == self.name)


PROGRAMS: Final = {
    entry.name: entry
    for entry in (
        Program("highs", "HiGHS", ("lp", "mps"), (), "highspy", "pip install highspy"),
        Program(
            "gurobi", "Gurobi", ("lp", "mps"), (), "gurobipy", "pip install gurobipy",
            free="2000 columns and 2000 rows, 200 columns if any term is quadratic",
            adds=r"Constant|(?:MPS_)?Rg.*",
        ),
        Program(
            "cplex", "CPLEX", ("lp", "mps"), (), "cplex", "pip install cplex", 1e-15,
            free="1000 columns and 1000 rows", adds=r"Rg.*",
        ),
        Program(
            "xpress", "Xpress", ("lp", "mps"), (), "xpress", "pip install xpress",
            free="5000 columns and rows in total, 200 if any term is quadratic",
        ),
        Program(
            "scip", "SCIP", ("lp", "mps"), ("nl", "osil"), "pyscipopt", "pip install pyscipopt",
            adds=r"nlobjvar|quadobjvar|qmatrixvar|objconstvar",
        ),
        Program("cbc", "CBC", ("lp", "mps"), (), "cbc", "apt install coinor-cbc", 1e-6),
        Program(
            "glpk", "GLPK", ("lp", "mps", "mod"), (), "glpsol", "apt install glpk-utils", 1e-14,
            adds=r"~r_\d+",
        ),
        Program("casadi", "CasADi", (), ("nl",), "casadi", "pip install casadi"),
        Program(
            "gams", "GAMS", (), ("gms",), "gamspy_base", "pip install gamspy_base gamspy_baron",
            free="2000 linear or 1000 nonlinear columns and rows, 50 for BARON", adds=r"objvar",
        ),
    )
}  # fmt: skip
"""The programs that read our files, as far as they are available for free.

Each has a module in export/programs.
"""


class StartFile(NamedTuple):
    """The file from which a solver starts: its layout (see export/bundle/starts.py), suffix, and use.

    needs_convex: whether the solver uses it only for convex problems.
    """

    layout: str
    suffix: str
    use: str
    needs_convex: bool = False


@dataclass(frozen=True)
class Solver:
    """A solver: the formats it reads, the preferred one first, its program, and its refusals, by trait.

    program: the name of the program that contains it. package: an additional Python package. proves:
    `global`: all optima of the problems that it takes are proven; `convex`: those of convex problems;
    `local`: none. start: the file with a starting point for a model, if it takes one. answers: suffix of its
    solution files. is_bundled: whether it is installed with crossfield. not_for: classes of problems for
    which other bundled solvers come first. vendor: its maker, if the table has others of the same maker:
    together they count as one opinion. feasible_within: largest violation of a row by the points that it
    reports.
    """

    name: str
    title: str
    formats: tuple[str, ...]
    program: str
    refusals: dict[str, Refusal] = field(default_factory=dict)
    package: str = ""
    proves: Proof = "global"
    start: StartFile | None = None
    answers: str = ".sol"
    is_bundled: bool = False
    not_for: tuple[str, ...] = ()
    vendor: str = ""
    feasible_within: float = 5e-6  # solvers keep to 1e-6 in rows that they scale

    @property
    def maker(self) -> str:
        """The maker of the solver."""
        return self.vendor or self.title

    def refusal(self, held: Problem, *stages: Stage) -> Refusal | None:
        """Its first refusal of a problem, as a format holds it, at one of these stages (all by default)."""
        for trait, refusal in self.refusals.items():
            if TRAITS[trait](held) and (refusal.stage in stages or not stages):
                return refusal
        return None

    @property
    def missing(self) -> str:
        """Why it cannot be used, and the remedy; empty if it can be used."""
        if missing := PROGRAMS[self.program].missing_for(self.title):
            return missing
        absent = self.package and find_spec(self.package) is None
        return f"{self.title} is not installed; pip install {self.package}" if absent else ""


_LINEAR_ONLY: Final = {"anything beyond linear": Refusal("read", "it takes linear models only")}

SOLVERS: Final = {
    entry.name: entry
    for entry in (
        Solver(
            "gurobi", "Gurobi", ("mps", "lp"), "gurobi",
            start=StartFile("list", ".mst", "gurobi_cl InputFile=START.mst MODEL.mps"), answers=".json",
        ),
        Solver(
            "cplex", "CPLEX", ("mps", "lp"), "cplex",
            {
                "quadratic rows": Refusal(
                    "solve",
                    "error 5002: CPLEX takes quadratic rows only when they are convex; "
                    "write milp-mccormick or miqp-mccormick",
                ),
                "a non-convex quadratic objective": Refusal(
                    "solve",
                    "error 5002: CPLEX takes a non-convex objective only "
                    "with its parameter optimalitytarget = 3",
                ),
            },
            start=StartFile("cplex", ".mst", "read MODEL.mps, then read START.mst"), vendor="IBM",
        ),
        Solver(
            "xpress", "Xpress", ("mps", "lp"), "xpress",
            start=StartFile(
                "slx", ".slx", "READPROB MODEL.mps, then READSLXSOL START.slx", needs_convex=True
            ),
            answers=".slx",
        ),
        Solver(
            "highs", "HiGHS", ("mps", "lp"), "highs",
            {
                "quadratic rows": Refusal("read", "HiGHS reads no quadratic rows"),
                "integers and a quadratic objective": Refusal(
                    "solve", "HiGHS reads an MIQP, but does not solve it"
                ),
                "a non-convex quadratic objective": Refusal(
                    "solve",
                    "HiGHS solves convex QPs only, and may call a stationary point of another one optimal",
                ),
            },
            start=StartFile("highs", ".sol", "highs --read_solution_file START.sol MODEL.mps"),
            is_bundled=True, not_for=("QP",),
        ),
        Solver(
            "scip", "SCIP", ("nl", "mps", "lp", "osil"), "scip",
            start=StartFile("scip", ".sol", "read MODEL.mps (or .nl), then read START.sol"),
        ),
        Solver(
            "baron", "BARON", ("gms", "nl"), "gams",
            {
                "a cosine": Refusal(
                    "solve",
                    "BARON has no trigonometric functions; "
                    "write minlp-quartic, which is the same problem for whole jumps",
                )
            },
            package="gamspy_baron", answers=".csv",
        ),
        Solver(
            "ipopt", "Ipopt", ("nl", "gms"), "casadi",
            {
                "integers": Refusal("solve", "Ipopt drops integrality; relax it, or fix the jumps"),
                "non-convexity": Refusal("local", "Ipopt finds local optima"),
            },
            proves="local", is_bundled=True, vendor="COIN-OR",
        ),
        Solver(
            "bonmin", "Bonmin", ("nl", "gms"), "casadi",
            {
                "non-convexity": Refusal(
                    "local", "Bonmin is exact for convex problems, elsewhere a heuristic"
                )
            },
            proves="convex", is_bundled=True, vendor="COIN-OR",
        ),
        Solver(
            "gams-cplex", "CPLEX in GAMS", ("gms",), "gams",
            {
                "a cosine": Refusal("solve", "CPLEX takes nothing beyond quadratic"),
                "quadratic rows": Refusal("solve", "CPLEX takes quadratic rows only when they are convex"),
                "non-convexity": Refusal("solve", "CPLEX takes convex problems up to quadratic"),
            },
            answers=".csv", vendor="IBM",
        ),
        Solver("cbc", "CBC", ("mps", "lp"), "cbc", _LINEAR_ONLY, vendor="COIN-OR"),
        # Values within 1e-5 of a whole number are reported rounded, which rows multiply by pi/2 or pi.
        Solver("glpk", "GLPK", ("mps", "lp", "mod"), "glpk", _LINEAR_ONLY, feasible_within=5e-5),
    )
}  # fmt: skip
"""The table of solvers. Bundled ones are in the order of preference."""

BUNDLED: Final = {name: solver for name, solver in SOLVERS.items() if solver.is_bundled}
"""The solvers that are installed with crossfield."""


class Suitability(NamedTuple):
    """Whether a solver takes a problem, in which format, and the reason for any answer but `yes`.

    answer: `yes`, `local` (it answers without proof) or `no`.
    """

    answer: Literal["yes", "local", "no"]
    format: str
    reason: str


def suitability(problem: Problem, solver: str) -> Suitability:
    """Whether the solver takes the problem, and in which format: the first one with the best answer."""
    answers = [suitability_in_format(problem, solver, name) for name in SOLVERS[solver].formats]
    return min(answers, key=lambda answer: ("yes", "local", "no").index(answer.answer))


def suitability_in_format(problem: Problem, solver: str, name: str) -> Suitability:
    """Whether the solver takes the problem in the format of that name."""
    try:
        held = problem_in_format(problem, FORMATS[name])
    except UnsupportedByFormatError as error:
        return Suitability("no", name, str(error))
    entry = SOLVERS[solver]
    refusal = entry.refusal(held, "read", "solve") or entry.refusal(held)
    if refusal is None:
        return Suitability("yes", name, "")
    return Suitability("local" if refusal.stage == "local" else "no", name, refusal.reason)


def suitabilities(problem: Problem) -> dict[str, Suitability]:
    """The answer of each solver to a problem."""
    return {name: suitability(problem, name) for name in SOLVERS}


def smallest_problem(formulation: Formulation) -> Problem:
    """The formulation on four pixels: enough to determine what a format carries and a solver takes."""
    pixels, ones = np.zeros((1, 2), dtype=np.int32), np.ones(1)
    mask, orthogonal = np.ones((2, 2), dtype=bool), formulation.declaration.orthogonal
    instance = Instance.on_pixels("smallest", mask, pixels, ones, ones, orthogonal=orthogonal)
    return Problem(
        instance, formulation, np.zeros(4, dtype=np.int32) if formulation.declaration.fixed else None
    )
