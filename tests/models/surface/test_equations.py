"""The way down the energy of heights."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.processes.deadline import never
from crossfield.models.surface.equations import Equations, Weights, descend
from crossfield.models.surface.stencils import Crosses, Stencils


def equations():
    """Those of a constant skew cross on a mask with a hole and a tail, and heights at random."""
    mask = np.ones((4, 5), dtype=bool)
    mask[1, 1] = mask[0, 3:] = mask[3, :3] = False
    instance = cf.Instance.on_pixels("bit", mask, np.argwhere(mask)[:1], np.zeros(1), np.ones(1))
    size = instance.grid.size
    field = cf.CrossField.from_lines(instance, np.full(size, 0.2), np.full(size, 1.4))
    stencils = Stencils(instance.grid)
    system = Equations(stencils, Crosses.of(field), Weights(even=1e-3, facing=1e-2, forgiven=0.1))
    return system, np.random.default_rng(1).normal(size=stencils.count)


def test_the_way_down_ends_where_the_slope_does_and_time_cuts_it_short():
    system, z = equations()
    energies = []
    for most in (0, 1, 3, 1000):
        left = iter(range(most))
        energy, low = descend(system, z, lambda left=left: next(left, None) is None)
        assert energy == system.energy(low)
        energies.append(energy)
    assert energies[0] == system.energy(z)
    assert energies == sorted(energies, reverse=True)
    again, _ = descend(system, low, never)
    assert again == pytest.approx(energies[-1], rel=1e-2)
    assert again <= energies[-1]
