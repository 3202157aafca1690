"""The approximate inverse of large systems."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.smooth import polyvector, two_levels


@pytest.mark.parametrize("name", ["mouse", "bottle"])
def test_two_levels_find_the_fields_that_factors_find(name, monkeypatch):
    instance = cf.sample(name, 64)
    fields = []
    for few in (0, instance.grid.size):
        monkeypatch.setattr(polyvector, "FEW", few)
        monkeypatch.setattr(two_levels, "FEW", few)
        start = cf.polyvector_field(instance, hold=100.0)
        fields.append((start, cf.bend_field(start)))
    (start, bend), (exact_start, exact_bend) = fields
    assert np.array_equal(start.p, exact_start.p)
    assert start.cross_error(exact_start.u_angle, exact_start.v_angle) == pytest.approx(0, abs=1e-6)
    assert bend.energy(2).total == pytest.approx(exact_bend.energy(2).total, rel=2e-3)
