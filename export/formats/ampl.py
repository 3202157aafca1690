"""AMPL: a model in the notation of the paper, printed from the declaration, with its data in a .dat file.

    set I dimen 2; set S_c within I;         pixels (r,c) as plain numbers, and those with a stroke
    set E := {(r,c) in I, h in SIDES: ...};  pairs: AMPL finds the upper and the right neighbours itself
    param p_min{(r,c,h) in E} := ...         windows and jump bounds by our formulas, in the same doubles
    var s{(r,c,h) in E} >= 0;
    minimize energy: sum{(r,c,h) in E} ( ...
    subject to c14{(r,c,h) in E}: s[r,c,h] >= ...

The .dat holds the data of the sketch: I, S_c with theta and w, the weights, and the jumps where they
are data. The model uses only features that AMPL and GNU MathProg share: no `solve`, `param pi` computed,
strings in quotes, `mod` of numbers that are not negative, attributes with commas. So GLPK reads the linear
formulations. It also evaluates every expression of the others once variables are turned into parameters, as
the tests do. AMPL itself is not free; no test runs it.

Names: alpha[1,2] is alpha_01_02, p1[1,2,"u"] is p1_01_02_u; row tags are those of the other formats. The .mod
ends with comments that print an answer with our names, as a readable solution file.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...models.errors import UnsupportedByFormatError
from ...models.formulations.expressions import Expression, Factor, Operand, Symbol, expression_of
from ...models.formulations.families import Block, PlacedFamily
from ...models.formulations.names import element_numbers, is_numbered, number_width
from ...models.formulations.problem import Problem
from ...models.formulations.symbols import SCALARS, SLOTS, IndexMap, IndexSet, Variable, point_of
from ...models.instance.instance import Instance
from ...models.instance.mesh import Mesh
from ...templates import stream
from ..writing.canonical import CanonicalForm
from ..writing.expressions import InfixLanguage, wrap_lines
from ..writing.records import (
    Decimals,
    Piece,
    Pieces,
    Words,
    check_coefficients,
    number_text,
    render,
    word_table,
    words,
)

WIDTH: Final = 110
"""Approximate length of lines."""


@dataclass(frozen=True)
class _Indices:
    """Indices of a model: by index set its domain and its index, and the points i and j of a pair.

    A cycle l has sets of tuples that begin with it: its steps, and the strokes at its start and its end.
    """

    domains: dict[IndexSet, str]
    index: dict[IndexSet, str]
    first: str
    second: str


_OF_PIXELS: Final = _Indices(
    {
        "pixels": "{(r,c) in I}",
        "strokes": "{(r,c) in S_c}",
        "pairs": "{(r,c,h) in E}",
        "cycles": "{l in C}",
    },
    {"pixels": "r,c", "strokes": "r,c", "pairs": "r,c,h", "cycles": "l"},
    "r,c",
    "r - north[h], c + east[h]",
)
_OF_FACES: Final = _Indices(
    {"pixels": "{i in I}", "strokes": "{i in S_c}", "pairs": "{e in E}", "cycles": "{l in C}"},
    {"pixels": "i", "strokes": "i", "pairs": "e", "cycles": "l"},
    "first[e]",
    "second[e]",
)


def _indices(instance: Instance) -> _Indices:
    return _OF_FACES if isinstance(instance.domain, Mesh) else _OF_PIXELS


_SUMS: Final[dict[IndexMap, tuple[IndexSet, str, str]]] = {
    "round": ("pairs", "STEPS", "sign[l,{}]*"),
    "start": ("strokes", "STARTS", ""),
    "end": ("strokes", "ENDS", ""),
}
"""Ways from a cycle that are sums: over which index set, by which tuples, with which factor."""
SENSES: Final = {">=": b" >= ", "<=": b" <= ", "==": b" = "}


def generate(form: CanonicalForm, header: list[str]) -> Iterator[bytes]:
    """The bytes of the .mod file. header: lines of comment, without the comment sign.

    Raises UnsupportedByFormatError for a weight that solvers would drop, and for a problem with columns
    fixed.
    """
    problem = form.problem
    _check_problem(problem)
    instance, indices = problem.instance, _indices(problem.instance)
    context = {
        "header": header,
        "sets": ["I", "S_c"] + ["E"] * bool(len(instance.domain.first)),
        "mesh": isinstance(instance.domain, Mesh),
        "weights": instance.pair_weights is not None,
        "orthogonal": instance.orthogonal,
        "gauge": instance.gauge,
        "indices": indices,
        "point": "i" if indices is _OF_FACES else "(r,c)",
        "turn": " + kappa[e]" if indices is _OF_FACES else "",
        "windows": problem.windows is not None,
        "has_alpha": "alpha" in problem.blocks,
        "cycles": _has_columns(problem, "k"),
        "limited": {f"{name}_max": indices.domains[over] for name, over in _limited(problem).items()},
        "jumps": problem.jumps is not None and len(problem.jumps) > 0,
        "variables": [
            _variable_text(problem.variable(block.name), block, indices)
            | {"label": _label(instance, block), "index": indices.index[block.over]}
            for block in problem.blocks.values()
            if block.count
        ],
        "terms": [_family_text(family) for family in problem.objective],
        "rows": [_family_text(family) for family in problem.rows],
    }
    yield from stream("models/ampl.mod.j2", {}, **context)


def generate_data(problem: Problem, header: list[str]) -> Iterator[bytes]:
    """The bytes of the .dat file, block by block. header: lines of comment, without the comment sign."""
    instance = problem.instance
    for line in header:
        yield f"# {line}\n".encode()
    yield b"data;\nset I :=\n"
    yield from _points(instance)
    yield b";\nparam: S_c: theta w :=\n"
    yield from _element_lines(instance, "strokes", [words(instance.target), b" ", words(instance.w)])
    weights = {"w_strokes": instance.stroke_coefficient}
    if not instance.orthogonal:
        weights["w_beta"] = instance.skew_coefficient
    lines = "\n".join(f"param {name} := {number_text(value)};" for name, value in weights.items())
    yield b";\n" + lines.encode() + b"\n"
    yield from _pairs(instance)
    if problem.jumps is not None and len(problem.jumps):
        at = np.nonzero(problem.jumps)[0]
        yield b"param p :=\n"
        yield from _element_lines(instance, "pairs", [words(problem.jumps[at].astype(np.float64))], at)
        yield b";\n"
    yield from _windows(problem)
    yield from _limits_and_cycles(problem)
    yield b"end;\n"


def _windows(problem: Problem) -> Iterator[bytes]:
    """The windows, and the ranges of jumps that are variables, where they are narrower than the gauge's."""
    for over, names in _narrowed_bounds(problem).items():
        yield f"param: {' '.join(names)} :=\n".encode()
        values = (words(problem.data[name].astype(np.float64)) for name in names)
        parts = [part for value in values for part in (b" ", value)][1:]
        yield from _element_lines(problem.instance, over, parts)
        yield b";\n"


