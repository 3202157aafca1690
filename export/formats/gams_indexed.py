"""GAMS, indexed layout: sets, data and equations in the paper's notation; only the data grow.

    r / 00*05 /, c / 00*07 /                 rows and columns, padded: alpha('01','04') is alpha_01_04
    I(r,c) / 00.(02*07) ... /                pixels, one run per line; S_c(r,c) stroke pixels, where w > 0
    E(r,c,side)                              pairs, upper or right: s('01','04','u') is s_01_04_u
    north(side), east(side)                  to pixel j: alpha_j is alpha(r-north(side),c+east(side))
    c14(E(r,c,side)).. s(r,c,side) =g= ...   an equation for every family of rows, from its declaration

GAMS computes windows and jump bounds from theta by our formulas, in the same doubles. Lag and lead count
places in an ordered set, hence the padded labels in their natural order; a neighbour outside the grid has no
label and no pair. Names are case-insensitive (G4), so the set is S_c and not S. `beta` and `gamma` are
functions of GAMS, but a declared symbol of that name takes precedence, so variables keep the names of the
paper (tested through CONVERT). Type, options, signs, powers, the start and the CSV of `--RESULTS` are as in
the scalar layout (gams_scalar.py).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import sympy as sp

from ...models.formulations.families import Block, PlacedFamily
from ...models.formulations.names import Bytes, element_names
from ...models.formulations.problem import Problem
from ...models.formulations.symbols import IndexSet, Variable, elements
from ...models.instance.grid import Floats
from ...models.instance.instance import Instance
from ...templates import stream
from ..writing.canonical import Canonical
from ..writing.counting import Expected, check
from ..writing.records import Counted, Words, number, render, words
from .gams_scalar import MODEL_TYPES, SENSES, Scalar
from .indexed import Indexed, check_indexed, described, narrowed

SETS: Final[dict[IndexSet, str]] = {"pixels": "I", "strokes": "S_c", "pairs": "E"}
DOMAINS: Final[dict[IndexSet, str]] = {
    "pixels": "r,c",
    "strokes": "r,c",
    "pairs": "r,c,side",
}
SECOND: Final = "r-north(side),c+east(side)"
"""The pixel j of the pair (r,c,side)."""


def generate(form: Canonical, header: list[str], *, start: Floats | None = None) -> Iterator[bytes]:
    """The bytes of the GAMS file, block by block. header: lines of comment. start: a point (columns,).

    Raises UnsupportedByFormatError for a weight that solvers would drop, and for columns fixed.
    """
    problem, instance, counts = form.problem, form.problem.instance, Counter[str]()
    check_indexed(problem, "gms in indexed layout", "the scalar layout")
    blocks = {
        "pixels": _pixels(instance, counts),
        "theta": _data(keys(instance, "strokes"), instance.target, counts, "strokes"),
        "w": _data(keys(instance, "strokes"), instance.w, counts, "reliabilities of strokes"),
        "jumps": _jumps(problem, counts),
        "start": () if start is None else _start(problem, start),
        "results": _results(problem),
        **{
            name: _data(keys(instance, over), problem.data[name].astype(np.float64), counts, name)
            for over, names in narrowed(problem).items()
            for name in names
        },
    }
    objective = None if start is None else number(problem.objective_value(start))
    context = _data_context(problem) | _model_context(problem)
    yield from stream(
        "models/gams_indexed.gms.j2", blocks, header=header, stamp=problem.stamp, start=objective, **context
    )
    listed = Expected(problem).data()
    bounds = {name: elements(instance, over) for over, names in narrowed(problem).items() for name in names}
    check(counts, listed | bounds | {"reliabilities of strokes other than 0": listed["strokes"]})


def _data_context(problem: Problem) -> dict[str, Any]:
    """Data of the instance for the template."""
    instance, grid = problem.instance, problem.instance.grid
    pairs = len(grid.first) > 0
    digits = _label_width(instance)
    return {
        "zero": "0" * digits,
        "last_row": f"{grid.height - 1:0{digits}}",
        "last_column": f"{grid.width - 1:0{digits}}",
        "gauge": instance.gauge,
        "w_strokes": number(instance.stroke_coefficient),
        "w_beta": number(instance.skew_coefficient),
        "pairs": pairs,
        "windows": [(name, DOMAINS[over]) for over, names in narrowed(problem).items() for name in names],
        "jumps": pairs and problem.jumps is not None,
        "jump_bounds": pairs and problem.jumps is None,
        "second": SECOND,
    }


def _model_context(problem: Problem) -> dict[str, Any]:
    """Variables, terms and rows as the template prints them."""
    return {
        "variables": [
            _variable(problem.variable(block.name), block) for block in problem.blocks.values() if block.count
        ],
        "terms": [_described(family) for family in problem.objective],
        "rows": [_described(family) | {"condition": _condition(family)} for family in problem.rows],
        "model_type": MODEL_TYPES[problem.problem_class],
    }


def keys(instance: Instance, over: IndexSet) -> Bytes:
    """GAMS's keys of all elements of an index set, `01.04` or `01.04.u`, shape (count, width)."""
    names = element_names(instance, "", over)[:, 1:].copy()
    names[names == ord("_")] = ord(".")
    return names


