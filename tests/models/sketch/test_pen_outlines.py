"""Centre lines of filled outlines, compared with the lines that the outlines were made from."""

import numpy as np
import pytest
from children import within_memory
from crossfield.models.sketch.curves import flatten, lines_as_cubics
from crossfield.models.sketch.pen_outlines import find_pen_strokes, find_silhouettes
from scipy.spatial import cKDTree

ALONG = np.linspace(0, 1, 60)
WIDE = {
    "even": np.full(60, 2.0),
    "tapered": 0.3 + 2.5 * np.sin(np.pi * ALONG),
    "pressure": 2 + 1.2 * np.sin(9 * ALONG),
    "blob": 1 + 1.5 * np.exp(-((8 * ALONG) ** 2)),
}
PATHS = {
    "wave": lambda t: np.stack([100 * t, 20 * np.sin(2 * np.pi * t)], axis=1),
    "crosses itself": lambda t: np.stack([60 * np.sin(6 * t + 0.3), 40 * np.sin(12 * t + 0.6)], axis=1),
    "loop": lambda t: 40 * np.stack([np.cos(6.2 * t), np.sin(6.2 * t)], axis=1),
    "spiral": lambda t: (10 + 40 * t[:, None]) * np.stack([np.cos(11 * t), np.sin(11 * t)], axis=1),
}


