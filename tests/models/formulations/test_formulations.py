"""The mathematics of the formulations: the paper's formulas, their equivalence,
and optima that are known by hand.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import sympy as sp
from cases import MASKS, RIGHT, make_field, make_instance
from crossfield.export.solving.local import solve
from crossfield.models.errors import FormulationError
from crossfield.models.field.field import CrossField
from crossfield.models.formulations import symbols as n
from crossfield.models.formulations.catalogue import CUBIC, PARITY, QUARTIC, declare
from crossfield.models.formulations.latex import to_sympy
from crossfield.models.formulations.problem import formulate, with_integers_fixed
from crossfield.models.instance.angles import HALF, QUARTER
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.symmetries import mirrored, transposed, turned
from crossfield.models.processes.limits import Limits
from exhaustive import random_instance
from loops import for_each

pytestmark = pytest.mark.numeric

SQUARES = ["minlp-parity", "minlp-quartic", "minlp-cubic", "miqp-exact", "qp-fixed"]
MIXED = ["miqcp-bilinear", "miqp-mccormick"]
ABSOLUTE = ["miqcp-bilinear-l1", "milp-mccormick"]
GAUGES = ["strokes", "box"]


def objective_at(name, field, **options):
    problem = formulate(field.instance, name, p=field.p if name == "qp-fixed" else None, **options)
    point = problem.point(field)
    assert problem.violation(point).worst < 1e-12
    return problem.objective_value(point)


# formulas


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
    for parity in (0, 1):
        assert sp.expand((quartic - printed).subs(p1, parity)) == 0
    assert sp.expand(quartic - printed) != 0  # it takes the binary
    assert sp.Poly(quartic, x, p1).total_degree() == 4
    assert sp.Poly(cubic, a, b, x, y, p1, p2).total_degree() == 3


def test_parity_is_8_for_whole_jumps():
    half = sp.Symbol("half", integer=True)
    p, p2 = to_sympy(n.p), to_sympy(n.p2)
    for parity in (0, 1):
        whole = to_sympy(PARITY).subs(p, 2 * half + parity)
        split = to_sympy(QUARTIC.substitute({n.p1: parity})).subs(p2, half)
        assert sp.expand(sp.simplify(whole) - split) == 0


def test_hull_facets_force_the_product_and_the_printed_one_does_not():
    """By (26)-(29) at a binary p1 the interval left to z is the product; as printed,
    p1 = 0 leaves one open.
    """
    for facet in ("hull", "printed"):
        rows = [
            f
            for f in declare("milp-mccormick", facet=facet).rows
            if n.z in f.symbols and n.t not in f.symbols
        ]
        for p1, beta in product((0, 1), np.linspace(-QUARTER, QUARTER, 7)):
            low, high = -QUARTER, QUARTER  # the bounds of z
            for family in rows:
                given = to_sympy(family.body.substitute({n.p1: p1})).subs(to_sympy(n.beta_i), beta)
                end = float(sp.solve(given, to_sympy(n.z))[0])
                low, high = (max(low, end), high) if family.sense == ">=" else (low, min(high, end))
            if facet == "hull" or p1 == 1:
                assert (low, high) == pytest.approx((p1 * beta, p1 * beta), abs=1e-15)
            else:
                assert low == pytest.approx(max(beta, 0) - QUARTER, abs=1e-15)
                assert high == pytest.approx(0, abs=1e-15)


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
    field = make_field(make_instance(orthogonal=name in RIGHT))
    problem = formulate(field.instance, name, p=field.p if name == "qp-fixed" else None)
    assert (
        problem.problem_class,
        problem.is_convex,
        problem.objective_degree,
        problem.row_degree,
    ) == expected
    if name != "qp-fixed":
        relaxed = formulate(field.instance, name, relax=True)
        assert relaxed.problem_class == expected[0].removeprefix("MI").replace("NLP", "NLP")
        assert not relaxed.integer.any()
        pinned = with_integers_fixed(problem, field)
        assert not pinned.integer.any()
        assert pinned.problem_class == relaxed.problem_class


# values


@for_each("gauge", GAUGES)
@for_each("shape", MASKS)
def test_objectives_are_the_energies_of_the_field(shape, gauge):
    for seed in range(4):
        field = make_field(make_instance(shape, gauge, seed), seed)
        squares, absolute = field.energy(2), field.energy(1)
        for name in SQUARES:
            assert objective_at(name, field) == pytest.approx(squares.total, rel=1e-9)
        for name in MIXED:
            mixed = absolute.smooth + squares.strokes + squares.beta
            assert objective_at(name, field) == pytest.approx(mixed, rel=1e-9)
            assert objective_at(name, field, stroke_norm=1) == pytest.approx(
                mixed - squares.strokes + absolute.strokes, rel=1e-9
            )
            assert objective_at(name, field, beta_norm=1) == pytest.approx(
                mixed - squares.beta + absolute.beta, rel=1e-9
            )
        for name in ABSOLUTE:
            assert objective_at(name, field) == pytest.approx(absolute.total, rel=1e-9)
            assert objective_at(name, field, relax=True) == pytest.approx(absolute.total, rel=1e-9)
        assert objective_at("milp-mccormick", field, facet="printed") == pytest.approx(
            absolute.total, rel=1e-9
        )


def test_two_labels_of_one_cross_cost_nothing_at_the_jump_one():
    """(0, b) and (pi/2, -b) are two labels of one cross: p = +1 takes the first to the second."""
    instance = Instance.on_pixels(
        "two", np.ones((1, 2), bool), np.array([[0, 0]]), np.array([0.3]), np.ones(1)
    )
    assert (instance.grid.first.tolist(), instance.grid.second.tolist()) == ([0], [1])
    field = CrossField(instance, np.array([0, HALF]), np.array([0.3, -0.3]), np.array([1]))
    other = replace(field, p=np.array([0]))
    for name in (*SQUARES, *MIXED, *ABSOLUTE):
        norm = 1 if name in ABSOLUTE else 2
        assert objective_at(name, field) == pytest.approx(field.energy(norm).beta, rel=1e-12)
        smooth = 2 * (HALF**2 + 0.6**2) if name in SQUARES else 2 * (HALF + 0.6)
        assert objective_at(name, other) == pytest.approx(smooth + field.energy(norm).beta, rel=1e-12)


# optima


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [(20, 20), (0, 90), (100, 100), (30, 120), (10, 70), (170, 50)])
def test_parallel_strokes_and_two_families_cost_nothing(degrees):
    """Strokes of one direction, or of two at any angle, are met by one constant cross;
    the hint of skew costs skew_coefficient.
    """
    pixels = np.array([[0, 0], [0, 2], [2, 0], [2, 2]])
    theta = np.radians(np.array([degrees[0], degrees[1], degrees[1], degrees[0]]))
    instance = Instance.on_pixels("lines", np.ones((3, 3), bool), pixels, theta, np.ones(4))
    solution = solve(formulate(instance, "milp-mccormick"), "highs", limits=Limits(250))
    assert solution.status == "optimal-global"
    assert solution.objective < 9 * 1e-6 * QUARTER + 1e-9
    assert solution.field.energy(1).total == pytest.approx(solution.objective, abs=1e-7)


def optimum(instance, name="milp-mccormick", **options):
    solution = solve(formulate(instance, name, **options), "highs", limits=Limits(250, gap=0))
    assert solution.status == "optimal-global"
    return solution.objective


@pytest.mark.parametrize("seed", [4, 6])
@pytest.mark.slow
def test_optimum_does_not_depend_on_the_axes(seed):
    instance = random_instance(seed, (3, 3), 3)
    best = optimum(instance)
    assert best > 1e-3
    for moved in (turned(instance), mirrored(instance), transposed(instance)):
        assert optimum(moved) == pytest.approx(best, rel=1e-6, abs=1e-7)
    assert optimum(instance.with_gauge("box")) >= best - 1e-7


def test_the_box_forces_skew_and_depends_on_the_axes():
    """Strokes at 120 degrees everywhere: free of cost, unless the box holds alpha below 90 degrees."""
    pixels = np.argwhere(np.ones((2, 2)))
    instance = Instance.on_pixels(
        "steep", np.ones((2, 2), bool), pixels, np.full(4, np.radians(120)), np.ones(4), skew_coefficient=1e-2
    )
    assert optimum(instance) == pytest.approx(0, abs=1e-9)
    boxed = instance.with_gauge("box")
    assert optimum(boxed) == pytest.approx(4 * 1e-2 * np.radians(30), rel=1e-6)
    assert optimum(turned(boxed)) == pytest.approx(0, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("gauge", GAUGES)
def test_the_printed_facet_is_a_weaker_relaxation(gauge):
    gaps = [
        optimum(random_instance(seed, (3, 3), 3, gauge))
        - optimum(random_instance(seed, (3, 3), 3, gauge), facet="printed")
        for seed in (4, 5, 6, 7)
    ]
    assert min(gaps) >= -1e-7
    assert gauge == "box" or max(gaps) > 1e-3


# declarations


def test_options_that_a_formulation_lacks_are_refused():
    with pytest.raises(FormulationError, match=r"no formulation 'milo' .*; choose one of minlp-parity"):
        declare("milo")
    with pytest.raises(FormulationError, match="no option 'norm'"):
        declare("milp-mccormick", norm=1)
    with pytest.raises(FormulationError, match="minlp-cubic has no option facet"):
        declare("minlp-cubic", facet="printed")
    with pytest.raises(FormulationError, match="qp-fixed has no option relax"):
        declare("qp-fixed", relax=True)
    with pytest.raises(FormulationError, match="miqp-exact has no option facet"):
        declare("miqp-exact", facet="printed")
    with pytest.raises(FormulationError, match="no facet 'round'"):
        declare("milp-mccormick", facet="round")
    with pytest.raises(FormulationError, match="1 or 2"):
        declare("milp-mccormick", stroke_norm=3)
    assert declare("milp-mccormick", facet=None, relax=None) == declare("milp-mccormick")
    assert declare("minlp-cubic", facet="hull") == declare("minlp-cubic")
