"""Analytic instances: their exact fields against finite differences,
and how well the strokes determine them.
"""

import numpy as np
import pytest
from crossfield.models.errors import InputError
from crossfield.models.field.field import CrossField
from crossfield.models.field.jumps import best_jumps
from crossfield.models.instance.angles import line_difference
from crossfield.models.sketch.read import LEAST_WEIGHT
from crossfield.models.sketch.surfaces import SURFACES, _frame, _parameters, analytic
from scipy import ndimage
from scipy.sparse import coo_matrix, vstack
from scipy.sparse.linalg import spsolve

pytestmark = pytest.mark.numeric

NAMES = sorted(SURFACES)


def principal_directions(surface, s, t, h=1e-4):
    """Projected principal directions by central differences of the position alone: (n, 2) angles,
    and (n, 2) curvatures.
    """

    def at(ds, dt):
        return surface.point(s + ds * h, t + dt * h)

    p_s, p_t = (at(1, 0) - at(-1, 0)) / (2 * h), (at(0, 1) - at(0, -1)) / (2 * h)
    p_ss, p_tt = ((at(a, b) - 2 * at(0, 0) + at(-a, -b)) / h**2 for a, b in ((1, 0), (0, 1)))
    p_st = (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / (4 * h**2)
    normal = np.cross(p_s, p_t)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    first = np.stack([[(a * b).sum(-1) for b in (p_s, p_t)] for a in (p_s, p_t)]).transpose(2, 0, 1)
    second = np.stack(
        [[(a * normal).sum(-1) for a in row] for row in ((p_ss, p_st), (p_st, p_tt))]
    ).transpose(2, 0, 1)
    # The shape operator is not symmetric, but similar to a symmetric matrix: with first = L L', it is
    # L'^-1 (L^-1 second L'^-1) L'.
    inverse = np.linalg.inv(np.linalg.cholesky(first))
    curvature, vector = np.linalg.eigh(inverse @ second @ inverse.swapaxes(1, 2))
    vector = inverse.swapaxes(1, 2) @ vector
    space = vector[:, 0, :, None] * p_s[:, None] + vector[:, 1, :, None] * p_t[:, None]
    return np.arctan2(space[..., 1], space[..., 0]), curvature


@pytest.mark.parametrize("name", NAMES)
def test_the_exact_angles_are_the_eigenvectors_of_the_shape_operator(name):
    made = analytic(name, 20)
    surface = SURFACES[name]
    s, t, mask = _parameters(surface, _frame(surface, 20))
    assert (mask == made.instance.mask).all()
    angles, curvature = principal_directions(surface, s, t)
    apart = np.abs(curvature[:, 0] - curvature[:, 1]) > 0.05  # near flat points every direction is principal
    assert apart.mean() > 0.8
    straight = line_difference(angles[:, 0], made.u_angle) + line_difference(angles[:, 1], made.v_angle)
    crossed = line_difference(angles[:, 1], made.u_angle) + line_difference(angles[:, 0], made.v_angle)
    assert np.minimum(straight, crossed)[apart].max() < 1e-4


@pytest.mark.parametrize("name", NAMES)
def test_parameters_project_to_pixel_centres(name):
    surface = SURFACES[name]
    frame = _frame(surface, 24)
    s, t, mask = _parameters(surface, frame)
    row, column = np.nonzero(mask)
    x, y, _ = surface.point(s, t).T
    np.testing.assert_allclose(x, frame.x + frame.pixel * (column + 0.5), atol=1e-8)
    np.testing.assert_allclose(-y, frame.y + frame.pixel * (row + 0.5), atol=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_every_patch_faces_the_viewer_and_its_lines_stay_apart(name):
    surface = SURFACES[name]
    s, t = (
        axis.ravel()
        for axis in np.meshgrid(np.linspace(*surface.s_range, 60), np.linspace(*surface.t_range, 60))
    )
    normal = np.cross(*surface.tangents(s, t))
    assert np.abs((np.sign(normal[:, 2])).sum()) == len(s)  # one sign: the projection does not fold
    made = analytic(name, 48)
    assert np.degrees(line_difference(made.u_angle, made.v_angle).min()) > 30


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("size", [24, 48])
def test_strokes_of_both_families_cover_the_documented_share(name, size):
    made = analytic(name, size)
    instance = made.instance
    assert max(instance.mask.shape) == size
    assert instance.grid.parts == 1
    assert len(instance.theta) / instance.grid.size == pytest.approx(SURFACES[name].share, abs=0.06)
    assert (instance.w >= LEAST_WEIGHT).all()
    at = instance.stroke_index
    on_u = line_difference(instance.theta, made.u_angle[at]) < 1e-12
    on_v = line_difference(instance.theta, made.v_angle[at]) < 1e-12
    assert (on_u | on_v).all()
    assert 0.1 < on_u.mean() < 0.9


def test_rulings_of_the_cylinder_are_parallel_and_its_circles_are_ellipses():
    made = analytic("tilted_cylinder", 32)
    assert np.ptp(made.v_angle) < 1e-12
    assert np.degrees(made.v_angle[0]) == pytest.approx(110)  # upright, spun by 20 degrees
    # Where the cylinder faces the viewer sideways the circle is seen at its full slope: tangent (-sin s,
    # sin(tilt) cos s).
    surface = SURFACES["tilted_cylinder"]
    s, _, _ = _parameters(surface, _frame(surface, 32))
    slope = np.radians(20) + np.arctan2(np.sin(np.radians(35)) * np.cos(s), -np.sin(s))
    assert line_difference(slope, made.u_angle).max() < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_the_exact_field_is_regular_and_explains_every_stroke(name):
    made = analytic(name, 32)
    field = exact_field(made)
    assert field.cross_error(made.u_angle, made.v_angle).max() < 1e-9
    assert field.energy().strokes < 1e-18
    assert len(field.singularities.row) == 0


def exact_field(made):
    """The exact crosses in the gauge of the instance, u on the stroke."""
    instance = made.instance
    u, v = made.u_angle.copy(), made.v_angle.copy()
    swap = np.zeros(len(u), dtype=bool)
    swap[instance.stroke_index] = line_difference(instance.theta, u[instance.stroke_index]) > 1e-9
    u[swap], v[swap] = v[swap], u[swap]
    middle = u + np.mod(v - u, np.pi) / 2 - np.pi / 4  # alpha; the bisector of u and v is at alpha + pi/4
    skew = np.pi / 4 - np.mod(v - u, np.pi) / 2
    steps = np.round((instance.alpha_lower + np.pi / 4 - middle) / (np.pi / 2)).astype(int)
    at = instance.stroke_index
    steps[at] = 2 * np.round((instance.theta - u[at]) / np.pi).astype(int)
    alpha, beta = middle + steps * np.pi / 2, (1 - 2 * (steps % 2)) * skew
    return CrossField(instance, alpha, beta, best_jumps(instance, alpha, beta))


def extrapolated(instance, rounds=30):
    """A field by turns of least squares and best jumps from the nearest stroke's direction: no formulation,
    no solver.
    """
    grid, n = instance.grid, instance.grid.size
    with_stroke = np.full(instance.mask.shape, np.nan)
    with_stroke[tuple(instance.stroke_pixels.T)] = instance.theta
    near = ndimage.distance_transform_edt(np.isnan(with_stroke), return_distances=False, return_indices=True)
    alpha = with_stroke[tuple(near)][instance.mask]
    shift = np.floor((alpha - instance.alpha_lower) / (np.pi / 2)).astype(int)
    shift[instance.stroke_index] = 0
    alpha, beta = alpha - shift * np.pi / 2, np.zeros(n)
    m, rows = len(grid.first), np.arange(len(grid.first))
    at, s = instance.stroke_index, len(instance.theta)
    for _ in range(rounds):
        p = best_jumps(instance, alpha, beta)
        sign = 1.0 - 2.0 * (p & 1)
        one = np.ones(m)
        a = coo_matrix((np.r_[one, -one], (np.r_[rows, rows], np.r_[grid.first, grid.second])), (m, 2 * n))
        b = coo_matrix(
            (np.r_[sign, -one], (np.r_[rows, rows], n + np.r_[grid.first, grid.second])), (m, 2 * n)
        )
        root = np.sqrt(instance.w / 2)
        r = coo_matrix(
            (np.r_[root, root], (np.r_[np.arange(s), np.arange(s)], np.r_[at, n + at])), (s, 2 * n)
        )
        k = coo_matrix(
            (np.full(n, np.sqrt(instance.skew_coefficient / 2)), (np.arange(n), n + np.arange(n))), (n, 2 * n)
        )
        system = vstack([a, b, r, k]).tocsc()
        right = np.r_[-np.pi / 2 * p, np.zeros(m), root * instance.theta, np.zeros(n)]
        solved = spsolve((system.T @ system).tocsc(), system.T @ right)
        alpha, beta = (
            np.clip(solved[:n], instance.alpha_lower, instance.alpha_upper),
            np.clip(solved[n:], -np.pi / 4, np.pi / 4),
        )
    return CrossField(instance, alpha, beta, best_jumps(instance, alpha, beta))


@pytest.mark.parametrize("size", [24, 48])
def test_strokes_on_a_third_of_the_cylinder_determine_the_crosses(size):
    made = analytic("tilted_cylinder", size)
    error = np.degrees(extrapolated(made.instance).cross_error(made.u_angle, made.v_angle))
    assert np.median(error) < 5


def test_names_and_sizes_that_do_not_exist_are_refused():
    with pytest.raises(
        InputError, match="no surface 'sphere'; choose one of tilted_cylinder, torus_patch, wave_sheet"
    ):
        analytic("sphere")
    with pytest.raises(InputError, match="size is 0"):
        analytic("wave_sheet", 0)


def test_the_gauge_is_handed_on_and_the_result_is_the_same_each_time():
    first, second = analytic("wave_sheet", 16, gauge="box"), analytic("wave_sheet", 16, gauge="box")
    assert first.instance.gauge == "box"
    assert first.instance.sha256 == second.instance.sha256


@pytest.mark.parametrize("name", NAMES)
def test_lines_are_curvature_lines_the_normals_belong_to_them_and_the_heights_to_both(name):
    """Tangents at right angles, and normals that turn along each line as the line goes: dN is along dp."""
    made, surface = analytic(name, 20), SURFACES[name]
    s, t, _ = _parameters(surface, _frame(surface, 20))
    tangents = surface.tangents(s, t)
    assert np.abs((tangents[0] * tangents[1]).sum(axis=1)).max() < 1e-9

    def normal(s, t):
        across = np.cross(*surface.tangents(s, t))
        return across / (np.linalg.norm(across, axis=1) * np.sign(across[:, 2]))[:, None]

    np.testing.assert_allclose(made.normals, normal(s, t), atol=1e-12)
    step = 1e-5
    for tangent, ds, dt in zip(tangents, (step, 0), (0, step), strict=True):
        turn = (normal(s + ds, t + dt) - normal(s - ds, t - dt)) / (2 * step)
        assert np.linalg.norm(np.cross(turn, tangent), axis=1).max() < 1e-8
    grid = made.instance.grid
    rise = made.heights[grid.second] - made.heights[grid.first]
    slopes = -made.normals[:, :2] / made.normals[:, 2:]
    expected = (slopes[grid.first] + slopes[grid.second])[np.arange(len(rise)), grid.upward.astype(int)] / 2
    assert np.median(np.abs(rise - expected)) < 0.02
