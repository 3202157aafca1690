"""Relations between entries (docs/mathematics.md, 5 to 7), and changes that files make."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Final

from ....models.errors import UnsupportedByFormatError
from ....models.formulations.catalogue import AT_JUMPS, FORMULATIONS, TWO_NORM
from ....models.formulations.problem import Problem
from ...formats.registry import FORMATS, carried
from ...writing.canonical import Canonical
from .recipe import EntryRecipe, entry_name

_FACETS: Final = {
    "hull": "the facet of the hull, z >= -(pi/4) p1: z = p1 beta_i there, and its optimum is at least as "
    "high as this one",
    "printed": "(26) as printed, z >= -pi/4, leaves z free where p1 = 0: a relaxation, whose optimum may be "
    "lower",
}


def equivalent(recipe: EntryRecipe, names: Collection[str]) -> list[dict[str, Any]]:
    """Return the formulations with the same optimum, and the reasons. names: entries of the library."""
    if recipe.facet == "printed":
        return []
    return [
        _relation(
            recipe,
            other,
            names,
            f"both minimise {declared.minimises}; {declared.how}; "
            "points transfer by alpha, beta and the jumps",
        )
        for other, declared in FORMULATIONS.items()
        if other != recipe.formulation and declared.minimises == FORMULATIONS[recipe.formulation].minimises
    ]


def not_equivalent(recipe: EntryRecipe, names: Collection[str]) -> list[dict[str, Any]]:
    """Return the formulations of the instance with another optimum, and the difference."""
    mine = FORMULATIONS[recipe.formulation].minimises
    found = [
        _relation(recipe, other, names, _difference(recipe, other))
        for other, declared in FORMULATIONS.items()
        if declared.minimises != mine
    ]
    if "facet" in FORMULATIONS[recipe.formulation].settable:
        facet = "hull" if recipe.facet == "printed" else "printed"
        found.append(_relation(recipe, recipe.formulation, names, _FACETS[facet], facet))
    return found + _other_gauge(recipe, names)


def _relation(
    recipe: EntryRecipe, formulation: str, names: Collection[str], why: str, facet: str = ""
) -> dict[str, Any]:
    name = entry_name(recipe.instance, formulation, facet or "hull")
    shown = f"{formulation} (facet {facet})" if facet else formulation
    return {"formulation": shown, "entry": name if name in names else None, "why": why}


def _difference(recipe: EntryRecipe, other: str) -> str:
    mine, theirs = FORMULATIONS[recipe.formulation].minimises, FORMULATIONS[other].minimises
    if theirs == AT_JUMPS and mine == TWO_NORM:
        return "its jumps are fixed: its optimum is an upper bound of this one"
    if mine == AT_JUMPS and theirs == TWO_NORM:
        return "its jumps are free: its optimum is a lower bound of this one"
    return f"it minimises {theirs}, this one {mine}: points transfer, optima differ"


def _other_gauge(recipe: EntryRecipe, names: Collection[str]) -> list[dict[str, Any]]:
    """The same entry under the other gauge, when the library has it."""
    box = recipe.instance.endswith("_box")
    instance = recipe.instance.removesuffix("_box") if box else f"{recipe.instance}_box"
    name = entry_name(instance, recipe.formulation, recipe.facet)
    if name not in names:
        return []
    windows = (
        "a window of alpha round each stroke, which loses nothing"
        if box
        else "alpha in [0, pi/2] everywhere, as printed in (1), which forces skews"
    )
    shown = f"{recipe.formulation} (gauge {'strokes' if box else 'box'})"
    return [{"formulation": shown, "entry": name, "why": f"the other gauge: {windows}; optima differ"}]


def notes_of(problem: Problem, name: str) -> list[str]:
    """Return the changes that the file of a format makes; empty if it refuses the problem."""
    try:
        held = carried(problem, FORMATS[name])
    except UnsupportedByFormatError:
        return []
    lifting = held.formulation.lifted
    found = [f"lifted: {lifting}; the class there is {held.problem_class}"] if lifting else []
    if name in {"lp", "mps"} and Canonical(held).has_one:
        found.append("the constant of the objective is the cost of a column ONE that is fixed to 1")
    return found
