"""Entries with the same optimum (docs/mathematics.md, 5 to 7), and changes that files make."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from ....models.errors import UnsupportedByFormatError
from ....models.formulations.catalogue import FORMULATIONS
from ....models.formulations.problem import Problem
from ...formats.registry import FORMATS, problem_in_format
from ...writing.canonical import CanonicalForm
from .recipe import EntryRecipe, entry_name, norm_minimised


def equivalent_entries(recipe: EntryRecipe, names: Collection[str]) -> list[dict[str, Any]]:
    """Return the formulations with the same optimum, and the reasons. names: entries of the library."""
    if recipe.facet == "printed":
        return []
    entries: list[dict[str, Any]] = []
    mine, norm = FORMULATIONS[recipe.formulation].minimises, norm_minimised(recipe.formulation)
    if recipe.tightened:
        plain = entry_name(recipe.instance, recipe.formulation, recipe.facet)
        why = "the windows of the certificate contain every field of at most its energy; points transfer"
        entries.append({"formulation": recipe.formulation, "entry": plain, "why": why})
    for formulation, declared in FORMULATIONS.items():
        name = entry_name(recipe.instance, formulation, "hull")
        # Where an instance has entries for orthogonal crosses, so are the crosses of all its entries.
        is_same = declared.minimises == mine or (name in names and norm_minimised(formulation) == norm)
        if formulation != recipe.formulation and norm is not None and is_same:
            why = f"both minimise {mine}; {declared.how}; points transfer by alpha, beta and the jumps"
            entries.append({"formulation": formulation, "entry": name if name in names else None, "why": why})
    return entries


def format_notes(problem: Problem, name: str) -> list[str]:
    """Return the changes that the file of a format makes; empty if it refuses the problem."""
    try:
        held = problem_in_format(problem, FORMATS[name])
    except UnsupportedByFormatError:
        return []
    lifting = held.formulation.lifted
    notes = [f"lifted: {lifting}; the class there is {held.problem_class}"] if lifting else []
    if FORMATS[name].has_constant_column and CanonicalForm(held).constant:
        notes.append("the constant of the objective is the cost of the column that is fixed to 1")
    return notes
