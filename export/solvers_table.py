"""Which solver takes what: one table with reasons, for solvers anywhere, not only for those that are installed here.

A refusal names a trait of a problem *as the format holds it* (LP and MPS hold (8) and (9) with lifted products), and at which step
it strikes: `read`: the file is not taken; `solve`: it is read, but not solved, or not to a proven optimum. The tests hand each
combination to the real solver.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple

import numpy as np

from ..models.errors import UnsupportedByFormatError
from ..models.formulations.declaration import Formulation
from ..models.formulations.problem import Problem
from ..models.instance.instance import Instance
from .formats.registry import FORMATS, carried

Step = Literal["read", "solve", "local"]


class Refusal(NamedTuple):
    """Why a solver does not take a trait, and where that shows: `local` means that it answers, without proof."""

    step: Step
    reason: str


TRAITS: Final[dict[str, Callable[[Problem], bool]]] = {
    "a cosine": lambda p: max(p.objective_degree, p.row_degree) > 4,
    "anything beyond linear": lambda p: max(p.objective_degree, p.row_degree) > 1,
    "quadratic rows": lambda p: p.row_degree == 2,
    "integers and a quadratic objective": lambda p: (
        bool(p.integer.any()) and p.objective_degree == 2 and p.row_degree < 2
    ),
    "a non-convex quadratic objective": lambda p: (
        p.objective_degree == 2 and p.row_degree < 2 and not p.convex
    ),
    "integers": lambda p: bool(p.integer.any()),
    "non-convexity": lambda p: not p.convex and max(p.objective_degree, p.row_degree) > 1,
}
"""What a solver may not take."""


@dataclass(frozen=True)
class External:
    """A solver: the formats it reads, the preferred one first, and what it refuses, by trait."""

    name: str
    title: str
    formats: tuple[str, ...]
    refusals: dict[str, Refusal] = field(default_factory=dict)

    def refusal(self, held: Problem, *steps: Step) -> Refusal | None:
        """Its first refusal of a problem, as a format holds it, at one of these steps (all by default)."""
        for trait, refusal in self.refusals.items():
            if TRAITS[trait](held) and (refusal.step in steps or not steps):
                return refusal
        return None


_LINEAR_ONLY: Final = "it takes linear models only"

EXTERNALS: Final = {
    entry.name: entry
    for entry in (
        External("gurobi", "Gurobi", ("mps", "lp")),
        External("cplex", "CPLEX", ("mps", "lp"), {
            "quadratic rows": Refusal("solve", "error 5002: CPLEX takes quadratic rows only when they are convex; write milp-mccormick or miqp-mccormick"),
            "a non-convex quadratic objective": Refusal("solve", "error 5002: CPLEX takes a non-convex objective only with its parameter optimalitytarget = 3"),
        }),
        External("xpress", "Xpress", ("mps", "lp")),
        External("highs", "HiGHS", ("mps", "lp"), {
            "quadratic rows": Refusal("read", "HiGHS reads no quadratic rows"),
            "integers and a quadratic objective": Refusal("solve", "HiGHS reads an MIQP, but does not solve it"),
            "a non-convex quadratic objective": Refusal("solve", "HiGHS solves convex QPs only, and may call a stationary point of another one optimal"),
        }),
        External("scip", "SCIP", ("nl", "mps", "lp", "osil")),
        External("baron", "BARON", ("gms", "nl"), {"a cosine": Refusal("solve", "BARON has no trigonometric functions; write minlp-quartic, which is the same problem for whole jumps")}),
        External("bonmin", "Bonmin", ("nl", "gms"), {"non-convexity": Refusal("local", "Bonmin is exact for convex problems, elsewhere a heuristic")}),
        External("ipopt", "Ipopt", ("nl", "gms"), {
            "integers": Refusal("solve", "Ipopt drops integrality; relax it, or fix the jumps"),
            "non-convexity": Refusal("local", "Ipopt finds local optima"),
        }),
        External("gams-cplex", "CPLEX in GAMS", ("gms",), {
            "a cosine": Refusal("solve", "CPLEX takes nothing beyond quadratic"),
            "quadratic rows": Refusal("solve", "CPLEX takes quadratic rows only when they are convex"),
            "non-convexity": Refusal("solve", "CPLEX takes convex problems up to quadratic"),
        }),
        External("cbc", "CBC", ("mps", "lp"), {"anything beyond linear": Refusal("read", _LINEAR_ONLY)}),
        External("glpk", "GLPK", ("mps", "lp", "mod"), {"anything beyond linear": Refusal("read", _LINEAR_ONLY)}),
    )
}  # fmt: skip
"""The table of solvers; `crossfield list`, the manifests, the verification and the docs are generated from it."""


class Taking(NamedTuple):
    """Whether a solver takes a problem: `yes`, `local` (it answers without proof) or `no`; in which format, and the reason for no yes."""

    answer: Literal["yes", "local", "no"]
    format: str
    reason: str


def takes(problem: Problem, solver: str) -> Taking:
    """Whether the solver takes the problem, and in which format: the first one with the best answer."""
    found = [takes_in(problem, solver, name) for name in EXTERNALS[solver].formats]
    return min(found, key=lambda each: ("yes", "local", "no").index(each.answer))


def takes_in(problem: Problem, solver: str, name: str) -> Taking:
    """Whether the solver takes the problem in the format of that name."""
    try:
        held = carried(problem, FORMATS[name])
    except UnsupportedByFormatError as error:
        return Taking("no", name, str(error))
    entry = EXTERNALS[solver]
    refusal = entry.refusal(held, "read", "solve") or entry.refusal(held)
    if refusal is None:
        return Taking("yes", name, "")
    return Taking("local" if refusal.step == "local" else "no", name, refusal.reason)


def takers(problem: Problem) -> dict[str, Taking]:
    """What each solver says to a problem."""
    return {name: takes(problem, name) for name in EXTERNALS}


def smallest(formulation: Formulation) -> Problem:
    """The formulation on an instance of two pixels: enough to ask what a format carries and a solver takes."""
    pixels, ones = np.zeros((1, 2), dtype=np.int32), np.ones(1)
    instance = Instance("smallest", np.ones((1, 2), dtype=bool), pixels, ones, ones)
    return Problem(instance, formulation, np.zeros(1, dtype=np.int32) if formulation.fixed else None)
