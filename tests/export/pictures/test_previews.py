"""Representations in notebooks: pictures, tables that load nothing, and one line of each."""

import base64
import io
import re

import crossfield as cf
import numpy as np
import pytest
from defusedxml import ElementTree
from PIL import Image


@pytest.fixture(scope="module")
def instance():
    return cf.sample("skew", 6)


@pytest.fixture(scope="module")
def field(instance):
    return cf.power_field(instance)


@pytest.fixture(scope="module")
def problem(instance):
    return cf.formulate(instance, "milp-mccormick")


@pytest.fixture(scope="module")
def solution(instance, field):
    return cf.solve(cf.formulate(instance, "qp-fixed", p=field.p))


def test_instances_and_fields_are_pictures(instance, field):
    pictures = [shown._repr_png_() for shown in (instance, field)]
    assert instance._repr_png_() == pictures[0]
    for data in pictures:
        picture = Image.open(io.BytesIO(data))
        picture.load()
        assert picture.format == "PNG"
        assert 200 < max(picture.size) < 700
        assert np.ptp(np.asarray(picture.convert("L"))) > 100


def test_problems_and_solutions_are_tables_that_load_nothing(problem, solution):
    tables = [shown._repr_html_() for shown in (problem, solution)]
    roots = [ElementTree.fromstring(html) for html in tables]
    for root, html in zip(roots, tables, strict=True):
        tags = {element.tag for element in root.iter()}
        assert tags <= {"div", "table", "caption", "tbody", "tr", "th", "td", "img"}
        assert not re.search(r"https?:|url\(|<script", html)
        for image in root.iter("img"):
            kind, data = image.get("src").split(",")
            assert kind == "data:image/png;base64"
            assert base64.b64decode(data).startswith(b"\x89PNG")
    facts = {row[0].text: row[1].text for row in roots[0].iter("tr")}
    assert facts["class"] == "MILP, convex"
    assert f"{problem.instance.grid.size} alpha" in facts["columns"]
    assert len(list(roots[1].iter("img"))) == 1


def test_a_problem_is_shown_in_formulas(problem):
    formula = problem._repr_latex_()
    assert formula.startswith("$$\n\\begin{aligned}")
    assert formula.count(r"\text{(28), (29)}") == 1
    assert r"p_{ij,1} \in \{0, 1\}" in formula


def test_a_solution_without_a_point_is_reported(problem):
    from crossfield.export.statuses import Status

    empty = cf.Solution(problem, None, Status.INFEASIBLE, "<no> & never", "highs", identified=True)
    assert repr(empty) == "<Solution of milp-mccormick on skew: infeasible>"
    assert "<img" not in empty._repr_html_()
    assert "&lt;no&gt; &amp; never" in empty._repr_html_()