def _label_width(instance: Instance) -> int:
    return int(keys(instance, "pixels").shape[1]) // 2


def _pixels(instance: Instance, counts: Counter[str]) -> Iterator[bytes]:
    """The mask, one run of pixels per line: `00.(02*07)`."""
    grid, pixels, width = instance.grid, keys(instance, "pixels"), _label_width(instance)
    breaks = np.nonzero((np.diff(grid.rows) != 0) | (np.diff(grid.columns) != 1))[0]
    first, last = np.append(0, breaks + 1), np.append(breaks, grid.size - 1)
    row, begin, end = (
        Words(part, None)
        for part in (pixels[first, :width], pixels[first, width + 1 :], pixels[last, width + 1 :])
    )
    yield from render([row, b".(", begin, b"*", end, b")\n"], len(first))
    counts["pixels"] += int((last - first + 1).sum())


def _data(listed: Bytes, values: Floats, counts: Counter[str], what: str) -> Iterator[bytes]:
    """One value per line: `00.02 0.3`. Counts lines, and nonzero values."""
    key = Counted(counts, what, Words(listed, None))
    value = Counted(counts, f"{what} other than 0", words(values))
    return render([key, b" ", value, b"\n"], len(listed))


def _jumps(problem: Problem, counts: Counter[str]) -> Iterator[bytes]:
    if problem.jumps is not None:
        at = np.nonzero(problem.jumps)[0]
        yield from _data(
            keys(problem.instance, "pairs")[at], problem.jumps[at].astype(np.float64), counts, "jumps"
        )


def _start(problem: Problem, start: Floats) -> Iterator[bytes]:
    for block in problem.blocks.values():
        if block.count:
            yield f"Parameter start_{block.name}({DOMAINS[block.over]}) /\n".encode()
            level = words(start[block.slice])
            key = Words(keys(problem.instance, block.over), None)
            yield from render([key, b" ", level, b"\n"], block.count)
            over = SETS[block.over]
            yield f"/;\n{block.name}.l({over}) = start_{block.name}({over});\n".encode()


def _results(problem: Problem) -> Iterator[bytes]:
    """A loop for each block of columns that prints its names and values."""
    for block in problem.blocks.values():
        if block.count:
            domain, side = DOMAINS[block.over], " '_' side.tl:0" if block.over == "pairs" else ""
            name, value = f"'{block.name}_' r.tl:0 '_' c.tl:0{side}", f"{block.name}.l({domain}):0"
            yield f"loop({SETS[block.over]}({domain}), put {name} ',' {value} /);\n".encode()


def _variable(variable: Variable, block: Block) -> dict[str, str]:
    return {
        "keyword": "Integer Variable" if block.integer else "Variable",
        "name": block.name,
        "domain": DOMAINS[block.over],
        "meaning": variable.meaning,
        "set": SETS[block.over],
        "lower": _bound(variable.lower, block.over),
        "upper": _bound(variable.upper, block.over),
    }


def _bound(expression: sp.Expr, over: IndexSet) -> str:
    """A bound of a variable for all elements of its set."""
    if expression.is_infinite:
        return "-inf" if expression.is_extended_negative else "+inf"
    return _Gams(over, SETS[over]).bound(expression)


def _described(family: PlacedFamily) -> dict[str, str]:
    domain = DOMAINS[family.family.over]
    controls = f"{SETS[family.family.over]}({domain})"
    return described(_Gams, family, SENSES) | {"domain": domain, "controls": controls}


class _Gams(Indexed):
    """The language of indexed GAMS."""

    index = DOMAINS
    second = SECOND
    brackets = "()"

    power = Scalar.power

    def exact(self, constant: sp.Expr) -> str:
        """A positive rational multiple of a power of pi: `2`, `pi/4`, `19*sqr(pi)`."""
        numerator, denominator = sp.fraction(constant)
        rational, rest = numerator.as_coeff_Mul()
        base, exponent = rest.as_base_exp()
        pi = {0: "", 1: "pi", 2: "sqr(pi)"}[int(exponent) if base == sp.pi else 0]
        text = "*".join(filter(None, (str(rational) if rational != 1 or not pi else "", pi)))
        return text if denominator == 1 else f"{text}/{denominator}"


def _condition(family: PlacedFamily) -> str:
    """A condition for rows that are needed only for one parity of a bound."""
    if family.family.only is None:
        return ""
    name, parity = family.family.only
    return f"$(mod(abs({name}({DOMAINS[family.family.over]})), 2) = {parity})"