def pen_outline(points, half):
    """The corners of what a round pen of this half width covers: left side, cap, right side, cap."""
    ahead = np.gradient(points, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    turn = np.linspace(0, np.pi, 10)[1:-1, None]

    def cap(end, sign):
        side = np.cos(turn) * left[end] + np.sin(turn) * ahead[end]
        return points[end] + sign * half[end] * side

    sides = [points + half[:, None] * left, cap(-1, 1), (points - half[:, None] * left)[::-1], cap(0, -1)]
    return np.concatenate(sides)


def shape(*loops):
    return np.concatenate([lines_as_cubics(loop, np.roll(loop, -1, axis=0)) for loop in loops])


def circle(radius, *, turn=1):
    angle = turn * np.linspace(0, 2 * np.pi, 48, endpoint=False)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def rectangle(width, height):
    return np.array([[0.0, 0], [width, 0], [width, height], [0, height]])


def star(points, inner):
    angle, far = np.pi * np.arange(2 * points) / points, np.where(np.arange(2 * points) % 2, inner, 1.0)
    return far[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def crescent(thickness):
    angle = np.linspace(-np.pi / 2, np.pi / 2, 40)
    outer = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.concatenate([outer, (outer * [1 - thickness, 1])[::-1][1:-1]])


def centre_lines(outlines, **options):
    return [stroke and stroke.points for stroke in find_pen_strokes(outlines, **options)]


def points_on(cubics):
    segments, _ = flatten(cubics, 1e-5 * np.ptp(cubics))
    return (segments[:, :1] + np.diff(segments, axis=1) * np.linspace(0, 1, 9)[:, None]).reshape(-1, 2)


def split_runs(cubics):
    return np.split(cubics, np.flatnonzero((cubics[1:, 0] != cubics[:-1, 3]).any(axis=1)) + 1)


@pytest.mark.parametrize("width", WIDE)
@pytest.mark.parametrize("path, scale", list(zip(PATHS, (1e-3, 1, 1e4, 1), strict=True)))
def test_a_pen_stroke_becomes_the_line_that_the_pen_followed(path, width, scale):
    half = WIDE[width]
    (line,) = centre_lines([scale * shape(pen_outline(PATHS[path](ALONG), half))])
    assert len(split_runs(line)) == 1
    drawn, true, mean = points_on(line) / scale, PATHS[path](np.linspace(0, 1, 2000)), 2 * half.mean()

    def misses(points, others):
        far = np.linalg.norm(points[:, None] - true[[0, -1]], axis=-1).min(axis=1) > 2 * half.max()
        miss = cKDTree(others).query(points)[0] / mean
        return miss[far].max(), miss[~far].max()

    assert max(misses(drawn, true)[0], misses(true, drawn)[0]) < 0.12
    # The ends reach their tips, half a width beyond the path, and no further.
    assert misses(true, drawn)[1] < 0.4
    assert misses(drawn, true)[1] < max(half[[0, -1]]) / mean + 0.15


@pytest.mark.parametrize("turn", [1, -1])
def test_a_loop_with_a_hole_becomes_one_closed_line(turn):
    outlines = [shape(circle(20), circle(18, turn=-1)), shape(circle(20), circle(18, turn=turn))]
    for line in centre_lines(outlines, even_odd=[False, True]):
        assert (line[0, 0] == line[-1, 3]).all()
        assert len(split_runs(line)) == 1
        np.testing.assert_allclose(np.linalg.norm(points_on(line), axis=1), 19, atol=0.1)


def test_the_even_odd_rule_decides_whether_an_inner_loop_is_a_hole():
    assert centre_lines([shape(circle(20), circle(18))]) == [None]


def test_crossing_strokes_in_one_shape_go_straight_through():
    arm = np.array([[2.0, 2], [40, 2], [40, -2], [2, -2]])
    turns = [np.array([[c, -s], [s, c]]) for c, s in ((1, 0), (0, -1), (-1, 0), (0, 1))]
    united = shape(np.concatenate([arm @ turn.T for turn in turns]))
    bars = [
        pen_outline(np.linspace(-end, end, 30), np.full(30, 2.0)) for end in np.array([[40, 0], [0.0, 40]])
    ]
    apart = shape(bars[0], bars[1][::-1])
    for line in centre_lines([united, apart]):
        assert len(split_runs(line)) == 2
        assert np.abs(points_on(line)).min(axis=1).max() < 0.1
        assert np.abs(points_on(line)).max() == pytest.approx(41, abs=1.1)


def test_a_branch_reaches_the_stroke_that_it_leaves():
    tee = np.array([[-40, 2], [40, 2], [40, -2], [2, -2], [2, -40], [-2, -40], [-2, -2], [-40, -2.0]])
    through, branch = split_runs(centre_lines([shape(tee)])[0])
    assert np.abs(points_on(through)[:, 1]).max() < 0.1
    assert np.abs(points_on(branch)[:, 0]).max() < 0.1
    assert np.abs(points_on(branch)[:, 1]).min() < 1.5


def test_areas_in_the_shape_of_a_stroke_are_left_out():
    pen = pen_outline(PATHS["wave"](ALONG), np.full(60, 1.0))
    dots = [at + circle(radius) for radius, at in ((8, [50, 60]), (8, [80, 60]), (1.5, [20, 60]))]
    (line,) = centre_lines([shape(pen, *dots)])
    assert len(split_runs(line)) == 1
    assert np.abs(points_on(line)[:, 1]).max() < 21


def test_lattices_become_their_bars():
    bars = 10 + 20 * np.arange(4)
    lower, upper = np.append(-10, bars + 1), np.append(bars - 1, 90)
    hole = [
        np.array([[left, low], [left, high], [right, high], [right, low]])
        for left, right in zip(lower[1:-1], upper[1:-1], strict=True)
        for low, high in zip(lower[1:-1], upper[1:-1], strict=True)
    ]
    runs = split_runs(centre_lines([shape(9 + rectangle(62, 62), *hole)])[0])
    drawn = np.concatenate([points_on(run) for run in runs])
    off = np.abs(drawn[..., None] - bars).min(axis=-1).min(axis=-1)
    assert np.quantile(off, 0.9) < 0.05
    assert off.max() < 1


AREAS = {
    "dot": circle(3),
    "square": rectangle(4, 4),
    "rectangle": rectangle(12, 4),
    "shadow": circle(10) * [1, 1 / 3],
    "patch": circle(10) * (1 + 0.2 * np.sin(3 * np.linspace(0, 2 * np.pi, 48)))[:, None],
    "crescent": crescent(0.9),
    "star": star(5, 0.38),
    "sun": star(12, 0.8),
}


@pytest.mark.parametrize("name", AREAS)
def test_areas_have_no_centre_line(name):
    assert centre_lines([shape(AREAS[name])]) == [None]


def test_a_thick_ring_is_an_area_and_a_thin_one_a_stroke():
    rings = [shape(circle(20), circle(inner, turn=-1)) for inner in (4, 16, 18)]
    assert [line is None for line in centre_lines(rings)] == [True, False, False]


def test_a_stroke_is_at_most_as_wide_as_the_drawing_allows():
    bar = shape(rectangle(60, 4))
    assert [centre_lines([bar], widest=widest)[0] is None for widest in (3.9, 4.1)] == [True, False]


def test_long_rectangles_are_straight_strokes():
    for length in (24, 40, 500):
        (line,) = centre_lines([shape(rectangle(length, 4))])
        np.testing.assert_allclose(points_on(line)[:, 1], 2, atol=1e-9)
        assert np.ptp(line[..., 0]) == pytest.approx(length, abs=0.01)


def test_outlines_without_area_are_no_strokes():
    there_and_back = np.array([[0.0, 0], [50, 0], [100, 1e-9], [50, 0]])
    bow_tie = np.array([[0.0, 0], [10, 10], [10, 0], [0, 10]])
    assert centre_lines([shape(there_and_back), shape(bow_tie)]) == [None, None]


def test_the_width_of_a_stroke_is_that_of_its_pen():
    for half in (1.0, 2.0):
        (stroke,) = find_pen_strokes([shape(pen_outline(PATHS["wave"](ALONG), np.full(60, half)))])
        assert stroke.width == pytest.approx(2 * half, rel=0.03)


def test_silhouettes_are_the_areas_that_stand_for_themselves():
    body, patch, arm = (shape(circle(radius) + at) for radius, at in ((50, 0), (10, 20), (20, [60, 0])))
    assert find_silhouettes([patch, body, arm, body]) == [1, 2]
    assert find_silhouettes([patch]) == [0]


SCRIBBLE = """
import numpy as np
from crossfield.models.sketch.curves import lines_as_cubics
from crossfield.models.sketch.pen_outlines import find_pen_strokes
corners = np.tile([[0, 0], [12, 0], [12, 1], [0, 1.0]], (1000, 1))
corners += np.random.default_rng(0).normal(0, 0.01, corners.shape)
scribble = lines_as_cubics(corners, np.roll(corners, -1, axis=0))
print(*[stroke is None for stroke in find_pen_strokes([scribble, scribble[:40]])])
"""


def test_a_scribble_traced_a_thousand_times_is_an_area(tmp_path):
    """Its 26,000 samples lie within a few widths of each other: hundreds of millions of pairs."""
    assert within_memory(SCRIBBLE, tmp_path).split() == ["True", "False"]
