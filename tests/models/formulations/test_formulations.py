"""Formulations against the paper's formulas and by hand: products, facets, classes, jumps, options, names."""

from __future__ import annotations

from itertools import product

import crossfield as cf
import numpy as np
import pytest
import sympy as sp
from angles import HALF, QUARTER
from cases import MASKS, RIGHT, make_field, make_instance, make_problem
from command_line import invoke
from crossfield.models.formulations import symbols as n
from crossfield.models.formulations.catalogue import CUBIC, PARITY, QUARTIC
from crossfield.models.formulations.choice import declare
from crossfield.models.formulations.expressions import PI, Symbol, cos, floor, parity
from crossfield.models.formulations.latex import to_sympy
from crossfield.models.formulations.lifting import lift_products
from crossfield.models.formulations.symbols import VARIABLES
from instance_kinds import grid
from loops import for_each


def test_9_is_8_expanded_for_a_binary_p1():
    a, b, x, y, p1, p2 = map(to_sympy, (n.alpha_i, n.alpha_j, n.beta_i, n.beta_j, n.p1, n.p2))
    pi = sp.pi
    printed = 2 * (
        a**2 + b**2 - 2 * a * b + pi * a * p1 - pi * b * p1 + 2 * pi * a * p2 - 2 * pi * b * p2
        + (pi / 2) ** 2 * p1 + pi**2 * p1 * p2 + pi**2 * p2**2 + x**2 + y**2 - 2 * x * y + 4 * x * y * p1
    )  # fmt: skip
    on_grid = {n.kappa: 0, n.omega: 1}
    quartic, cubic = (to_sympy(declared.substitute(on_grid)) for declared in (QUARTIC, CUBIC))
    assert sp.expand(cubic - printed) == 0
    for bit in (0, 1):
        assert sp.expand((quartic - printed).subs(p1, bit)) == 0
    assert sp.expand(quartic - printed) != 0  # it takes the binary


def test_values_of_expressions_are_those_of_sympy():
    x, y, w = Symbol("x"), Symbol("y"), Symbol("w")
    mixed = floor(x / 2) + parity(y) * cos(PI * x) - PI / 4 * w * (2 * x + y) ** 2 + (x - x) * y
    lifted = [family.body for family in lift_products(declare("minlp-quartic")).objective]
    bounds = [end for variable in VARIABLES.values() for end in (variable.lower, variable.upper) if end]
    for declared in [mixed, PARITY, QUARTIC, CUBIC, *lifted, *(1 * end for end in bounds)]:
        symbols = sorted(declared.symbols, key=str)
        values = dict(zip(symbols, np.random.default_rng(1).integers(-5, 6, (len(symbols), 7)), strict=True))
        same = sp.lambdify([to_sympy(symbol) for symbol in symbols], to_sympy(declared), modules="numpy")
        assert declared.evaluate(values) == pytest.approx(same(*values.values()), rel=1e-12)


def test_hull_facets_force_the_product_and_the_printed_one_does_not():
    """By (26)-(29) at a binary p1 the interval left to z is the product; as printed,
    p1 = 0 leaves one open.
    """
    for facet in ("hull", "printed"):
        rows = [
            family
            for family in declare("milp-mccormick", facet=facet).rows
            if n.z in family.symbols and n.t not in family.symbols
        ]
        for p1, beta in product((0, 1), np.linspace(-QUARTER, QUARTER, 5)):
            low, high = -QUARTER, QUARTER  # the bounds of z
            for family in rows:
                given = to_sympy(family.body.substitute({n.p1: p1})).subs(to_sympy(n.beta_i), beta)
                end = float(sp.solve(given, to_sympy(n.z))[0])
                low, high = (max(low, end), high) if family.sense == ">=" else (low, min(high, end))
            if facet == "hull" or p1 == 1:
                assert (low, high) == pytest.approx((p1 * beta, p1 * beta), abs=1e-15)
            else:
                assert (low, high) == pytest.approx((max(beta, 0) - QUARTER, 0), abs=1e-15)


CLASSES = {
    "minlp-parity": ("MINLP", False, 99, 0),
    "minlp-quartic": ("MINLP", False, 4, 1),
    "minlp-cubic": ("MINLP", False, 3, 1),
    "miqcp-bilinear": ("MIQCP", False, 2, 2),
    "miqcp-bilinear-l1": ("MIQCP", False, 1, 2),
    "miqp-mccormick": ("MIQP", True, 2, 1),
    "milp-mccormick": ("MILP", True, 1, 1),
    "qp-fixed": ("QP", True, 2, 0),
    "miqp-exact": ("MIQP", True, 2, 1),
    "miqp-orthogonal": ("MIQP", True, 2, 1),
    "milp-orthogonal": ("MILP", True, 1, 1),
    "miqp-cycle": ("MIQP", True, 2, 1),
    "milp-cycle": ("MILP", True, 1, 1),
}
"""Class, convexity, degree of the objective and of the rows."""


