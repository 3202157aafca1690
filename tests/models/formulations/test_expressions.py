"""Expressions keep the form in which they are declared, and have the values that SymPy gives them."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from crossfield.models.formulations.catalogue import CUBIC, PARITY, QUARTIC, lift_products
from crossfield.models.formulations.catalogue import declare as formulation_of
from crossfield.models.formulations.expressions import PI, ZERO, Symbol, cos, floor, parity
from crossfield.models.formulations.latex import to_sympy
from crossfield.models.formulations.symbols import VARIABLES

x, y, w = Symbol("x"), Symbol("y"), Symbol("w")


def test_whole_numbers_are_distributed_and_other_factors_are_not():
    assert 2 * (x + y) == 2 * x + 2 * y
    assert len((w * (x + y)).terms) == len((PI / 4 * (x + y)).terms) == 1
    assert (w * (2 * x + y)).substitute({w: 1}) == 2 * x + y


def test_like_terms_are_added_and_cancel():
    assert x + y + x == 2 * x + y
    assert x * y - y * x == ZERO == 0 * x
    assert (x + y) * (x + y) == (x + y) ** 2


@pytest.mark.parametrize("text, value", [("-3*pi^2/4", PI * PI * -3 / 4), ("1/2", PI**0 / 2), ("pi", PI)])
def test_constants_are_exact(text, value):
    (term,) = value.terms
    assert str(term.constant) == text
    assert float(term.constant) == pytest.approx(float(sp.sympify(text.replace("^", "**"))), rel=1e-15)


def test_polynomials_are_sorted_by_degree_and_a_cosine_is_none():
    terms = ((1 - 2 * x) * y - w * 3 + x**2).polynomial([x, y])
    assert list(terms) == [(), (y,), (x, x), (x, y)]
    assert (terms[()], terms[x, y]) == (-3 * w, ZERO - 2)
    assert (x * cos(y)).polynomial([x, y]) is None
    assert list((x * cos(y)).polynomial([x])) == [(x,)]


def test_values_are_those_of_sympy():
    mixed = floor(x / 2) + parity(y) * cos(PI * x) - PI / 4 * w
    lifted = [family.body for family in lift_products(formulation_of("minlp-quartic")).objective]
    bounds = [end for variable in VARIABLES.values() for end in (variable.lower, variable.upper) if end]
    for declared in [mixed, PARITY, QUARTIC, CUBIC, *lifted, *(1 * end for end in bounds)]:
        symbols = sorted(declared.symbols, key=str)
        values = dict(zip(symbols, np.random.default_rng(1).integers(-5, 6, (len(symbols), 7)), strict=True))
        same = sp.lambdify([to_sympy(symbol) for symbol in symbols], to_sympy(declared), modules="numpy")
        assert declared.evaluate(values) == pytest.approx(same(*values.values()), rel=1e-12)
