"""The energy of heights: as written, pixel by pixel; its slope by differences; and the way down."""

import itertools

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.instance.least_squares import Residuals
from crossfield.models.processes.deadline import never
from crossfield.models.surface.equations import CONJUGACY, Equations, Weights, descend
from crossfield.models.surface.stencils import Crosses, GridLevel, Stencils, levels_of
from loops import for_each
from scipy import sparse

pytestmark = pytest.mark.numeric

WEIGHTS = Weights(even=1e-3, facing=1e-2, forgiven=0.1)


def equations(weights=WEIGHTS, extra=()):
    """Those of a constant skew cross on a mask with a hole and a tail, and heights at random."""
    mask = np.ones((4, 5), dtype=bool)
    mask[1, 1] = mask[0, 3:] = mask[3, :3] = False
    instance = cf.Instance.on_pixels("bit", mask, np.argwhere(mask)[:1], np.zeros(1), np.ones(1))
    size = instance.grid.size
    field = cf.CrossField.from_lines(instance, np.full(size, 0.2), np.full(size, 1.4))
    stencils = Stencils(instance.grid)
    system = Equations(stencils, Crosses.of(field), weights, extra)
    return system, np.random.default_rng(1).normal(size=stencils.count)


def by_pixels(mask, z, weights):
    """The energy in plain loops, for lines at 0.2 and 1.4."""
    u, v = ((np.cos(a), np.sin(a)) for a in (0.2, 1.4))
    n, total, slope, normal = mask.sum(), 0.0, {}, {}
    for r, c in np.argwhere(mask):
        a, b, d, e = z[r, c], z[r, c + 1], z[r + 1, c], z[r + 1, c + 1]
        x, y = (b + e - a - d) / 2, (a + b - d - e) / 2
        slope[r, c], normal[r, c] = np.array([x, y]), np.array([-x, -y, 1]) / np.sqrt(1 + x * x + y * y)
        first, second = u @ slope[r, c], v @ slope[r, c]
        cosine = (np.dot(u, v) + first * second) / np.sqrt((1 + first**2) * (1 + second**2))
        total += weights.forgiven**2 * np.log(1 + (cosine / weights.forgiven) ** 2)
        total += weights.facing * np.log(1 + x * x + y * y) + weights.even * n / 10 * (b + d - a - e) ** 2
    for (r, c), here in normal.items():
        for there in ((r - 1, c), (r, c + 1)):
            if there in normal:
                total += weights.even * n * np.sum((here - normal[there]) ** 2)
        block = [(r, c), (r, c + 1), (r + 1, c), (r + 1, c + 1)]
        if all(corner in slope for corner in block):
            a, b, d, e = (slope[corner] for corner in block)
            by_x, by_y = (b + e - a - d) / 2, (a + b - d - e) / 2
            for line, other in ((u, v), (v, u)):
                total += CONJUGACY * n / 2 * np.dot(line, other[0] * by_x + other[1] * by_y) ** 2
    return total


def test_the_energy_is_as_written():
    system, z = equations()
    picture = np.full(system.stencils.used.shape, np.nan)
    picture[system.stencils.used] = z
    assert system.energy(z) == pytest.approx(
        by_pixels(system.stencils.grid.mask, picture, WEIGHTS), rel=1e-12
    )


@for_each("forgiven", [0.1, np.inf])
def test_the_slope_is_that_of_the_energy_and_the_curvature_is_never_negative(forgiven):
    goal = Residuals(sparse.csr_array(np.ones((1, 25))), -np.ones(1), np.ones(1))
    system, z = equations(Weights(1e-3, 1e-2, forgiven), [goal])
    slope, curvature = system.model(z)
    steps = 1e-6 * np.eye(len(z))
    differences = [(system.energy(z + step) - system.energy(z - step)) / 2e-6 for step in steps]
    assert 2 * slope == pytest.approx(np.array(differences), abs=1e-6)
    dense = curvature.toarray()
    assert dense == pytest.approx(dense.T)
    assert np.linalg.eigvalsh(dense).min() > -1e-12


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


def test_a_plane_stays_a_plane_on_finer_levels():
    mask = np.ones((33, 30), dtype=bool)
    mask[:9, :13] = False
    grid = cf.Instance.on_pixels("bit", mask, np.argwhere(mask)[:1], np.zeros(1), np.ones(1)).grid
    cross = np.full(grid.size, 1.0 + 0j)
    levels = levels_of(GridLevel(Stencils(grid), Crosses(-cross, 0 * cross)))
    assert [level.halved for level in levels] == [1, 0]
    assert all((level.crosses.product == -1).all() for level in levels)
    for coarse, fine in itertools.pairwise(levels):
        planes = []
        for level in (coarse, fine):
            row, column = np.nonzero(level.stencils.used)
            planes.append((0.3 * row - 0.2 * column) * 1.0)
        assert fine.interpolate(coarse, planes[0]) == pytest.approx(planes[1])