@for_each("name, expected", CLASSES.items())
def test_every_formulation_has_its_class(name, expected):
    problem = make_problem(name, make_instance(orthogonal=name in RIGHT))
    facts = problem.problem_class, problem.is_convex, problem.objective_degree, problem.row_degree
    assert facts == expected
    if name != "qp-fixed":
        relaxed = cf.formulate(problem.instance, name, relax=True)
        assert relaxed.problem_class == expected[0].removeprefix("MI")
        fixed = problem.with_integers_fixed(make_field(problem.instance))
        assert fixed.problem_class == relaxed.problem_class


@for_each("gauge", ["strokes", "box"])
@for_each("shape", MASKS)
def test_p1_and_p2_reach_every_useful_jump_and_no_other(shape, gauge):
    problem = make_problem("minlp-cubic", make_instance(shape, gauge))
    instance = problem.instance
    p1, p2 = problem.blocks["p1"], problem.blocks["p2"]
    reached = [set() for _ in instance.grid.first]
    for first, second in product((0, 1), range(-4, 5)):
        point = np.zeros(problem.n_columns)
        point[p1.slice], point[p2.slice] = first, second
        allowed = (p1.lower <= first) & (first <= p1.upper) & (p2.lower <= second) & (second <= p2.upper)
        for family in problem.rows:
            excess = family.values(point)
            allowed[family.elements[excess < 0 if family.family.sense == ">=" else excess > 0]] = False
        for pair in np.nonzero(allowed)[0]:
            reached[pair].add(first + 2 * second)
    expected = [set(range(low, high + 1)) for low, high in zip(instance.p_min, instance.p_max, strict=True)]
    assert reached == expected
    parity_block = make_problem("minlp-parity", instance).blocks["p"]
    assert parity_block.lower.tolist() == instance.p_min.tolist()
    assert parity_block.upper.tolist() == instance.p_max.tolist()


@for_each(
    "name, block, change, kind, amount, family",
    [
        ("milp-mccormick", "gamma", -0.25, "rows", 0.25, ("c22", "c23")),
        ("milp-mccormick", "beta", -2.0, "bounds", None, ()),
        ("milp-mccormick", "p2", 0.0625, "integrality", 0.0625, ()),
        ("miqp-exact", "d", 0.5, "rows", 0.5, ("cd",)),
    ],
)
def test_violations_are_found(name, block, change, kind, amount, family):
    field = make_field(make_instance("full"))
    problem = cf.formulate(field.instance, name)
    point = problem.point(field)
    point[problem.blocks[block].offset] += change
    violation = problem.violation(point)
    expected = 2.0 - field.beta[0] - QUARTER if amount is None else amount
    assert getattr(violation, kind) == pytest.approx(expected)
    assert violation.worst >= getattr(violation, kind)
    assert not family or violation.worst_family in family


def test_noise_is_left_out_and_small_weights_are_not():
    """Jumps that cancel leave no cost of 1e-16; the format decides on a weight of 1e-13."""
    instance = grid("/##", 1e-16, stroke_coefficient=1.0, skew_coefficient=1e-13)
    costs = cf.formulate(instance, "qp-fixed", p=[1, 1]).to_arrays().c
    assert costs[1] == 0  # - pi + pi
    assert np.abs(costs[costs != 0]).min() == pytest.approx(2 * HALF * 2)
    costs = cf.formulate(instance, "milp-mccormick").to_arrays().c
    assert (costs == 1e-13).sum() == 3
    assert costs[costs != 0].min() == 1e-13


def test_arrays_do_not_share_memory_with_the_problem():
    problem = make_problem("milp-mccormick", make_instance("full"))
    problem.to_arrays().lower[:] = 7
    assert not (problem.lower == 7).any()


def test_a_formulation_in_the_place_of_a_method_is_named(tmp_path, capfd):
    assert invoke(["solve", "mouse", "--size", "4", "-m", "milp", "-o", str(tmp_path)]) == 2
    assert "milp is a formulation, not a method; write -f milp" in " ".join(capfd.readouterr().err.split())


def test_an_export_names_what_it_leaves_out(tmp_path, capsys):
    assert invoke(["export", "mouse", "--size", "4", "--format", "mps", "-o", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.replace("\n", " ")
    assert "not written: miqp-orthogonal, milp-orthogonal, miqp-cycle, milp-cycle, which is for ort" in lines
