"""Plan of a library: all instances and entries (an instance in one formulation), with names.

cf_SHORT_nSSS[_sK][_box]              an instance: sketch, size, seed, gauge
cf_SHORT_fSSSS[_box]                  an instance: mesh, number of faces, gauge
instance[_printed]_TOKEN[_tight]      an entry: facet, formulation, windows that a certificate leaves
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Container, Iterable
from dataclasses import asdict, dataclass, fields, replace
from functools import cache
from typing import Any, Final

from ....models.errors import InputError
from ....models.field.field import Norm
from ....models.formulations.catalogue import AT_JUMPS, FORMULATIONS, norm_of
from .spec import Rung, Sketch, Spec

LONGEST: Final = 32  # characters of a name before its suffix
NORMS: Final[tuple[Norm, ...]] = (2, 1, "mixed")


@dataclass(frozen=True)
class InstanceRecipe:
    """Recipe of an instance. seed: of random sketches; prove: the norms in which to prove its optimum.

    added: the day of its addition to the library; empty if not stated.
    """

    name: str
    sketch: Sketch
    rung: str
    size: int
    seed: int | None
    gauge: str
    prove: tuple[Norm, ...] = ()
    added: str = ""

    def document(self) -> dict[str, Any]:
        """Return everything that determines its content, as JSON."""
        hashes = [hashlib.sha256(data).hexdigest() for data in (self.sketch.drawing, self.sketch.mask)]
        sketch = {
            "kind": self.sketch.kind,
            "what": self.sketch.what,
            "title": self.sketch.title,
            "sha256": hashes,
            "origin": self.sketch.origin.document(),
            **self.sketch.settings(),
        }
        return {field.name: getattr(self, field.name) for field in fields(self)} | {"sketch": sketch}


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

    def document(self) -> dict[str, Any]:
        """Return everything that determines its files, beyond its instance, as JSON."""
        return {key: value for key, value in asdict(self).items() if (key, value) != ("tightened", False)}

    def reason_to_skip(self, about: dict[str, Any]) -> str:
        """Return why it cannot be made from the document of its instance; empty if it can."""
        if not self.tightened or str(self.norm) in about.get("certificates", {}):
            return ""
        named = f"the norm {self.norm}" if self.norm == "mixed" else f"the {self.norm}-norm"
        return f"{self.instance} has no certificate in {named}; give one of `crossfield prove` with --points"


@dataclass(frozen=True)
class InstancePlan:
    """An instance and its entries, in order."""

    recipe: InstanceRecipe
    entries: tuple[EntryRecipe, ...]


def entry_name(instance: str, formulation: str, facet: str, *, tightened: bool = False) -> str:
    """Return the name of an entry."""
    printed = "_printed" if facet == "printed" else ""
    return f"{instance}{printed}_{FORMULATIONS[formulation].short}{'_tight' if tightened else ''}"


def without_skipped(plans: Iterable[InstancePlan], skipped: Container[str]) -> tuple[InstancePlan, ...]:
    """Return plans without the instances and entries that were skipped."""
    return tuple(
        replace(planned, entries=tuple(entry for entry in planned.entries if entry.name not in skipped))
        for planned in plans
        if planned.recipe.name not in skipped
    )


def plan_library(spec: Spec) -> tuple[InstancePlan, ...]:
    """Return every instance of a specification with its entries. Raises InputError for a long name."""
    plans = tuple(
        InstancePlan(recipe, _entries(recipe, rung, spec.formulations))
        for sketch in spec.sketches
        for rung in spec.rungs
        if rung.name in sketch.rungs
        for recipe in _instances(sketch, rung, norms_of(spec.formulations) if sketch.proves(rung) else ())
    )
    for name in (entry.name for planned in plans for entry in planned.entries):
        if len(name) > LONGEST:
            raise InputError(
                f"the name {name} has {len(name)} characters; shorten the sketch's name to reach {LONGEST}"
            )
    return plans


@cache
def norm_minimised(formulation: str, facet: str = "hull") -> Norm | None:
    """Return the norm whose energy the entries of a formulation minimise over all jumps; None for others."""
    declared = FORMULATIONS[formulation]
    if declared.minimises == AT_JUMPS:
        return None
    return norm_of(declared, declared.options({"facet": facet} if "facet" in declared.option_names else {}))


def norms_of(formulations: Iterable[str]) -> tuple[Norm, ...]:
    """Return the norms whose energies formulations minimise over all jumps."""
    minimised = set(map(norm_minimised, formulations))
    return tuple(norm for norm in NORMS if norm in minimised)


def _instances(sketch: Sketch, rung: Rung, norms: tuple[Norm, ...]) -> list[InstanceRecipe]:
    return [
        InstanceRecipe(
            _instance_name(sketch, size, seed, gauge),
            sketch,
            rung.name,
            size,
            seed,
            gauge,
            # Bounds are weak under the gauge `box`. Orthogonal crosses have proofs in the 2-norm alone.
            prove=tuple(
                norm for norm in norms if gauge == "strokes" and (norm == 2 or not sketch.orthogonal)
            ),
            added=max(sketch.added, rung.added),
        )
        for size in sketch.sizes_on(rung)
        for seed in sketch.seeds
        for gauge in rung.gauges
    ]


def _instance_name(sketch: Sketch, size: int, seed: int | None, gauge: str) -> str:
    sized = f"f{size:04}" if sketch.kind == "mesh" else f"n{size:03}"
    seeded = "" if seed is None else f"_s{seed}"
    return f"cf_{sketch.name}_{sized}{seeded}{'_box' if gauge == 'box' else ''}"


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
