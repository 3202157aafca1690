"""Representations in notebooks: pictures, formulas, and one line of a solution without a point."""

import io

import crossfield as cf
import numpy as np
import pytest
from PIL import Image


@pytest.fixture(scope="module")
def instance():
    return cf.sample("skew", 6)


def test_instances_and_fields_are_pictures(instance):
    for shown in (instance, cf.power_field(instance)):
        picture = Image.open(io.BytesIO(shown._repr_png_()))
        picture.load()
        assert picture.format == "PNG"
        assert 200 < max(picture.size) < 700
        assert np.ptp(np.asarray(picture.convert("L"))) > 100


def test_a_problem_is_shown_in_formulas_and_a_solution_without_a_point_by_its_status(instance, tmp_path):
    problem = cf.formulate(instance, "milp-mccormick")
    formula = problem._repr_latex_()
    assert formula.startswith("$$\n\\begin{aligned}")
    assert formula.count(r"\text{(28), (29)}") == 1
    assert r"p_{ij,1} \in \{0, 1\}" in formula
    answer = tmp_path / "answer.sol"
    answer.write_text("=infeas=\n")
    empty = cf.read_solution(answer, problem, identified=True)
    assert repr(empty) == "<Solution of milp-mccormick on skew: infeasible>"
