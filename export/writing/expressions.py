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

from ...models.formulations.expressions import ONE, Expression, Factor, Function, Symbol, Term
from ...models.formulations.families import PlacedFamily
from ...models.formulations.symbols import SCALARS, VARIABLES
from ...models.instance.domain import Floats
from .records import Piece, Pieces


class InfixLanguage(ABC):
    """The form of the leaves of an expression in an algebraic language."""

    @abstractmethod
    def symbol(self, symbol: Symbol) -> Piece:
        """A symbol."""

    @abstractmethod
    def is_data(self, expression: Factor) -> bool:
        """Whether an expression is passed to `constant` and `coefficient` as a whole."""

    @abstractmethod
    def constant(self, expression: Expression, *, signed: bool) -> Piece:
        """A summand that is data: with its sign and a blank (`- 3`), or with negative numbers in brackets."""

    @abstractmethod
    def coefficient(self, expression: Expression, *, signed: bool) -> Piece:
        """A factor that is data, signed or bracketed like `constant`."""

    def power(self, base: list[Piece], exponent: int) -> list[Piece]:
        """The power of a base (not bracketed) with an exponent of at least 2; by default with a caret."""
        bracketed = base if len(base) == 1 else [b"(", *base, b")"]
        return [*bracketed, f"^{exponent}".encode()]

    def expression(self, expression: Expression) -> list[Piece]:
        """An expression; its first term has a sign only when it is negative."""
        terms = self._terms(expression)
        return [piece for place, term in enumerate(terms) for piece in self._term(term, signed=place > 0)]

    def outermost(self, expression: Expression) -> list[Piece]:
        """An expression that is not part of another: a negative number needs no brackets."""
        negative = not expression.symbols and expression.as_term.constant.ratio < 0
        return [b"-", *self.expression(-expression)] if negative else self.expression(expression)

    def summands(self, expression: Expression) -> list[list[Piece]]:
        """The terms of an expression, each with its sign."""
        return [self._term(term, signed=True) for term in self._terms(expression)]

    def _terms(self, expression: Expression) -> list[Expression]:
        """Its terms in their order, with all data as one term, in the place of their first."""
        terms = [Expression((term,)) for term in expression.terms] or [expression]
        data = [term for term in terms if self.is_data(term)]
        merged = Expression(tuple(part for term in data for part in term.terms))
        return (
            [merged if term is data[0] else term for term in terms if term not in data[1:]] if data else terms
        )

    def _term(self, expression: Expression, *, signed: bool) -> list[Piece]:
        if self.is_data(expression):
            constant = self.constant(expression, signed=signed)
            return [b" ", constant] if signed else [constant]
        (term,) = expression.terms
        coefficient, rest = term.split(self.is_data)
        divisor = coefficient.ratio and coefficient.ratio.denominator
        if divisor and coefficient * divisor == ONE != coefficient and rest[0][1] == 1 == len(rest):
            return [*self._term(coefficient * divisor * rest[0][0], signed=signed), f"/{divisor}".encode()]
        factors = [self._factor(factor, power) for factor, power in sorted(rest, key=_rank)]
        product = [
            piece for place, factor in enumerate(factors) for piece in ([b"*"] if place else []) + factor
        ]
        return self._lead(coefficient, signed=signed) + product

    def _lead(self, coefficient: Expression, *, signed: bool) -> list[Piece]:
        """The start of a term before its variables: its sign and its coefficient, unless it is 1."""
        if coefficient in (ONE, -ONE):
            minus = coefficient != ONE
            return [b" - " if minus else b" + "] if signed else [b"-"] * minus
        number = self.coefficient(coefficient, signed=signed)
        return [b" ", number, b"*"] if signed else [number, b"*"]

    def _factor(self, factor: Factor, power: int) -> list[Piece]:
        if isinstance(factor, Symbol):
            pieces = [self.symbol(factor)]
        elif isinstance(factor, Function):
            pieces = [f"{factor.name}(".encode(), *self.expression(factor.argument), b")"]
        else:
            inside = self.expression(factor)
            pieces = inside if power > 1 else [b"(", *inside, b")"]
        return self.power(pieces, power) if power > 1 else pieces


def _rank(factor: tuple[Factor, int]) -> tuple[bool, bool, bool]:
    """Order of the factors of a product: weights, data, variables, and then other expressions."""
    base, power = factor
    return not isinstance(base, Symbol) or power > 1, base not in SCALARS, str(base) in VARIABLES


def is_free_of_columns(family: PlacedFamily, expression: Factor) -> bool:
    """Whether an expression of a family holds no column."""
    return not expression.symbols & set(family.variables)


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
    def column(self, symbol: Symbol) -> Pieces:
        """The column of a symbol."""

    @abstractmethod
    def node(self, operator: Operator, parts: list[Pieces]) -> Pieces:
        """An operator with its operands: two or more of a sum or a product, one of the others."""

    def expression(self, expression: Expression) -> Pieces:
        """An expression."""
        parts = [(term, self._is_data(Expression((term,)))) for term in expression.terms]
        data = Expression(tuple(term for term, is_data in parts if is_data))
        constant = [self.number(self.family.data(data))] if data.terms else []
        return self.join("sum", constant + [self._term(term) for term, is_data in parts if not is_data])

    def _is_data(self, expression: Factor) -> bool:
        return is_free_of_columns(self.family, expression)

    def _term(self, term: Term) -> Pieces:
        coefficient, rest = term.split(self._is_data)
        parts = [self._factor(factor, power) for factor, power in rest]
        if coefficient == -ONE:
            return self.node("negative", [self.join("product", parts)])
        constant = [] if coefficient == ONE else [self.number(self.family.data(coefficient))]
        return self.join("product", constant + parts)

    def _factor(self, factor: Factor, power: int) -> Pieces:
        assert power <= 2  # no declaration holds anything else
        if isinstance(factor, Symbol):
            pieces = self.column(factor)
        elif isinstance(factor, Function):
            assert factor.name == "cos"  # likewise
            pieces = self.node("cos", [self.expression(factor.argument)])
        else:
            pieces = self.expression(factor)
        return self.node("square", [pieces]) if power == 2 else pieces

    def join(self, operator: Operator, parts: list[Pieces]) -> Pieces:
        """The sum or the product of one part or more."""
        return self.node(operator, parts) if len(parts) > 1 else parts[0]


def wrap_lines(summands: Sequence[Pieces], width: int) -> list[Piece]:
    """The summands with line breaks between them, so that a line exceeds `width` bytes only slightly."""
    pieces: list[Piece] = []
    used = 0
    for summand in summands:
        size = sum(len(piece) if isinstance(piece, bytes) else piece.width for piece in summand)
        if used and used + size > width:
            pieces.append(b"\n  ")
            used = 2
        pieces += summand
        used += size
    return pieces
