"""Tables of formulations, formats, solvers, methods and readers, for the commands and the docs."""

from __future__ import annotations

from typing import Any

from ...models.errors import UnsupportedByFormatError
from ...models.formulations.catalogue import FORMULATIONS
from ...models.formulations.choice import declare
from ...models.formulations.problem import Problem
from ...models.samples.samples import samples
from ..formats.registry import FORMATS, problem_in_format
from ..runs.methods import METHODS
from ..solutions.readers.registry import READERS
from ..solvers_table import PROGRAMS, smallest_problem, suitabilities

Row = dict[str, Any]


def tables() -> dict[str, list[Row]]:
    """Rows of each table, computed from the code."""
    problems = smallest_problems()
    return {
        "samples": [
            {"name": entry.name, "kind": entry.kind, "description": entry.description} for entry in samples()
        ],
        "formulations": [_formulation_row(problem) for problem in problems],
        "formats": [_format_row(name) for name in FORMATS],
        "solvers": [_solver_row(problem) for problem in problems],
        "methods": [{"name": method.name, "summary": method.summary} for method in METHODS.values()],
        "readers": [{"name": reader.name, "description": reader.description} for reader in READERS],
    }


def smallest_problems() -> list[Problem]:
    """Every formulation on an instance of two pixels."""
    return [smallest_problem(declare(name)) for name in FORMULATIONS]


def _formulation_row(problem: Problem) -> Row:
    recipe = FORMULATIONS[problem.name]
    row: Row = {"name": problem.name, "short": recipe.short, "paper": recipe.paper}
    row |= {"class": recipe.kind, "summary": recipe.summary}
    return row | {name: _describe_support(problem, name) for name in FORMATS}


def _describe_support(problem: Problem, name: str) -> str:
    try:
        held = problem_in_format(problem, FORMATS[name])
    except UnsupportedByFormatError:
        return f"refused: write {problem.formulation.equivalent}"
    return "lifted, exact; relaxed, weaker" if held.formulation.lifted else "yes"


def _format_row(name: str) -> Row:
    entry = FORMATS[name]
    readers = [program.title for program in PROGRAMS.values() if name in program.formats]
    return {
        "name": name,
        "written": "by default" if entry.is_default else "when asked for",
        "verified by": ", ".join(readers) or "none",
        "summary": entry.summary,
    }


def _solver_row(problem: Problem) -> Row:
    answers = {name: taking.reason or taking.answer for name, taking in suitabilities(problem).items()}
    return {"formulation": problem.name} | answers
