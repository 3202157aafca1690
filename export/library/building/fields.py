"""Fields of an instance, by the work that its sketch asks for: from none to a proof."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....models.field.field import CrossField
from ....models.instance.angles import HALF
from ....models.instance.instance import Instance
from ....models.search.greedy import greedy_field
from ....models.search.nearest_stroke import nearest_strokes
from ....models.search.reproducible_angles import reproducible_field
from ..ledger.given import Given
from ..ledger.points import (
    Certified,
    Known,
    better_in_1norm,
    certificate_file,
    certified,
    ours,
    searched_field,
)
from ..plan.recipe import NORMS, InstanceRecipe

Found = tuple[Known, list[Known], list[Certified]]
"""The baseline, fields of low energy, and certificates."""


def found_fields(instance: Instance, recipe: InstanceRecipe, sent: Sequence[Certified]) -> Found:
    """Return the fields that the sketch of a recipe asks for. sent: certificates that replace proofs."""
    effort = recipe.sketch.points
    if effort == "none":
        nearest = _nearest(instance)
        return nearest, [nearest], []
    baseline = Known(reproducible_field(greedy_field(instance)), ours("greedy"))
    if effort == "greedy":
        return baseline, [baseline], []
    if effort == "proven":
        low, proven = _proof(baseline, recipe, sent)
        return baseline, [baseline, *low], proven
    searched = searched_field(instance)
    low, proven = _proof(searched, recipe, sent)
    found = better_in_1norm(searched.field, recipe.rung)
    staged = [Known(reproducible_field(each.field), ours("two stages")) for each in found]
    return baseline, [searched, *low, *found, *staged], proven


def given_fields(given: Given, instance: Instance, recipe: InstanceRecipe) -> Found:
    """Return the given points, without any search; a certificate is checked."""
    low = [given.field(f"least_{norm}") for norm in NORMS]
    return given.field("baseline"), low, given.certificates(instance, recipe.prove)


def _nearest(instance: Instance) -> Known:
    """Right-angled crosses along the nearest stroke, or along the first one in a part without strokes."""
    theta = instance.theta[np.maximum(nearest_strokes(instance), 0)]
    return Known(CrossField.from_lines(instance, theta, theta + HALF), ours("nearest stroke"))


def _proof(
    start: Known, recipe: InstanceRecipe, sent: Sequence[Certified]
) -> tuple[list[Known], list[Certified]]:
    """The fields and certificates of proofs in the norms of the recipe that no submitted one is in."""
    norms = [norm for norm in recipe.prove if norm not in {each.norm for each in sent}]
    found = [certified(start.field, certificate_file(recipe.name, norm), norm) for norm in norms]
    return [known for known, _ in found], [each for _, each in found if each is not None]
