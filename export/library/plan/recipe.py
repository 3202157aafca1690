"""Plan of a library: all instances and entries (an instance in one formulation), with names.

cf_SHORT_nSSS[_sK][_box]              an instance: sketch, size, seed, gauge
cf_SHORT_fSSSS[_box]                  an instance: mesh, number of faces, gauge
instance[_printed]_TOKEN[_tight]      an entry: facet, formulation, windows that a certificate leaves
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Container, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import Any, Final

from ....models.errors import InputError, UnsupportedByFormatError
from ....models.field.field import NORMS, Norm
from ....models.formulations.catalogue import AT_JUMPS, FORMULATIONS
from ....models.formulations.choice import declare, norm_of
from ...formats.registry import FORMATS, problem_in_format
from ...solvers_table import smallest_problem
from .spec import Rung, Sketch, Spec

_LONGEST: Final = 32  # characters of a name before its suffix
_OF_SKETCH: Final = ("kind", "what", "title", "origin", "added")


@dataclass(frozen=True)
class EntryRecipe:
    """Recipe of an entry: instance, formulation, facet, formats, compression; tightened: by a certificate."""

    name: str
    instance: str
    formulation: str
    facet: str
    formats: tuple[str, ...]
    compress: bool
    tightened: bool = False

    @property
    def norm(self) -> Norm | None:
        """The norm whose energy the entry minimises over all jumps; None without one."""
        return norm_minimised(self.formulation, self.facet)

    def reason_to_skip(self, about: dict[str, Any]) -> str:
        """Return why it cannot be made from the document of its instance; empty if it can."""
        if not self.tightened or str(self.norm) in about.get("certificates", {}):
            return ""
        named = f"the norm {self.norm}" if self.norm == "mixed" else f"the {self.norm}-norm"
        return f"{self.instance} has no certificate in {named}; give one of `crossfield prove` with --points"


@dataclass(frozen=True)
class InstanceRecipe:
    """Recipe of an instance with its entries.

    seed: of random sketches. prove: the norms in which to prove its optimum.
    """

    name: str
    sketch: Sketch
    rung: str
    size: int
    seed: int | None
    gauge: str
    prove: tuple[Norm, ...] = ()
    entries: tuple[EntryRecipe, ...] = ()

    def document(self) -> dict[str, Any]:
        """Return everything that determines its content, as JSON."""
        sketch = self.sketch
        stated: dict[str, Any] = {key: getattr(sketch, key) for key in _OF_SKETCH}
        stated["sha256"] = [hashlib.sha256(data).hexdigest() for data in (sketch.drawing, sketch.mask)]
        others = {key: value for key, value in vars(self).items() if key != "entries"}
        return others | {"sketch": stated | sketch.settings()}


def entry_name(instance: str, formulation: str, facet: str, *, tightened: bool = False) -> str:
    """Return the name of an entry."""
    printed = "_printed" if facet == "printed" else ""
    return f"{instance}{printed}_{FORMULATIONS[formulation].short}{'_tight' if tightened else ''}"


def without_skipped(recipes: Iterable[InstanceRecipe], skipped: Container[str]) -> tuple[InstanceRecipe, ...]:
    """Return recipes without the instances and entries that were skipped."""
    return tuple(
        replace(recipe, entries=tuple(entry for entry in recipe.entries if entry.name not in skipped))
        for recipe in recipes
        if recipe.name not in skipped
    )


def plan_library(spec: Spec) -> tuple[InstanceRecipe, ...]:
    """Return every instance of a specification with its entries.

    Raises InputError for a long or double name, and for a formulation that no format of its rung holds.
    """
    recipes = [
        recipe
        for sketch in spec.sketches
        for rung in spec.rungs
        if rung.name in sketch.rungs
        for recipe in _instances(sketch, rung, spec.formulations)
    ]
    longest = max((entry.name for recipe in recipes for entry in recipe.entries), key=len, default="")
    if len(longest) > _LONGEST:
        raise InputError(
            f"the name {longest} has {len(longest)} characters; shorten the sketch's name to reach {_LONGEST}"
        )
    for name, count in Counter(recipe.name for recipe in recipes).items():
        if count > 1:
            raise InputError(f"{name} is on two rungs, and names carry the size alone; keep it on one")
    for entry in (entry for recipe in recipes for entry in recipe.entries):
        if not _fits_a_format(entry.formulation, entry.formats):
            raise InputError(
                f"no format of the rung of {entry.name} holds {entry.formulation}; add nl or gms, or omit it"
            )
    return tuple(recipe for recipe in recipes if recipe.entries)


@cache
def _fits_a_format(formulation: str, formats: tuple[str, ...]) -> bool:
    """Whether a format holds the problems of a formulation."""
    problem = smallest_problem(declare(formulation))
    for file_format in formats:
        with suppress(UnsupportedByFormatError):
            problem_in_format(problem, FORMATS[file_format])
            return True
    return False


@cache
def norm_minimised(formulation: str, facet: str = "hull") -> Norm | None:
    """Return the norm whose energy the entries of a formulation minimise over all jumps; None for others."""
    declared = FORMULATIONS[formulation]
    if declared.minimises == AT_JUMPS:
        return None
    return norm_of(declared, declared.options({"facet": facet} if "facet" in declared.option_names else {}))


def _instances(sketch: Sketch, rung: Rung, formulations: tuple[str, ...]) -> list[InstanceRecipe]:
    minimised = set(map(norm_minimised, formulations)) if sketch.proves(rung) else set()
    # Orthogonal crosses have proofs in the 2-norm alone. Bounds are weak under the gauge `box`.
    norms = tuple(norm for norm in NORMS if norm in minimised and (norm == 2 or not sketch.orthogonal))
    recipes = []
    for size, seed, gauge in product(sketch.sizes_on(rung), sketch.all_seeds, rung.gauges):
        sized = f"f{size:04}" if sketch.orthogonal else f"n{size:03}"
        seeded = "" if seed is None else f"_s{seed}"
        name = f"cf_{sketch.name}_{sized}{seeded}{'_box' if gauge == 'box' else ''}"
        prove = norms if gauge == "strokes" else ()
        recipe = InstanceRecipe(name, sketch, rung.name, size, seed, gauge, prove)
        recipes.append(replace(recipe, entries=_entries(recipe, rung, formulations)))
    return recipes


def _entries(recipe: InstanceRecipe, rung: Rung, formulations: tuple[str, ...]) -> tuple[EntryRecipe, ...]:
    orthogonal = recipe.sketch.orthogonal
    entries = rung.entries(formulations, recipe.gauge, orthogonal=orthogonal)
    chosen = [(name, facet, False) for name, facet in entries]
    if recipe.gauge == "strokes" and not orthogonal:  # certificates with windows are of these
        chosen += [(name, "hull", True) for name in rung.tightened]
    return tuple(
        EntryRecipe(
            entry_name(recipe.name, name, facet, tightened=tightened),
            recipe.name,
            name,
            facet,
            rung.formats,
            rung.compress,
            tightened,
        )
        for name, facet, tightened in chosen
    )


def digest(value: Any) -> str:
    """Return the SHA-256 of a JSON value, independent of the order of its keys."""
    return hashlib.sha256(json.dumps(value, sort_keys=True, ensure_ascii=False).encode()).hexdigest()
