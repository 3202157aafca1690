"""Expressions of formulations, nested as they are declared.

An expression is a sum of terms, and a term is a constant times powers of factors: symbols, functions, and
sums in brackets. Constants are rational multiples of powers of pi, so that nothing is rounded before it is
evaluated. Products with whole numbers and fractions are distributed, like terms are added, and everything
else is kept until `expanded` or `polynomial` asks for more. SymPy, whose import takes longer than most
commands, only prints formulas (`latex.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, reduce
from operator import add, mul
from typing import Any, Final, NamedTuple, Self, Union

import numpy as np

Functions = Mapping[str, Callable[[Any], Any]]
Polynomial = dict[tuple["Symbol", ...], "Expression"]
"""Coefficients of monomials: symbols, each repeated as often as its power; by degree."""

IN_NUMPY: Final[Functions] = {
    "cos": np.cos,
    "floor": np.floor,
    "abs": np.abs,
    "parity": lambda values: np.mod(values, 2),
}
"""The functions of expressions by name, over arrays."""


@dataclass(frozen=True)
class Constant:
    """A rational multiple of a power of pi."""

    ratio: Fraction
    power: int = 0

    def __float__(self) -> float:
        return float(self.ratio) * math.pi**self.power

    def __mul__(self, other: Constant) -> Constant:
        return Constant(self.ratio * other.ratio, self.power + other.power)

    def __pow__(self, exponent: int) -> Constant:
        return Constant(self.ratio**exponent, self.power * exponent)

    def __str__(self) -> str:
        """The constant as `-3*pi^2/4`."""
        number, divisor = abs(self.ratio.numerator), self.ratio.denominator
        power = f"pi^{self.power}" if self.power > 1 else "pi" * self.power
        product = "*".join(filter(None, ["" if number == 1 and power else str(number), power]))
        return "-" * (self.ratio < 0) + product + (f"/{divisor}" if divisor > 1 else "")


_ONE: Final = Constant(Fraction(1))


class Operand:
    """Operators of symbols, functions and expressions, also with whole numbers; comparisons give rows."""

    def __add__(self, other: Operand | int) -> Expression:
        return _sum([*expression_of(self).terms, *expression_of(other).terms])

    def __mul__(self, other: Operand | int) -> Expression:
        return _product(expression_of(self), expression_of(other))

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Expression:
        return self * -1

    def __sub__(self, other: Operand | int) -> Expression:
        return self + expression_of(other) * -1

    def __rsub__(self, other: int) -> Expression:
        return expression_of(other) - self

    def __truediv__(self, divisor: int) -> Expression:
        return _product(expression_of(self), _number(Constant(Fraction(1, divisor))))

    def __pow__(self, exponent: int) -> Expression:
        if exponent == 1:
            return expression_of(self)
        term = expression_of(self).as_term
        powers = tuple((factor, power * exponent) for factor, power in term.factors)
        return _sum([Term(term.constant**exponent, powers)])

    def __ge__(self, other: Operand | int) -> Relation:
        return Relation(expression_of(self), ">=", expression_of(other))

    def __le__(self, other: Operand | int) -> Relation:
        return Relation(expression_of(self), "<=", expression_of(other))


@dataclass(frozen=True)
class Symbol(Operand):
    """A symbol."""

    name: str

    def __str__(self) -> str:
        return self.name

    @property
    def symbols(self) -> frozenset[Symbol]:
        """The symbol itself."""
        return frozenset({self})

    def substitute(self, values: Mapping[Symbol, Operand | int]) -> Expression:
        """The value of the symbol, or the symbol without one."""
        return expression_of(values.get(self, self))

    def evaluate(self, values: Mapping[Symbol, Any], functions: Functions) -> Any:  # noqa: ARG002
        """The value of the symbol."""
        return values[self]


@dataclass(frozen=True)
class Function(Operand):
    """A function of an expression, named as in `IN_NUMPY`."""

    name: str
    argument: Expression

    @property
    def symbols(self) -> frozenset[Symbol]:
        """The symbols in its argument."""
        return self.argument.symbols

    def substitute(self, values: Mapping[Symbol, Operand | int]) -> Expression:
        """The function with values for symbols."""
        return expression_of(Function(self.name, self.argument.substitute(values)))

    def evaluate(self, values: Mapping[Symbol, Any], functions: Functions) -> Any:
        """The value of the function."""
        return functions[self.name](self.argument.evaluate(values, functions))


Factor = Union[Symbol, Function, "Expression"]


class Term(NamedTuple):
    """A constant times powers of factors."""

    constant: Constant
    factors: tuple[tuple[Factor, int], ...]

    def split(self, is_data: Callable[[Factor], bool]) -> tuple[Expression, list[tuple[Factor, int]]]:
        """The product of its constant and the factors that are data, and the other factors with powers."""
        data = tuple(factor for factor in self.factors if is_data(factor[0]))
        return Expression((Term(self.constant, data),)), [
            factor for factor in self.factors if factor not in data
        ]


@dataclass(frozen=True)
class Expression(Operand):
    """A sum of terms; no terms are 0."""

    terms: tuple[Term, ...]

    @cached_property
    def symbols(self) -> frozenset[Symbol]:
        """The symbols in it."""
        return frozenset().union(*(factor.symbols for term in self.terms for factor, _ in term.factors))

    @property
    def as_term(self) -> Term:
        """Its only term, or the term with the sum as its only factor."""
        if len(self.terms) == 1:
            return self.terms[0]
        return Term(_ONE, ((self, 1),)) if self.terms else Term(Constant(Fraction(0)), ())

    @property
    def ratio(self) -> Fraction | None:
        """Its value if it is a whole number or a fraction, else None."""
        term = self.as_term
        return None if term.factors or term.constant.power else term.constant.ratio

    def substitute(self, values: Mapping[Symbol, Operand | int]) -> Expression:
        """The expression with values for symbols."""
        return self.map_factors(lambda factor, power: factor.substitute(values) ** power)

    def map_factors(self, change: Callable[[Factor, int], Expression]) -> Expression:
        """The expression with another one for each power of a factor."""
        products = (
            reduce(_product, (change(*factor) for factor in term.factors), ONE) * _number(term.constant)
            for term in self.terms  # the constant last, which would be distributed over a first sum
        )
        return sum_of(products)

    def evaluate(self, values: Mapping[Symbol, Any], functions: Functions = IN_NUMPY) -> Any:
        """The value at the values of its symbols: numbers, arrays or what else has operators."""
        parts = [_evaluate_term(term, values, functions) for term in self.terms]
        return reduce(add, parts) if parts else 0.0

    def polynomial(self, variables: Sequence[Symbol]) -> Polynomial | None:
        """The expression as a polynomial in variables, by degree; None if it is not one."""
        place = {symbol: number for number, symbol in enumerate(variables)}
        total: Polynomial = {}
        for term in self.terms:
            product: Polynomial = {(): _number(term.constant)}
            for factor, power in term.factors:
                part: Polynomial | None = {(): factor**power}
                repeated = 1
                if factor.symbols & place.keys():
                    part, repeated = _polynomial_of(factor, variables), power
                if part is None:
                    return None
                for _ in range(repeated):
                    product = _multiply_polynomials(product, part, place)
            for monomial, coefficient in product.items():
                total[monomial] = total.get(monomial, ZERO) + coefficient
        ordered = sorted(total, key=lambda monomial: (len(monomial), [place[s] for s in monomial]))
        return {monomial: total[monomial] for monomial in ordered if total[monomial].terms}

    def expanded(self, binary: Symbol | None = None) -> Expression:
        """The expression without brackets, and without powers of a symbol that is 0 or 1."""
        terms = self.polynomial(sorted(self.symbols, key=str))
        assert terms is not None
        products = (
            reduce(mul, (s for n, s in enumerate(symbols) if s != binary or s not in symbols[:n]), factor)
            for symbols, factor in terms.items()
        )
        return sum_of(products)


@dataclass(frozen=True)
class Relation:
    """Two expressions and the relation `>=`, `<=` or `==` between them."""

    left: Expression
    sense: str
    right: Expression

    @property
    def symbols(self) -> frozenset[Symbol]:
        """The symbols on both sides."""
        return self.left.symbols | self.right.symbols

    def substitute(self, values: Mapping[Symbol, Operand | int]) -> Self:
        """The relation with values for symbols."""
        return type(self)(self.left.substitute(values), self.sense, self.right.substitute(values))


def equal(left: Operand, right: Operand) -> Relation:
    """The row that two expressions are equal; `==` compares what they are made of."""
    return Relation(expression_of(left), "==", expression_of(right))


def cos(argument: Operand) -> Function:
    """The cosine."""
    return Function("cos", expression_of(argument))


def floor(argument: Operand) -> Function:
    """The greatest whole number that is not above the argument."""
    return Function("floor", expression_of(argument))


def absolute(argument: Operand) -> Function:
    """The absolute value."""
    return Function("abs", expression_of(argument))


def parity(argument: Operand) -> Function:
    """The remainder of a whole number divided by 2."""
    return Function("parity", expression_of(argument))


def expression_of(value: Operand | int) -> Expression:
    """A symbol, a function or a whole number as an expression."""
    if isinstance(value, Expression):
        return value
    if isinstance(value, int):
        return _number(Constant(Fraction(value)))
    assert isinstance(value, Symbol | Function)
    return Expression((Term(_ONE, ((value, 1),)),))


def sum_of(operands: Iterable[Operand]) -> Expression:
    """The sum of many operands, each of which is looked at once."""
    return _sum(term for operand in operands for term in expression_of(operand).terms)


def _number(constant: Constant) -> Expression:
    return Expression((Term(constant, ()),) if constant.ratio else ())


def _sum(terms: Iterable[Term]) -> Expression:
    """The sum of terms, like ones added."""
    total: dict[tuple[frozenset[tuple[Factor, int]], int], Term] = {}
    for term in terms:
        key = frozenset(term.factors), term.constant.power
        before = total[key].constant.ratio if key in total else 0
        constant = Constant(before + term.constant.ratio, term.constant.power)
        total[key] = Term(constant, total.get(key, term).factors)
    return Expression(tuple(term for term in total.values() if term.constant.ratio))


def _product(left: Expression, right: Expression) -> Expression:
    """The product, distributed over a sum only for a whole number or a fraction."""
    for number, terms in ((left.ratio, right.terms), (right.ratio, left.terms)):
        if number is not None:
            return _sum(Term(Constant(number) * term.constant, term.factors) for term in terms)
    one, other = left.as_term, right.as_term
    powers = dict(one.factors)
    for factor, power in other.factors:
        powers[factor] = powers.get(factor, 0) + power
    return Expression((Term(one.constant * other.constant, tuple(powers.items())),))


def _polynomial_of(factor: Factor, variables: Sequence[Symbol]) -> Polynomial | None:
    """A factor that holds variables as a polynomial in them."""
    if isinstance(factor, Symbol):
        return {(factor,): ONE}
    return None if isinstance(factor, Function) else factor.polynomial(variables)


def _multiply_polynomials(left: Polynomial, right: Polynomial, place: Mapping[Symbol, int]) -> Polynomial:
    total: Polynomial = {}
    for one, factor in left.items():
        for other, coefficient in right.items():
            monomial = tuple(sorted(one + other, key=place.__getitem__))
            total[monomial] = total.get(monomial, ZERO) + factor * coefficient
    return total


def _evaluate_term(term: Term, values: Mapping[Symbol, Any], functions: Functions) -> Any:
    parts = [
        part if power == 1 else part**power
        for factor, power in term.factors
        for part in [factor.evaluate(values, functions)]
    ]
    if not parts:
        return float(term.constant)
    product = reduce(mul, parts)
    return product if term.constant == _ONE else float(term.constant) * product


ZERO: Final = Expression(())
ONE: Final = _number(_ONE)
PI: Final = _number(Constant(Fraction(1), 1))
