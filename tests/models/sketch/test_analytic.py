"""Analytic instances: their exact fields against finite differences, and the fields of their strokes."""

import crossfield as cf
import numpy as np
import pytest
from angles import line_difference
from crossfield.models.sketch.surfaces import SURFACES, _find_parameters, _frame_patch
from loops import for_each


@for_each("name", SURFACES)
def test_strokes_of_both_families_cover_the_documented_share_and_cost_the_exact_field_nothing(name):
    surface = cf.analytic(name, 24)
    instance = surface.instance
    assert max(instance.mask.shape) == 24
    assert instance.grid.parts == 1
    assert np.degrees(line_difference(surface.u_angle, surface.v_angle).min()) > 30
    assert len(instance.theta) / instance.grid.size == pytest.approx(SURFACES[name].share, abs=0.06)
    assert (instance.w >= 0.1).all()
    on_u, on_v = (
        line_difference(instance.theta, line[instance.stroke_index]) < 1e-12
        for line in (surface.u_angle, surface.v_angle)
    )
    assert (on_u | on_v).all()
    assert 0.1 < on_u.mean() < 0.9
    field = cf.CrossField.from_lines(instance, surface.u_angle, surface.v_angle)
    assert field.energy().strokes < 1e-18
    assert len(field.singularities.row) == 0


def test_rulings_of_the_cylinder_are_parallel():
    surface = cf.analytic("tilted_cylinder", 32)
    assert np.ptp(surface.v_angle) < 1e-12
    assert np.degrees(surface.v_angle[0]) == pytest.approx(110)  # upright, spun by 20 degrees


def test_strokes_on_a_third_of_the_cylinder_determine_the_crosses():
    surface = cf.analytic("tilted_cylinder", 24)
    error = cf.polyvector_field(surface.instance).cross_error(surface.u_angle, surface.v_angle)
    assert np.degrees(np.median(error)) < 5


@for_each("name", SURFACES)
def test_lines_are_curvature_lines_the_normals_belong_to_them_and_the_heights_to_both(name):
    """Tangents at right angles, and normals that turn along each line as the line goes: dN is along dp."""
    patch, surface = cf.analytic(name, 20), SURFACES[name]
    s, t, _ = _find_parameters(surface, _frame_patch(surface, 20))
    tangents, h = surface.tangents(s, t), 1e-5
    assert np.abs((tangents[0] * tangents[1]).sum(axis=1)).max() < 1e-9
    for tangent, ds, dt, angle in zip(tangents, (h, 0), (0, h), (patch.u_angle, patch.v_angle), strict=True):
        change = (surface.point(s + ds, t + dt) - surface.point(s - ds, t - dt)) / (2 * h)
        np.testing.assert_allclose(tangent, change, atol=1e-7)
        assert line_difference(np.arctan2(tangent[:, 1], tangent[:, 0]), angle).max() < 1e-12

    def normal(s, t):
        across = np.cross(*surface.tangents(s, t))
        return across / (np.linalg.norm(across, axis=1) * np.sign(across[:, 2]))[:, None]

    np.testing.assert_allclose(patch.normals, normal(s, t), atol=1e-12)
    for tangent, ds, dt in zip(tangents, (h, 0), (0, h), strict=True):
        turn = (normal(s + ds, t + dt) - normal(s - ds, t - dt)) / (2 * h)
        assert np.linalg.norm(np.cross(turn, tangent), axis=1).max() < 1e-8
    grid = patch.instance.grid
    rise = patch.heights[grid.second] - patch.heights[grid.first]
    slopes = -patch.normals[:, :2] / patch.normals[:, 2:]
    expected = (slopes[grid.first] + slopes[grid.second])[np.arange(len(rise)), grid.upward.astype(int)] / 2
    assert np.median(np.abs(rise - expected)) < 0.02
