"""Analytic instances: their exact fields against finite differences, and the fields of their strokes."""

import numpy as np
import pytest
from crossfield.models.errors import InputError
from crossfield.models.field.field import CrossField
from crossfield.models.instance.angles import line_difference
from crossfield.models.sketch.cover import LEAST_WEIGHT
from crossfield.models.sketch.surfaces import SURFACES, _find_parameters, _frame_patch, analytic
from crossfield.models.smooth.polyvector import polyvector_field

pytestmark = pytest.mark.numeric

NAMES = sorted(SURFACES)


@pytest.mark.parametrize("name", NAMES)
def test_every_patch_faces_the_viewer_and_its_lines_stay_apart(name):
    surface = SURFACES[name]
    s, t = (
        axis.ravel()
        for axis in np.meshgrid(np.linspace(*surface.s_range, 60), np.linspace(*surface.t_range, 60))
    )
    normal = np.cross(*surface.tangents(s, t))
    assert np.abs((np.sign(normal[:, 2])).sum()) == len(s)  # one sign: the projection does not fold
    patch = analytic(name, 48)
    assert np.degrees(line_difference(patch.u_angle, patch.v_angle).min()) > 30


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("size", [24, 48])
def test_strokes_of_both_families_cover_the_documented_share(name, size):
    surface = analytic(name, size)
    instance = surface.instance
    assert max(instance.mask.shape) == size
    assert instance.grid.parts == 1
    assert len(instance.theta) / instance.grid.size == pytest.approx(SURFACES[name].share, abs=0.06)
    assert (instance.w >= LEAST_WEIGHT).all()
    at = instance.stroke_index
    on_u = line_difference(instance.theta, surface.u_angle[at]) < 1e-12
    on_v = line_difference(instance.theta, surface.v_angle[at]) < 1e-12
    assert (on_u | on_v).all()
    assert 0.1 < on_u.mean() < 0.9


def test_rulings_of_the_cylinder_are_parallel():
    surface = analytic("tilted_cylinder", 32)
    assert np.ptp(surface.v_angle) < 1e-12
    assert np.degrees(surface.v_angle[0]) == pytest.approx(110)  # upright, spun by 20 degrees


@pytest.mark.parametrize("name", NAMES)
def test_the_exact_field_is_regular_and_explains_every_stroke(name):
    surface = analytic(name, 32)
    field = CrossField.from_lines(surface.instance, surface.u_angle, surface.v_angle)
    assert field.cross_error(surface.u_angle, surface.v_angle).max() < 1e-9
    assert field.energy().strokes < 1e-18
    assert len(field.singularities.row) == 0


@pytest.mark.parametrize("size", [24, 48])
def test_strokes_on_a_third_of_the_cylinder_determine_the_crosses(size):
    surface = analytic("tilted_cylinder", size)
    error = np.degrees(polyvector_field(surface.instance).cross_error(surface.u_angle, surface.v_angle))
    assert np.median(error) < 5


def test_names_and_sizes_that_do_not_exist_are_refused():
    with pytest.raises(
        InputError, match="no surface 'sphere'; choose one of tilted_cylinder, torus_patch, wave_sheet"
    ):
        analytic("sphere")


@pytest.mark.parametrize("name", NAMES)
def test_lines_are_curvature_lines_the_normals_belong_to_them_and_the_heights_to_both(name):
    """Tangents at right angles, and normals that turn along each line as the line goes: dN is along dp."""
    patch, surface = analytic(name, 20), SURFACES[name]
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