def _limits_and_cycles(problem: Problem) -> Iterator[bytes]:
    """Limits of residuals; cycles with their data, the pairs of their steps, and strokes at their ends."""
    instance, data = problem.instance, problem.data
    for name, over in _limited(problem).items() if problem.formulation.options.limits else ():
        yield f"param {name}_max :=\n".encode()
        yield from _element_lines(instance, over, [words(data[f"{name}_max"])])
        yield b";\n"
    if not _has_columns(problem, "k"):
        return
    cycles = instance.cycles
    steps = np.diff(cycles.start)
    names = ("holonomy", "k_min", "k_max", "is_open")
    yield f"param: C: steps {' '.join(names)} :=\n".encode()
    values = (words(data[name].astype(np.float64)) for name in names)
    parts = [part for value in values for part in (b" ", value)]
    yield from _element_lines(instance, "cycles", [Decimals(steps), *parts])
    yield b";\nparam: STEPS: sign :=\n"
    number = Decimals(np.repeat(np.arange(len(steps)), steps))
    yield from _element_lines(instance, "pairs", [words(data["sign"])], cycles.pair, [number, b" "])
    at = np.nonzero(data["is_open"])[0]
    for members, strokes in zip((b"STARTS", b"ENDS"), cycles.ends[at].T, strict=True):
        yield b";\nset %b :=\n" % members
        yield from _element_lines(instance, "strokes", [], strokes, [Decimals(at), b" "])
    yield b";\n"


