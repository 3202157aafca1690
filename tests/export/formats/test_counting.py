"""A writer that loses a record writes no file: each format counts its records and compares."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cached_property

import pytest
from cases import make_instance, make_problem
from crossfield.export.formats.registry import FORMATS, write
from crossfield.models.errors import ConsistencyError
from crossfield.models.formulations.problem import Problem, formulate
from crossfield.models.instance.instance import Instance
from loops import for_each

LAYOUTS = [
    ("nl", "text"),
    ("nl", "binary"),
    ("gms", "scalar"),
    ("lp", ""),
    ("mps", ""),
    ("osil", ""),
    ("qplib", ""),
    ("bar", ""),
]
"""Formats that list columns and rows."""


class FewerRows(Problem):
    """The last family of rows lacks its last element."""

    @cached_property
    def rows(self):
        *others, last = Problem.rows.func(self)
        return (*others, replace(last, elements=last.elements[:-1]))


class FewerTerms(Problem):
    """The last term of the objective is missing."""

    @cached_property
    def objective(self):
        return Problem.objective.func(self)[:-1]


class FewerCosts(Problem):
    """One merged cost, or one merged product, is missing."""

    def merged_objective(self, degree):
        index, coefficient = super().merged_objective(degree)
        return (index, coefficient) if degree == 0 else (index[1:], coefficient[1:])


class FewerStrokes(Instance):
    """The places of strokes lack the last one."""

    @cached_property
    def stroke_index(self):
        return Instance.stroke_index.func(self)[:-1]


def damaged(kind: type[Problem], name: str = "milp-mccormick") -> Problem:
    whole = make_problem(name, make_instance())
    return kind(whole.instance, whole.formulation, whole.jumps)


def refused(problem: Problem, suffix: str, dialect: str, folder, what: str, *, kept: Problem) -> None:
    """Check that no file appears, and that an earlier file stays."""
    path = folder / f"model.{suffix}"
    for name in (path, path.with_name(f"{path.name}.gz")):
        with pytest.raises(ConsistencyError, match=what) as raised:
            write(problem, name, dialect=dialect)
        assert raised.value.file == name if suffix != "mod" else raised.value.file.stem.startswith("model")
        assert str(raised.value).count("please report it") == 1
        assert list(folder.iterdir()) == []
    write(kept, path, dialect=dialect)
    before = {each.name: each.read_bytes() for each in folder.iterdir()}
    with pytest.raises(ConsistencyError):
        write(problem, path, dialect=dialect)
    assert {each.name: each.read_bytes() for each in folder.iterdir()} == before


@for_each("suffix, dialect", LAYOUTS)
def test_a_lost_row_is_an_error_and_leaves_no_file(suffix, dialect, tmp_path):
    whole = make_problem("milp-mccormick", make_instance())
    found = rf"model\.{suffix}(\.gz)?: holds {whole.n_rows - 1} rows.*the problem has {whole.n_rows};"
    refused(damaged(FewerRows), suffix, dialect, tmp_path, found, kept=whole)


@for_each("suffix, dialect", LAYOUTS)
@for_each("name", ["milp-mccormick", "minlp-quartic"])
def test_a_lost_term_of_the_objective_is_an_error(name, suffix, dialect, tmp_path):
    if name == "minlp-quartic" and FORMATS[suffix].degree <= 2:
        return
    whole = make_problem(name, make_instance())
    refused(damaged(FewerTerms, name), suffix, dialect, tmp_path, "but th.* problem ", kept=whole)


@for_each("suffix", ["lp", "mps", "osil", "qplib"])
@for_each(
    "name, found", [("milp-mccormick", "holds {} linear costs, but"), ("qp-fixed", "but th.* problem ")]
)
def test_a_lost_merged_term_is_an_error(name, found, suffix, tmp_path):
    """The formats that write merged terms; .nl adds up its own, and .gms and .bar write terms as declared."""
    whole = make_problem(name, make_instance())
    words = found.format(len(whole.merged_objective(1)[1]) - 1)
    refused(damaged(FewerCosts, name), suffix, "", tmp_path, words, kept=whole)


def test_a_lost_stroke_is_an_error(tmp_path):
    instance = make_instance(gauge="box")
    fewer = FewerStrokes(*(getattr(instance, each.name) for each in fields(Instance)))
    whole, problem = (formulate(each, "milp-mccormick") for each in (instance, fewer))
    count = len(instance.theta)
    found = f"holds {count - 1} strokes, but the problem has {count};"
    refused(problem, "mod", "", tmp_path, found, kept=whole)
