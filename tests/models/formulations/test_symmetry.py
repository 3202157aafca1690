"""Turning or mirroring a sketch does not change its optimum under the gauge `strokes`; every sample,
solved to optimality.
"""

from __future__ import annotations

import crossfield as cf
import pytest
from crossfield.models.sketch.samples import SAMPLES

pytestmark = pytest.mark.numeric


def smallest(name):
    """The sample on the coarsest grid that still shows three stroke pixels:
    small enough to be solved to optimality.
    """
    for size in range(5, 24):
        try:
            instance = cf.sample(name, size, stroke_weight=0.2)  # some 1 on these grids, as in the paper
        except cf.CrossfieldError:  # the outline leaves no room on so coarse a grid
            continue
        if len(instance.theta) >= 3:
            return instance
    raise AssertionError(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", SAMPLES)
def test_optimum_is_the_same_after_quarter_turn_and_mirror(name):
    instance = smallest(name)
    found = [
        cf.solve(
            cf.formulate(moved, "milp-mccormick"),
            "highs",
            limits=cf.Limits(250),
            start=cf.greedy_field(moved),
        )
        for moved in (instance, instance.turned(), instance.mirrored())
    ]
    assert all(solution.status == "optimal-global" for solution in found)
    assert max(s.objective for s in found) - min(s.objective for s in found) <= 1e-5 * max(
        1.0, found[0].objective
    )
