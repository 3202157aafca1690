"""The energy of orthogonal crosses against its definition, and what a step of one integer changes."""

import numpy as np
import pytest
from cases import make_instance
from crossfield.models.orthogonal.energy import OrthogonalEnergy, field_of, integers_of, lowered
from meshes import box, icosahedron, on_edges, tetrahedron, torus

MESHES = {
    "tetrahedron": lambda: on_edges(tetrahedron(), sharp=9),
    "cube": lambda: on_edges(box(2)),
    "torus": lambda: on_edges(torus(6, 4), sharp=9),
    "weights": lambda: on_edges(box(2), pair_weights=box(2).dual_weights),
}


@pytest.fixture(params=MESHES)
def case(request):
    instance = MESHES[request.param]()
    energy = OrthogonalEnergy.of(instance)
    z = np.random.default_rng(0).integers(-2, 3, len(energy.first)).astype(np.int32)
    return instance, energy, z


def test_gains_and_residuals_are_those_of_solving_again(case):
    _, energy, z = case
    residual = energy.residuals(energy.fit_angles(z), z)
    gains = energy.gains(residual)
    for row in range(0, len(z), 3):
        changes = []
        for step in (1, -1):
            moved = z.copy()
            moved[row] += step
            again = energy.residuals(energy.fit_angles(moved), moved)
            changes.append(energy.total(again) - energy.total(residual))
            stepped = energy.step_residuals(residual, np.array([row]), np.array([step]))
            np.testing.assert_allclose(stepped, again, atol=1e-9)
        assert min(changes) == pytest.approx(gains[row], abs=1e-8)


def test_the_best_angles_have_no_slope(case):
    _, energy, z = case
    alpha = energy.fit_angles(z)
    np.testing.assert_allclose(
        energy.matrix @ alpha + energy.constant + z * np.pi / 2, energy.residuals(alpha, z), atol=1e-9
    )
    np.testing.assert_allclose(energy.matrix.T @ (energy.weight * energy.residuals(alpha, z)), 0.0, atol=1e-9)


def test_a_field_has_the_energy_of_its_integers(case):
    instance, energy, _ = case
    z = energy.descend(energy.nearest(np.zeros(energy.size)))
    residual = energy.residuals(energy.fit_angles(z), z)
    field = field_of(instance, z, energy)
    assert field.energy().total == pytest.approx(energy.total(residual), abs=1e-9)
    assert not field.beta.any()
    of_field = integers_of(field)
    assert energy.total(energy.residuals(field.alpha, of_field)) == pytest.approx(field.energy().total)


def test_descent_never_raises_the_energy_and_ends_where_no_step_gains(case):
    _, energy, z = case
    before = energy.residuals(energy.fit_angles(z), z)
    low = energy.descend(z)
    residual = energy.residuals(energy.fit_angles(low), low)
    assert energy.total(residual) <= energy.total(before)
    total = energy.total(residual)
    assert total + energy.gains(residual).min() >= lowered(total, 2e-9)


def test_parts_without_strokes_are_pinned():
    instance = on_edges(icosahedron(), sharp=9)
    assert OrthogonalEnergy.of(instance).pins.tolist() == [0]
    with_strokes = on_edges(box(1))
    assert not len(OrthogonalEnergy.of(with_strokes).pins)
    weightless = on_edges(box(1), stroke_coefficient=0.0)
    assert OrthogonalEnergy.of(weightless).pins.tolist() == [0]


def test_pixels_have_the_same_energy():
    instance = make_instance(orthogonal=True)
    energy = OrthogonalEnergy.of(instance)
    z = energy.descend(energy.nearest(np.zeros(energy.size)))
    residual = energy.residuals(energy.fit_angles(z), z)
    assert field_of(instance, z, energy).energy().total == pytest.approx(energy.total(residual), abs=1e-9)
