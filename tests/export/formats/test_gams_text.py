"""GAMS files against their problems, through a reader of the tests that follows the manual.

GAMS needs a licence that ends; these tests need none.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import gams_reader
import numpy as np
import pytest
from cases import CASES, SKEWED, make_field, make_instance, make_problem, problem_of
from crossfield.export.formats.gams import MODEL_TYPES
from crossfield.export.formats.registry import write
from crossfield.models.field.field import CrossField
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.problem import Problem, with_integers_fixed, with_windows
from crossfield.models.formulations.windows import Windows
from crossfield.models.instance.angles import QUARTER
from crossfield.models.instance.instance import Instance
from loops import for_each

OPTIONS = {"facet": ("hull", "printed"), "stroke_norm": (1, 2), "beta_norm": (1, 2), "relax": (False, True)}
CHANGES = ("", "jumps fixed", "windows narrowed")
STARTS = (False, True)

CORNER = [[True, True], [True, False]]


def corner(gauge: str = "strokes") -> Instance:
    return Instance.on_pixels("corner", CORNER, [[0, 1], [1, 0]], [2.5, 1.2], [0.5, 0.7], gauge=gauge)


INSTANCES = {
    "extreme": Instance.on_pixels(
        "extreme", CORNER, [[0, 0], [1, 0]], [0.0, 3.1], [1e-6, 1.0],
        stroke_coefficient=3e5, skew_coefficient=2e-7,
    ),
    "no skew": make_instance("row", skew_coefficient=0.0),
    "no pairs": Instance.on_pixels("alone", [[True, False, True]], [[0, 0]], [1.2], [0.7], gauge="box"),
    "one pixel": make_instance("pixel"),
}  # fmt: skip
"""Instances whose numbers or shapes are odd."""


def combinations() -> list[tuple[str, str, dict[str, Any]]]:
    """Every formulation in both gauges with every value of its options."""
    return [
        (name, gauge, dict(zip(options, values, strict=True)))
        for name in SKEWED
        for options in [[option for option in OPTIONS if option in FORMULATIONS[name].option_names]]
        for gauge in ("strokes", "box")
        for values in product(*(OPTIONS[option] for option in options))
    ]


def changed(problem: Problem, field: CrossField, change: str) -> Problem:
    if change == "jumps fixed" and problem.integer.any():
        return with_integers_fixed(problem, field)
    return with_windows(problem, narrow_windows(field)) if change == "windows narrowed" else problem


def narrow_windows(field: CrossField) -> Windows:
    """Windows around a field, half as wide as those of its gauge; jumps may be one below the field's."""
    instance = field.instance
    bounds = []
    for value, low, high in (
        (field.alpha, instance.alpha_lower, instance.alpha_upper),
        (field.beta, np.full_like(field.beta, -QUARTER), np.full_like(field.beta, QUARTER)),
    ):
        bounds += [(value + low) / 2, (value + high) / 2]
    return Windows(*bounds, np.maximum(field.p - 1, instance.p_min), field.p, 1.0, "none")


def assert_text(problem: Problem, folder: Path, start: CrossField | None = None) -> None:
    """Write the file, and compare what it says with the problem."""
    point = None if start is None else problem.point(start)
    write(problem, folder / "model.gms", start=start)
    model = gams_reader.read((folder / "model.gms").read_text("ascii"))
    assert gams_reader.difference(model, problem, point) == ""
    assert model.type == MODEL_TYPES[problem.problem_class]
    assert model.unstated == set()
    assert model.start == (None if point is None else problem.objective_value(point))


@for_each("number", range(len(combinations())))
def test_text_says_what_the_problem_is(number: int, tmp_path: Path):
    """One change and start of each combination; all of them are in the slow test."""
    name, gauge, options = combinations()[number]
    instance = corner(gauge)
    field = make_field(instance)
    problem = changed(make_problem(name, instance, **options), field, CHANGES[number % 3])
    assert_text(problem, tmp_path, field if number % 2 else None)


@for_each("name", SKEWED)
@for_each("instance", INSTANCES.values())
def test_text_of_odd_instances_says_what_the_problem_is(name: str, instance: Instance, tmp_path: Path):
    field = make_field(instance)
    assert_text(make_problem(name, instance), tmp_path, field)


@for_each("count", (11, 12, 13, 14, 24, 25))
def test_lists_of_names_that_fill_a_line(count: int, tmp_path: Path):
    """12 names of alpha and 13 of beta fill a line."""
    instance = Instance.on_pixels("line", np.ones((1, count), bool), [[0, 0]], [0.3], [0.5])
    assert_text(make_problem("miqp-mccormick", instance), tmp_path)


@pytest.mark.slow
@for_each("start", STARTS)
@for_each("change", CHANGES)
@for_each("name, gauge, options", combinations())
def test_text_with_every_option_says_what_the_problem_is(
    name: str, gauge: str, options: dict[str, Any], change: str, start: bool, tmp_path: Path
):
    instance = corner(gauge)
    field = make_field(instance)
    problem = changed(make_problem(name, instance, **options), field, change)
    assert_text(problem, tmp_path, field if start else None)


@pytest.mark.slow
@for_each("label", CASES)
def test_text_of_other_shapes_says_what_the_problem_is(label: str, tmp_path: Path):
    assert_text(problem_of(label), tmp_path)


def test_options_of_gams_ask_for_an_optimum_and_a_short_listing(tmp_path: Path):
    write(make_problem("milp-mccormick", corner()), tmp_path / "model.gms")
    options = gams_reader.read((tmp_path / "model.gms").read_text("ascii")).options
    gaps = {name: float(options.pop(name)) for name in ("optca", "optcr")}
    assert gaps == {"optca": 0.0, "optcr": 1e-6}
    assert options == {"limrow": "0", "limcol": "0", "solprint": "off", "sysout": "off"}
