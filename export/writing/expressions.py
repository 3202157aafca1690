"""Expressions of a declaration as text, in their factored form: one walk for every algebraic language.

The walk handles precedence, signs and brackets. A language defines the form of symbols, constants and powers.
Expressions without variables are *data*: the walk passes its largest such pieces as a whole, so that a
language may print them or evaluate them. The result is a list of pieces, bytes for text that all records
share and parts (records.py) for text that differs.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Literal

import sympy as sp

from ...models.formulations.families import PlacedFamily
from ...models.formulations.symbols import SCALARS, VARIABLES
from ...models.instance.domain import Floats
from .records import Piece, Pieces


class InfixLanguage(ABC):
    """The form of the leaves of an expression in an algebraic language."""

    @abstractmethod
    def symbol(self, symbol: sp.Symbol) -> Piece:
        """A symbol."""

    @abstractmethod
    def is_data(self, expression: sp.Expr) -> bool:
        """Whether an expression is passed to `constant` and `coefficient` as a whole."""

    @abstractmethod
    def constant(self, expression: sp.Expr, *, signed: bool) -> Piece:
        """A summand that is data: with its sign and a blank (`- 3`), or with negative numbers in brackets."""

    @abstractmethod
    def coefficient(self, expression: sp.Expr, *, signed: bool) -> Piece:
        """A factor that is data, signed or bracketed like `constant`."""

    def power(self, base: list[Piece], exponent: int) -> list[Piece]:
        """The power of a base (not bracketed) with an exponent of at least 2; by default with a caret."""
        bracketed = base if len(base) == 1 else [b"(", *base, b")"]
        return [*bracketed, f"^{exponent}".encode()]

    def expression(self, expression: sp.Expr) -> list[Piece]:
        """An expression; its first term has a sign only when it is negative."""
        terms = self._terms(expression)
        return [piece for place, term in enumerate(terms) for piece in self._term(term, signed=place > 0)]

    def outermost(self, expression: sp.Expr) -> list[Piece]:
        """An expression that is not part of another: a negative number needs no brackets."""
        negative = not expression.free_symbols and expression.is_negative
        return [b"-", *self.expression(-expression)] if negative else self.expression(expression)

    def summands(self, expression: sp.Expr) -> list[list[Piece]]:
        """The terms of an expression, each with its sign."""
        return [self._term(term, signed=True) for term in self._terms(expression)]

    def _terms(self, expression: sp.Expr) -> list[sp.Expr]:
        """Its terms in a fixed order, with all data as one term, in the place of their first."""
        terms = expression.as_ordered_terms()
        data = [term for term in terms if self.is_data(term)]
        merged = sp.Add(*data)
        return (
            [merged if term is data[0] else term for term in terms if term not in data[1:]] if data else terms
        )

    def _term(self, term: sp.Expr, *, signed: bool) -> list[Piece]:
        if self.is_data(term):
            constant = self.constant(term, signed=signed)
            return [b" ", constant] if signed else [constant]
        number, symbol = term.as_coeff_Mul()
        if symbol.is_Symbol and number.is_Rational and number.p == 1 < number.q:
            return [*self._term(symbol, signed=signed), f"/{number.q}".encode()]
        factors = sorted(term.as_ordered_factors(), key=_rank)
        coefficient = sp.Mul(*(factor for factor in factors if self.is_data(factor)))
        rest = [self._factor(factor) for factor in factors if not self.is_data(factor)]
        product = [piece for place, factor in enumerate(rest) for piece in ([b"*"] if place else []) + factor]
        return self._lead(coefficient, signed=signed) + product

    def _lead(self, coefficient: sp.Expr, *, signed: bool) -> list[Piece]:
        """The start of a term before its variables: its sign and its coefficient, unless it is 1."""
        if abs(coefficient) == 1:
            minus = coefficient == -1
            return [b" - " if minus else b" + "] if signed else [b"-"] * minus
        number = self.coefficient(coefficient, signed=signed)
        return [b" ", number, b"*"] if signed else [number, b"*"]

    def _factor(self, factor: sp.Expr) -> list[Piece]:
        if factor.is_Symbol:
            return [self.symbol(factor)]
        if factor.is_Add:
            return [b"(", *self.expression(factor), b")"]
        if factor.is_Pow and factor.exp.is_Integer and factor.exp >= 2:
            return self.power(self.expression(factor.base), int(factor.exp))
        if isinstance(factor, sp.cos | sp.floor):
            return [f"{factor.func.__name__}(".encode(), *self.expression(factor.args[0]), b")"]
        raise AssertionError(f"no declaration holds {factor.func}")


def _rank(factor: sp.Expr) -> tuple[bool, bool, bool]:
    """Order of the factors of a product: weights, data, variables, and then other expressions."""
    return not factor.is_Symbol, factor not in SCALARS, str(factor) in VARIABLES


def is_free_of_columns(family: PlacedFamily, expression: sp.Expr) -> bool:
    """Whether an expression of a family holds no column."""
    return not expression.free_symbols & set(family.variables)


Operator = Literal["sum", "product", "negative", "square", "cos"]


class PrefixLanguage(ABC):
    """Expressions of a family with operators before operands: one walk for every language of this kind.

    Data are evaluated: what holds no column becomes one number, in front of the rest of its sum or product.
    """

    def __init__(self, family: PlacedFamily) -> None:
        self.family = family

    @abstractmethod
    def number(self, values: Floats | float) -> Pieces:
        """A number, one per element or one for all."""

    @abstractmethod
    def column(self, symbol: sp.Symbol) -> Pieces:
        """The column of a symbol."""

    @abstractmethod
    def node(self, operator: Operator, parts: list[Pieces]) -> Pieces:
        """An operator with its operands: two or more of a sum or a product, one of the others."""

    def expression(self, expression: sp.Expr) -> Pieces:
        """An expression."""
        if is_free_of_columns(self.family, expression):
            return self.number(self.family.data(expression))
        if expression.is_Symbol:
            return self.column(expression)
        if expression.is_Add or expression.is_Mul:
            return self._chain(expression)
        assert isinstance(expression, sp.cos) or expression.exp == 2  # no declaration holds anything else
        return self.node("square" if expression.is_Pow else "cos", [self.expression(expression.args[0])])

    def _chain(self, expression: sp.Expr) -> Pieces:
        data = [part for part in expression.args if is_free_of_columns(self.family, part)]
        parts = [self.expression(part) for part in expression.args if part not in data]
        if expression.is_Mul and data == [-1]:
            return self.node("negative", [self.join("product", parts)])
        constant = [self.expression(expression.func(*data))] if data else []
        return self.join("sum" if expression.is_Add else "product", constant + parts)

    def join(self, operator: Operator, parts: list[Pieces]) -> Pieces:
        """The sum or the product of one part or more."""
        return self.node(operator, parts) if len(parts) > 1 else parts[0]


def wrap_lines(summands: Sequence[Pieces], width: int, indent: bytes) -> list[Piece]:
    """The summands with line breaks between them, so that a line exceeds `width` bytes only slightly."""
    pieces: list[Piece] = []
    used = 0
    for summand in summands:
        size = sum(len(piece) if isinstance(piece, bytes) else piece.width for piece in summand)
        if used and used + size > width:
            pieces.append(b"\n" + indent)
            used = len(indent)
        pieces += summand
        used += size
    return pieces
