"""Fields of an instance, by the work that its sketch asks for: from none to a proof."""

from __future__ import annotations

import numpy as np

from ....models.field.field import CrossField
from ....models.instance.instance import HALF, Instance
from ....models.search.greedy import greedy_field
from ....models.search.nearest_stroke import nearest_strokes
from ....models.search.pinned import pinned
from ..ledger.given import Given
from ..ledger.points import Certified, Known, better_in_1norm, certified, ours, searched_field
from ..plan.recipe import InstanceRecipe

Found = tuple[Known, list[Known], Certified | None]
"""The baseline, fields of low energy, and a certificate."""


def found_fields(instance: Instance, recipe: InstanceRecipe, sent: Certified | None) -> Found:
    """Return the fields that the sketch of a recipe asks for. sent: a certificate that replaces a proof."""
    effort = recipe.sketch.points
    if effort == "none":
        nearest = _nearest(instance)
        return nearest, [nearest], None
    baseline = Known(pinned(greedy_field(instance)), ours("greedy"))
    if effort == "greedy":
        return baseline, [baseline], None
    if effort == "proven":
        low, proven = _proof(baseline, recipe, sent)
        return baseline, [baseline, *low], proven
    searched = searched_field(instance)
    low, proven = _proof(searched, recipe, sent)
    found = better_in_1norm(searched.field, recipe.rung)
    staged = [Known(pinned(each.field), ours("two stages")) for each in found]
    return baseline, [searched, *low, *found, *staged], proven


def given_fields(given: Given, instance: Instance, recipe: InstanceRecipe) -> Found:
    """Return the given points, without any search; a certificate is checked."""
    low = [given.field("least_2"), given.field("least_1")]
    return given.field("baseline"), low, given.certificate(instance) if recipe.prove else None


def _nearest(instance: Instance) -> Known:
    """Right-angled crosses along the nearest stroke, or along the first one in a part without strokes."""
    theta = instance.theta[np.maximum(nearest_strokes(instance), 0)]
    return Known(CrossField.from_lines(instance, theta, theta + HALF), ours("nearest stroke"))


def _proof(
    start: Known, recipe: InstanceRecipe, sent: Certified | None
) -> tuple[list[Known], Certified | None]:
    """The field and the certificate of a proof, if the recipe asks for one and none was submitted."""
    if not recipe.prove or sent is not None:
        return [], None
    found, proven = certified(start.field, f"{recipe.name}.certificate.npz")
    return [found], proven
