"""Problems: columns and bounds, terms against values, points against fields, violations,
what identifies a problem.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from cases import (
    CASES,
    LOW_DEGREE,
    MASKS,
    SKEWED,
    make_field,
    make_instance,
    make_problem,
    points_of,
    problem_of,
)
from crossfield.export.formats.registry import FORMATS, problem_in_format
from crossfield.models.errors import InstanceError
from crossfield.models.field.field import CrossField
from crossfield.models.formulations.problem import formulate, with_integers_fixed
from crossfield.models.instance.angles import HALF, QUARTER
from crossfield.models.instance.instance import Instance
from loops import for_each

POLYNOMIAL = [label for label in CASES if not label.startswith("minlp-parity")]


def by_terms(terms, count, point):
    """Monomials summed up at a point, one value per element."""
    total = np.zeros(count)
    for term in terms:
        total += term.coefficient * np.prod([point[factor] for factor in term.factors], axis=0)
    return total


@pytest.mark.slow
@for_each("label", POLYNOMIAL)
def test_terms_give_the_values_of_every_family(label):
    for problem in (problem_of(label), problem_in_format(problem_of(label), FORMATS["lp"])):
        for point in points_of(problem, 5):
            for family in (*problem.objective, *problem.rows):
                np.testing.assert_allclose(
                    by_terms(family.terms, family.count, point), family.values(point), rtol=1e-10, atol=1e-10
                )
            for family in problem.rows:
                assert family.degree <= 2
                rest = by_terms([term for term in family.terms if term.degree], family.count, point)
                np.testing.assert_allclose(rest - family.limit, family.values(point), rtol=1e-10, atol=1e-10)


@for_each("label", POLYNOMIAL)
def test_merged_objective_gives_its_value(label):
    for problem in (problem_of(label), problem_in_format(problem_of(label), FORMATS["lp"])):
        merged = [problem.merged_objective(degree) for degree in range(problem.objective_degree + 1)]
        for index, coefficient in merged[1:]:
            assert (coefficient != 0).all()
            assert (np.diff(index, axis=1) >= 0).all()
            assert len(np.unique(index, axis=0)) == len(index)
            assert index.tolist() == sorted(index.tolist())
        for point in points_of(problem, 5):
            value = sum(np.prod(point[index], axis=1) @ coefficient for index, coefficient in merged)
            assert value == pytest.approx(problem.objective_value(point), rel=1e-10, abs=1e-10)


# columns


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
    parity = make_problem("minlp-parity", instance).blocks["p"]
    assert parity.lower.tolist() == instance.p_min.tolist()
    assert parity.upper.tolist() == instance.p_max.tolist()


# points and fields


@for_each("label", CASES)
def test_a_field_is_a_feasible_point_and_comes_back(label):
    problem = problem_of(label)
    field = make_field(problem.instance)  # also the one whose jumps are data or fixed
    for form in (problem, problem_in_format(problem, FORMATS["lp"]) if label in LOW_DEGREE else problem):
        point = form.point(field)
        assert form.violation(point).worst < 1e-12
        back = form.field(point)
        for name in ("alpha", "beta", "p") if "alpha" in problem.blocks else ():
            np.testing.assert_array_equal(getattr(back, name), getattr(field, name))
        np.testing.assert_allclose(form.point(back), point, atol=1e-12)
        assert form.objective_value(point) == pytest.approx(
            problem.objective_value(problem.point(field)), rel=1e-12
        )


@pytest.mark.parametrize("name", ["minlp-quartic", "minlp-cubic"])
def test_lifted_problems_are_exact(name):
    """At any angles and any binary p1, with z = p1 beta, far outside of the bounds as well."""
    problem = make_problem(name, make_instance())
    other = problem.lifted
    assert (other.objective_degree, other.row_degree, other.is_convex) == (2, 1, name == "minlp-quartic")
    rng = np.random.default_rng(7)
    for point in points_of(problem):
        p1 = rng.integers(0, 2, problem.blocks["p1"].count)
        point[problem.blocks["p1"].slice] = p1
        z = p1 * point[problem.blocks["beta"].slice][problem.instance.grid.first]
        assert list(other.blocks) == [*problem.blocks, "z"]
        extended = np.concatenate([point, z])
        assert other.objective_value(extended) == pytest.approx(problem.objective_value(point), rel=1e-12)
    assert "hull" in other.formulation.lifted
    assert other.sha256 != problem.sha256
    relaxed = make_problem("minlp-cubic", make_instance(), relax=True)
    assert relaxed.lifted.problem_class == "QP"


def test_convex_problems_have_positive_semidefinite_hessians():
    """The Hessian of a quadratic objective is positive semidefinite where the problem says so,
    and only there.
    """
    for label in LOW_DEGREE:
        problem = problem_in_format(problem_of(label), FORMATS["lp"])
        if problem.row_degree > 1:
            assert not problem.is_convex
            continue
        index, coefficient = problem.merged_objective(2)
        hessian = np.zeros((problem.n_columns, problem.n_columns))
        np.add.at(hessian, (index[:, 0], index[:, 1]), coefficient)
        least = np.linalg.eigvalsh(hessian + hessian.T)[0] if len(coefficient) else 0.0
        if problem.is_convex:
            assert least > -1e-12
        elif len(problem.instance.domain.first):
            assert least < -1e-3


def test_violations_are_found():
    field = make_field(make_instance("full"))
    problem = formulate(field.instance, "milp-mccormick")
    point = problem.point(field)
    tight = next(family for family in problem.rows if family.family.tag == "c22")
    assert (point[problem.blocks["gamma"].slice] >= np.abs(field.residual_r) - 1e-15).all()
    worse = point.copy()
    worse[problem.blocks["gamma"].offset] -= 0.25
    violation = problem.violation(worse)
    assert violation.rows == pytest.approx(0.25)
    assert violation.worst_family in {"c22", "c23"}
    assert tight.count == len(field.instance.theta)
    worse = point.copy()
    worse[problem.blocks["beta"].offset] = -QUARTER - 0.125
    assert problem.violation(worse).bounds == pytest.approx(0.125)
    worse = point.copy()
    worse[problem.blocks["p2"].offset] += 0.0625
    assert problem.violation(worse).integrality == pytest.approx(0.0625)
    assert problem.violation(worse).worst >= 0.0625
    exact = formulate(field.instance, "miqp-exact")
    worse = exact.point(field)
    worse[exact.blocks["d"].offset] += 0.5
    assert (exact.violation(worse).rows, exact.violation(worse).worst_family) == (pytest.approx(0.5), "cd")


def test_fractional_jumps_of_an_answer_are_rounded():
    field = make_field(make_instance("full"))
    for name in ("milp-mccormick", "minlp-parity"):
        problem = formulate(field.instance, name)
        noise = np.random.default_rng(0).uniform(-0.1, 0.1, problem.n_columns)
        point = problem.point(field) + np.where(problem.integer, noise, 0)
        np.testing.assert_array_equal(problem.field(point).p, field.p)


# fixed integers and data


@for_each("name", [name for name in SKEWED if name != "qp-fixed"])
def test_fixed_integers_are_continuous_columns_with_equal_bounds(name):
    field = make_field(make_instance("parts"))
    problem = formulate(field.instance, name)
    pinned = with_integers_fixed(problem, field)
    assert not pinned.integer.any()
    assert ((pinned.lower == pinned.upper) == problem.integer).all()
    assert (pinned.lower[problem.integer] == problem.point(field)[problem.integer]).all()
    assert pinned.objective_value(pinned.point(field)) == problem.objective_value(problem.point(field))
    assert pinned.sha256 != problem.sha256


def test_fields_of_another_instance_are_refused():
    field = make_field(make_instance("row"))
    others = [make_instance("row", seed=5), make_instance("row", gauge="box"), make_instance("full")]
    for other in others:
        problem = formulate(other, "milp-mccormick")
        with pytest.raises(InstanceError, match=r"on another instance .tiny: .* not on this one"):
            problem.point(field)
        with pytest.raises(InstanceError, match=r"on another instance .tiny: .* not on this one"):
            with_integers_fixed(problem, field)


def test_sha256_stands_for_everything_that_changes_a_file():
    instance = make_instance()
    field = make_field(instance)
    other = CrossField(
        instance, field.alpha, field.beta, np.clip(field.p + 1, instance.p_min, instance.p_max)
    )
    problems = [
        formulate(instance, "milp-mccormick"),
        formulate(instance.with_gauge("box"), "milp-mccormick"),
        formulate(instance, "milp-mccormick", facet="printed"),
        formulate(instance, "milp-mccormick", relax=True),
        formulate(instance, "milp-mccormick", stroke_norm=2),
        formulate(instance, "milp-mccormick", beta_norm=2),
        formulate(instance, "miqp-mccormick"),
        formulate(instance, "qp-fixed", p=field.p),
        formulate(instance, "qp-fixed", p=other.p),
        with_integers_fixed(formulate(instance, "milp-mccormick"), field),
        with_integers_fixed(formulate(instance, "milp-mccormick"), other),
    ]
    assert len({problem.sha256 for problem in problems}) == len(problems)
    assert formulate(make_instance(), "milp-mccormick").sha256 == problems[0].sha256


def test_noise_is_left_out_and_small_weights_are_not():
    """Jumps that cancel leave no cost of 1e-16; the format decides on a weight of 1e-13."""
    mask = np.ones((1, 3), dtype=bool)
    instance = Instance.on_pixels(
        "line", mask, np.array([[0, 0]]), np.array([1e-16]), np.ones(1), skew_coefficient=1e-13
    )
    problem = formulate(instance, "qp-fixed", p=[1, 1])
    index, coefficient = problem.merged_objective(1)
    middle = problem.blocks["alpha"].offset + 1
    assert middle not in index[:, 0]  # - pi + pi
    assert np.abs(coefficient).min() == pytest.approx(2 * HALF * 2)
    line = formulate(instance, "milp-mccormick")
    index, coefficient = line.merged_objective(1)
    assert coefficient.min() == 1e-13
    assert (coefficient == 1e-13).sum() == 3
