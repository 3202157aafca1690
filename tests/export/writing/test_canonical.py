"""The canonical form describes the files: columns, kinds, limits and orders agree."""

from __future__ import annotations

from cases import make_field, make_instance, make_problem
from crossfield.export.formats.registry import FORMATS
from crossfield.export.writing.canonical import CanonicalForm
from crossfield.models.formulations.problem import with_integers_fixed


def lines_of(form: CanonicalForm, name: str) -> list[str]:
    text = b"".join(FORMATS[name].generate(form, [], None, "")).decode()
    return text.splitlines()


def named(form: CanonicalForm, file: str) -> list[str]:
    """Names of columns in the form's order for a file."""
    names = [name.decode() for name in form.column_names] + [form.one.decode()]
    return [names[column] for column in form.order(file)]


def test_a_block_is_binary_when_all_its_bounds_are_exactly_0_and_1():
    """All formats follow this rule except .nl, whose header counts all integers within [0, 1]."""
    problem = make_problem("milp-mccormick", make_instance())
    form = CanonicalForm(problem)
    p1 = problem.blocks["p1"]
    assert form.kind(p1) == "binary"
    assert "Binaries" in lines_of(form, "lp")
    held = CanonicalForm(with_integers_fixed(problem, make_field(problem.instance)))
    assert held.kind(held.problem.blocks["p1"]) == "continuous"
    assert "Binaries" not in lines_of(held, "lp")