def _limited(problem: Problem) -> dict[str, IndexSet]:
    """The residuals that are columns with limits, and their index sets."""
    if not problem.formulation.declaration.orthogonal:
        return {}
    return {name: problem.blocks[name].over for name in ("d", "q") if _has_columns(problem, name)}


def _has_columns(problem: Problem, name: str) -> bool:
    return name in problem.blocks and problem.blocks[name].count > 0


def _points(instance: Instance) -> Iterator[bytes]:
    """The members of the set I."""
    places = instance.domain.places(np.arange(instance.domain.size, dtype=np.int32))
    if places.ndim == 1:
        yield from render([Decimals(places), b"\n"], len(places))
    else:
        rows, columns = places.T
        yield from render([b"(", Decimals(rows), b",", Decimals(columns), b")\n"], len(rows))


def _pairs(instance: Instance) -> Iterator[bytes]:
    """The pairs of a mesh, by number: both faces and kappa; and weights of pairs if there are any."""
    domain, weights = instance.domain, instance.pair_weights
    if not len(domain.first):
        return
    if isinstance(domain, Mesh):
        yield b"param: E: first second kappa :=\n"
        faces: list[Piece] = [Decimals(domain.first), b" ", Decimals(domain.second)]
        yield from _element_lines(instance, "pairs", [*faces, b" ", words(domain.kappa)])
        yield b";\n"
    if weights is not None:
        check_coefficients(weights, f"pair_weights of {instance.name}")
        yield b"param omega :=\n"
        yield from _element_lines(instance, "pairs", [words(weights)])
        yield b";\n"


def _element_lines(
    instance: Instance, over: IndexSet, values: Pieces, at: NDArray[Any] | None = None, before: Pieces = ()
) -> Iterator[bytes]:
    """One element per line, its index and values: `1 2 u 0.3`; only the elements `at`, if given.

    before: pieces in front of the index.
    """
    if is_numbered(instance, over):
        numbers = element_numbers(instance, over)
        numbers = numbers if at is None else numbers[at]
        yield from render([*before, Decimals(numbers), b" ", *values, b"\n"], len(numbers))
        return
    rows, columns = instance.grid.places(point_of(instance, over)).T
    sides = instance.grid.upward.view(np.uint8)
    if at is not None:
        rows, columns, sides = rows[at], columns[at], sides[at]
    side: Pieces = [b" ", Words(word_table([b"r", b"u"]), sides)] if over == "pairs" else []
    index: Pieces = [*before, Decimals(rows), b" ", Decimals(columns), *side]
    yield from render([*index, b" ", *values, b"\n"], len(rows))


def _variable_text(variable: Variable, block: Block, indices: _Indices) -> dict[str, str]:
    language = _AmplExpressions(block.over, indices)
    attributes = ["integer"] * block.integer
    attributes += [
        f"{sign} {language.bound(end)}"
        for sign, end in ((">=", variable.lower), ("<=", variable.upper))
        if end is not None
    ]
    return {
        "name": block.name,
        "domain": indices.domains[block.over],
        "attributes": " " * bool(attributes) + ", ".join(attributes),
        "meaning": variable.meaning,
    }


def _label(instance: Instance, block: Block) -> str:
    """Print format of a block's names: `alpha_%02d_%02d`."""
    number = f"_%0{number_width(instance, block.over)}d"
    if is_numbered(instance, block.over):
        return block.name + number
    return block.name + 2 * number + "_%s" * (block.over == "pairs")


