"""The Pyomo model is the problem: columns, bounds, and values of objective and rows."""

from __future__ import annotations

import math

import numpy as np
import pyomo.environ as pyo
import pytest
from cases import CASES, SKEWED, make_field, make_instance, make_problem, names_of, points_of, problem_of
from crossfield.export.formats.pyomo_model import to_pyomo
from crossfield.models.errors import InstanceError
from crossfield.models.formulations.names import column_names
from crossfield.models.formulations.problem import Problem
from loops import for_each


def our_name(component) -> str:
    """`p1[0,2,u]` as `p1_00_02_u`."""
    place = component.index() if isinstance(component.index(), tuple) else (component.index(),)
    return "_".join(
        [component.parent_component().name, *(f"{i:02}" if isinstance(i, int) else i for i in place)]
    )


def columns_of(model, problem: Problem) -> list:
    return [
        variable for block in problem.blocks.values() for variable in model.component(block.name).values()
    ]


@pytest.mark.slow
@for_each("label", [label for label in CASES if "far" not in label])
def test_the_pyomo_model_is_the_problem(label: str):
    problem = problem_of(label)
    model = to_pyomo(problem)
    columns = columns_of(model, problem)
    assert [our_name(variable) for variable in columns] == names_of(
        column_names(problem.instance, problem.blocks)
    )
    assert [-math.inf if v.lb is None else v.lb for v in columns] == problem.lower.tolist()
    assert [math.inf if v.ub is None else v.ub for v in columns] == problem.upper.tolist()
    assert [v.is_integer() for v in columns] == problem.integer.tolist()
    assert all(
        v.domain is pyo.Binary for v in columns if v.parent_component().name == "p1" and v.is_integer()
    )
    assert all(v.value is None for v in columns)
    rows = list(model.component_data_objects(pyo.Constraint))
    assert len(rows) == problem.n_rows
    for point in points_of(problem, 3):
        for variable, value in zip(columns, point, strict=True):
            variable.set_value(value, skip_validation=True)
        assert pyo.value(model.obj) == pytest.approx(problem.objective_value(point), rel=1e-9, abs=1e-9)
        for family in problem.rows:
            component = model.component(family.family.tag)
            value = family.values(point)
            expected = {">=": value, "<=": -value, "==": -np.abs(value)}[family.family.sense]
            np.testing.assert_allclose(
                [row.slack() for row in component.values()], expected, rtol=1e-9, atol=1e-9
            )
            assert all(row.equality == (family.family.sense == "==") for row in component.values())


@pytest.mark.parametrize(
    "label",
    [
        "minlp-parity gauge=strokes",
        "miqp-exact gauge=box",
        "milp-mccormick gauge=strokes",
        "qp-fixed gauge=box",
    ],
)
def test_start_is_the_point_of_the_field(label: str):
    problem = problem_of(label)
    field = make_field(problem.instance)
    model = to_pyomo(problem, start=field)
    assert [variable.value for variable in columns_of(model, problem)] == problem.point(field).tolist()
    assert pyo.value(model.obj) == pytest.approx(problem.objective_value(problem.point(field)), rel=1e-12)
    for row in model.component_data_objects(pyo.Constraint):
        assert row.lslack() > -1e-12
        assert row.uslack() > -1e-12
    with pytest.raises(InstanceError, match=r"on another instance \(tiny: 5 x 1.*not on this one"):
        to_pyomo(problem, start=make_field(make_instance("row")))


@for_each("name", SKEWED)
def test_one_pixel_has_empty_components(name: str):
    problem = make_problem(name, make_instance("pixel"))
    model = to_pyomo(problem)
    assert len(columns_of(model, problem)) == problem.n_columns
