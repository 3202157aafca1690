"""A tenth formulation with a symbol of its own, a ninth format and another solver, while a context lasts.

Each is added as its author would add it: a symbol in the tables of symbols, a formulation as one function, a
format as a line and a module, and a solver as a line.
"""

from __future__ import annotations

import sys
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from types import ModuleType
from unittest.mock import patch

from crossfield.export import solvers_table
from crossfield.export.formats import lp, registry
from crossfield.models.formulations import declaration, symbols
from crossfield.models.formulations.catalogue import jump_bounds, skew, strokes
from crossfield.models.formulations.declaration import E, formulation, row, term
from crossfield.models.formulations.expressions import ZERO, Symbol, absolute

v = Symbol("v")
"""The new symbol: the absolute change of direction across a pair."""

VARIABLE = symbols.Variable("v", "pairs", ZERO, None, absolute(symbols.A), "change of direction")
FORMAT = registry.Format("toy", "LP with another suffix", 2, "toy", command="toy {model} {answer}")
SOLVER = replace(solvers_table.SOLVERS["highs"], name="twin", title="Twin", formats=("mps", "toy"))


def directions(stroke_norm: int = 1):
    """Directions alone."""
    yield term("smooth", E, 2 * v)
    yield row(14, E, v >= symbols.A)
    yield row(15, E, v >= -symbols.A)
    yield from jump_bounds()
    yield from strokes(stroke_norm)
    yield from skew(norm=1)


@contextmanager
def additions():
    """The declaration of the formulation `toy`, which minimises changes of direction."""
    module = ModuleType("crossfield.export.formats.toy")
    module.generate = lp.generate
    tables = (
        (symbols.VARIABLES, {"v": VARIABLE}),
        (symbols.NARROWED, {"v": VARIABLE}),
        (symbols.SLOTS["pairs"], {v: ("v", "itself")}),
        (symbols.LATEX, {v: "v_{ij}"}),
        (registry.FORMATS, {"toy": FORMAT}),
        (solvers_table.SOLVERS, {"twin": SOLVER}),
        (sys.modules, {module.__name__: module}),
        (declaration._TABLE, {}),
    )
    with ExitStack() as stack:
        for table, entries in tables:
            stack.enter_context(patch.dict(table, entries))
        add = formulation(
            "toy", paper="a test", kind="MILP", short="toy", minimises="changes of direction", how="alone"
        )
        yield add(directions)