def _family_text(family: PlacedFamily) -> dict[str, str]:
    """A family as the template prints it: its tag, its place in the paper, its set, and its text."""
    declared, indices = family.family.rolled or family.family, _indices(family.instance)
    words = _AmplExpressions(declared.over, indices)
    if declared.is_row:
        left, right = words.expression(declared.relation.left), words.expression(declared.relation.right)
        pieces = [*left, SENSES[declared.sense], *right]
    else:
        pieces = wrap_lines(words.summands(declared.body), WIDTH)
    paper = f"section {declared.paper}" if declared.paper[0].isdigit() else declared.paper
    return {
        "tag": family.family.tag,
        "paper": paper,
        "text": _literal_text(pieces),
        "domain": _domain(family, indices),
    }


def _domain(family: PlacedFamily, indices: _Indices) -> str:
    """The set of a family, with a condition for rows that are needed only for one parity of a bound."""
    over, only = family.family.over, family.family.only
    if only is None:
        return indices.domains[over]
    index = indices.index[over]
    length = f" and steps[{index}] = {family.family.steps}" if family.family.steps else ""
    return f"{indices.domains[over][:-1]}: abs({only[0]}[{index}]) mod 2 = {only[1]}{length}}}"


class _AmplExpressions(InfixLanguage):
    """The language of AMPL over an index set: names with indices, constants in mathematical notation."""

    def __init__(self, over: IndexSet, indices: _Indices) -> None:
        """Store the index set and the indices of the model."""
        self._over = over
        self._indices = indices

    def symbol(self, symbol: Symbol) -> Piece:
        """A symbol's name and index; scalars have none."""
        if symbol in SCALARS:
            return str(symbol.name).encode()
        name, kind = SLOTS[self._over][symbol]
        if kind in _SUMS:
            over, members, factor = _SUMS[kind]
            index = self._indices.index[over]
            return f"(sum{{(l,{index}) in {members}}} {factor.format(index)}{name}[{index}])".encode()
        ends: dict[IndexMap, str] = {"first": self._indices.first, "second": self._indices.second}
        index = ends.get(kind, self._indices.index[self._over])
        return f"{name}[{index}]".encode()

    def is_data(self, expression: Factor) -> bool:
        """Whether it is a constant: data have names in this language."""
        return not expression.symbols

    def constant(self, expression: Expression, *, signed: bool) -> Piece:
        """A constant in mathematical notation."""
        number, factors = expression.as_term
        assert not factors  # no declaration has a sum of constants
        negative, text = number.ratio < 0, str(number).removeprefix("-")
        if signed:
            return f"{'-' if negative else '+'} {text}".encode()
        return f"(-{text})".encode() if negative else text.encode()

    coefficient = constant

    def bound(self, expression: Operand) -> str:
        """A bound of a variable for all elements of its set."""
        return _literal_text(self.outermost(expression_of(expression)))


def _literal_text(pieces: list[Piece]) -> str:
    """The text of pieces that are all literal."""
    return b"".join(piece for piece in pieces if isinstance(piece, bytes)).decode().removeprefix(" + ")


def _narrowed_bounds(problem: Problem) -> dict[IndexSet, tuple[str, ...]]:
    """Names of the data that are bounds where a proof has narrowed them, by index set; otherwise empty."""
    if problem.windows is None:
        return {}
    skew = () if problem.instance.orthogonal else ("beta_lo", "beta_up")
    names: dict[IndexSet, tuple[str, ...]] = {"pixels": ("alpha_lo", "alpha_up", *skew)}
    has_jumps = problem.jumps is None and len(problem.instance.domain.first) > 0
    return names | ({"pairs": ("p_min", "p_max")} if has_jumps else {})


def _check_problem(problem: Problem) -> None:
    """Raise UnsupportedByFormatError for columns fixed one by one, or weights that solvers would drop."""
    instance = problem.instance
    if problem.pinned is not None:
        raise UnsupportedByFormatError("mod has no place for columns fixed one by one; write nl, lp or mps")
    check_coefficients(instance.w, f"w of {instance.name}")
    check_coefficients(instance.stroke_coefficient, f"w_strokes of {instance.name}")
    check_coefficients(instance.skew_coefficient, f"w_beta of {instance.name}")
