"""Common parts of indexed GAMS and AMPL: equations over index sets, in the notation of the paper."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar, Final

import sympy as sp

from ...models.errors import UnsupportedByFormatError
from ...models.formulations.families import PlacedFamily
from ...models.formulations.problem import Problem
from ...models.formulations.symbols import SCALARS, SLOTS, IndexSet
from ..writing.expressions import Language, wrapped
from ..writing.records import Piece, check_coefficients

WIDTH: Final = 110
"""Approximate length of lines."""


class Indexed(Language):
    """The language over an index set: symbols by name and index, constants in mathematical notation.

    index: labels of an element of each set; second: labels of pixel j of a pair; brackets: around an index.
    """

    index: ClassVar[Mapping[IndexSet, str]]
    second: ClassVar[str]
    brackets: ClassVar[str]

    def __init__(self, over: IndexSet, own: str = "") -> None:
        """Store the index of the elements themselves, `own`, by default their labels."""
        self._over = over
        self._own = own or self.index[over]

    @abstractmethod
    def exact(self, constant: sp.Expr) -> str:
        """A positive constant."""

    def symbol(self, symbol: sp.Symbol) -> Piece:
        """A symbol's name and index; scalars have none."""
        if symbol in SCALARS:
            return str(symbol.name).encode()
        name, kind = SLOTS[self._over][symbol]
        index = self.second if kind == "second" else self.index["pixels"] if kind == "first" else self._own
        return f"{name}{self.brackets[0]}{index}{self.brackets[1]}".encode()

    def is_data(self, expression: sp.Expr) -> bool:
        """Whether it is a constant: data have names in these languages."""
        return not expression.free_symbols

    def constant(self, expression: sp.Expr, *, signed: bool) -> Piece:
        """A constant in mathematical notation."""
        negative = bool(expression < 0)
        text = self.exact(-expression if negative else expression)
        if signed:
            return f"{'-' if negative else '+'} {text}".encode()
        return f"(-{text})".encode() if negative else text.encode()

    def coefficient(self, expression: sp.Expr, *, signed: bool) -> Piece:
        """The same as a factor."""
        return self.constant(expression, signed=signed)

    def bound(self, expression: sp.Expr) -> str:
        """A bound of a variable for all elements of its set."""
        return _text(self.alone(expression))


def described(language: type[Indexed], family: PlacedFamily, senses: Mapping[str, bytes]) -> dict[str, str]:
    """A family as templates print it: its tag, its place in the paper, and its text."""
    declared = family.family
    words = language(declared.over)
    if declared.is_row:
        left, right = (words.expression(side) for side in (declared.expression.lhs, declared.expression.rhs))
        pieces = [*left, senses[declared.sense], *right]
    else:
        pieces = wrapped(words.summands(declared.expression), WIDTH, b"  ")
    paper = f"section {declared.paper}" if declared.paper[0].isdigit() else declared.paper
    return {"tag": declared.tag, "paper": paper, "text": _text(pieces)}


def _text(pieces: list[Piece]) -> str:
    """The text of pieces that are all literal."""
    return b"".join(piece for piece in pieces if isinstance(piece, bytes)).decode().removeprefix(" + ")


def narrowed(problem: Problem) -> dict[IndexSet, tuple[str, ...]]:
    """Names of the data that are bounds where a proof has narrowed them, by index set; otherwise empty."""
    if problem.windows is None:
        return {}
    names: dict[IndexSet, tuple[str, ...]] = {"pixels": ("alpha_lo", "alpha_up", "beta_lo", "beta_up")}
    has_jumps = problem.jumps is None and len(problem.instance.grid.first) > 0
    return names | ({"pairs": ("p_min", "p_max")} if has_jumps else {})


def check_indexed(problem: Problem, layout: str, instead: str) -> None:
    """Raise UnsupportedByFormatError for columns fixed one by one, or weights that solvers would drop."""
    instance = problem.instance
    if problem.pinned is not None:
        raise UnsupportedByFormatError(f"{layout} has no place for columns fixed one by one; write {instead}")
    check_coefficients(instance.w, f"w of {instance.name}")
    check_coefficients(instance.stroke_coefficient, f"w_strokes of {instance.name}")
    check_coefficients(instance.skew_coefficient, f"w_beta of {instance.name}")
