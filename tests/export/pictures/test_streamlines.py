"""Streamlines: along the field, evenly spaced, to the border, and no farther than a singularity."""

from __future__ import annotations

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.pictures.streamlines import CLOSEST, align_labels, streamlines
from loops import for_each
from scipy.spatial import cKDTree


def field_of(mask, line, skew=lambda x, y: 0.0 * x, stroke=0):
    """The field with line u at angle line(x, y) and beta = skew(x, y); x, y from the middle of the grid,
    y up, in pixels.
    """
    mask = np.asarray(mask, dtype=bool)
    row, column = np.nonzero(mask)
    x, y = column - (mask.shape[1] - 1) / 2, (mask.shape[0] - 1) / 2 - row
    u, beta = line(x, y) + 0.0 * x, skew(x, y) + 0.0 * x
    pixel = np.array([[row[stroke], column[stroke]]])
    instance = cf.Instance.on_pixels("sample", mask, pixel, u[[stroke]], np.array([1.0]))
    return cf.CrossField.from_lines(instance, u, u + np.pi / 2 - 2 * beta)


def square(size):
    return np.ones((size, size), dtype=bool)


def waves(mask):
    return field_of(
        mask, lambda x, y: 0.7 * np.sin(x / 9 + y / 15) + 0.3, lambda x, y: 0.3 * np.cos(x / 11 - y / 7)
    )


def quarter(size, index, x0=0.0, y0=0.0):
    """One singularity of index +-1/4 at (x0, y0)."""
    return field_of(square(size), lambda x, y: index * np.arctan2(y - y0, x - x0) + 0.2)


def random_labels(field):
    """The same field with every pixel's label changed at random."""
    grid = field.instance.grid
    k = np.random.default_rng(2).integers(-3, 4, grid.size)
    p = field.p - k[grid.first] + k[grid.second]
    return cf.CrossField(field.instance, field.alpha + k * np.pi / 2, (-1.0) ** k * field.beta, p)


def length_of(points):
    return np.hypot(*np.diff(points, axis=0).T).sum()


def all_points(lines):
    return np.concatenate([line.points for line in lines])


def pixels_under(points):
    return np.rint(-points[:, 1]).astype(int), np.rint(points[:, 0]).astype(int)


@for_each("u, beta", [(0.0, 0.0), (2.2, -0.6), (1.5707, 0.7)])
def test_constant_skewed_field_gives_straight_lines_up_to_the_border(u, beta):
    field = field_of(np.ones((12, 17)), lambda x, _: u + 0 * x, lambda x, _: beta + 0 * x, stroke=40)
    lines = streamlines(field, 1.0)
    for family, angle in enumerate((u, u + np.pi / 2 - 2 * beta)):
        direction = np.array([np.cos(angle), np.sin(angle)])
        longest = max((line.points for line in lines if line.families[0] == family), key=length_of)
        offset = longest - longest[0]
        assert np.abs(offset @ [-direction[1], direction[0]]).max() < 1e-9
        assert length_of(longest) == pytest.approx(np.abs(offset[-1] @ direction))
        for end, way in ((longest[-1], offset[-1]), (longest[0], -offset[-1])):
            beyond = end + way / np.linalg.norm(way) * 0.003
            assert not (-0.5 <= beyond[0] <= 16.5 and -11.5 <= beyond[1] <= 0.5)


@for_each("size", [27, 28])
def test_concentric_field_gives_circles_and_rays(size):
    field = field_of(square(size), lambda x, y: np.arctan2(y, x) + np.pi / 2)
    middle = np.array([(size - 1) / 2, -(size - 1) / 2])
    circles = rays = 0
    for line in streamlines(field, 1.5):
        offset = line.points - middle
        radius, angle = np.hypot(*offset.T), np.unwrap(np.arctan2(offset[:, 1], offset[:, 0]))
        if radius.min() < 4:
            continue
        if np.ptp(radius) < np.ptp(angle) * radius.mean():
            assert np.ptp(radius) < 0.15
            if radius.max() < size / 2 - 0.6:
                circles += 1
                np.testing.assert_array_equal(line.points[-1], line.points[0])
                assert length_of(line.points) == pytest.approx(2 * np.pi * radius.mean(), rel=0.02)
        else:
            rays += 1
            assert (np.ptp(angle) * radius).max() < 0.3
    assert circles > 4
    assert rays > 20


def test_lines_stay_inside_the_mask_and_reach_every_part():
    down, across = np.mgrid[0:40, 0:44]
    mask = (np.hypot(down - 15, across - 14) < 13) & ~(np.hypot(down - 13, across - 16) < 4)
    mask |= (np.abs(down - 24) < 12) & (np.abs(across - 36) < 6)
    field = waves(mask)
    assert field.instance.grid.parts == 2
    lines = streamlines(field, 1.5)
    row, column = pixels_under(all_points(lines))
    assert mask[row, column].all()
    assert np.abs(all_points(lines) - np.stack([column, -row], axis=1)).max() <= 0.5
    for part in (across < 29, across >= 29):
        for family in (0, 1):
            points = all_points([line for line in lines if line.families[0] == family])
            centre = np.argwhere(mask & part)[:, ::-1] * [1, -1]
            assert np.quantile(cKDTree(points).query(centre)[0], 0.99) < 1.5


@for_each("separation", [0.7, 1.3, 4.0])
def test_lines_of_a_family_keep_their_distance_and_leave_no_gap_whatever_the_labels(separation):
    field = random_labels(waves(square(20)))
    lines = streamlines(field, separation)
    assert all(len(set(line.families.tolist())) == 1 for line in lines)  # nothing forces a cut
    centres = np.stack([field.instance.grid.columns, -field.instance.grid.rows], axis=1)
    for family in (0, 1):
        ways = [line.points for line in lines if line.families[0] == family]
        owner = np.repeat(np.arange(len(ways)), [len(way) for way in ways])
        tree = cKDTree(np.concatenate(ways))
        pairs = tree.query_pairs(0.97 * CLOSEST * separation, output_type="ndarray")
        assert (owner[pairs[:, 0]] == owner[pairs[:, 1]]).all()
        assert tree.query(centres)[0].max() < 1.5 * separation


def test_spirals_keep_their_distance_from_themselves():
    field = field_of(square(40), lambda x, y: np.arctan2(y, x) + 1.55)
    longest = max(streamlines(field, 2.0), key=lambda line: length_of(line.points))
    points = longest.points
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    pairs = cKDTree(points).query_pairs(CLOSEST * 2.0, output_type="ndarray")
    assert length_of(points) > 40
    assert (np.abs(along[pairs[:, 0]] - along[pairs[:, 1]]) <= 3 * CLOSEST * 2.0 + 1e-9).all()


@for_each("index", [0.25, -0.25])
def test_lines_end_at_a_singularity_and_labels_are_cut_from_there_to_the_border(index):
    field = quarter(15, index, 0.45, 0.55)
    singularities = field.singularities
    assert singularities.index.tolist() == [index]
    centre = np.array([singularities.column[0] + 0.5, -singularities.row[0] - 0.5])
    away = np.abs(all_points(streamlines(field, 0.7)) - centre).max(axis=1)
    assert 0.5 - 1e-9 < away.min() < 0.8
    assert 5 <= (align_labels(field).p % 2 == 1).sum() <= 20


def test_lines_end_where_the_two_lines_are_one():
    def skew(x, y):
        return np.minimum(0.95 * np.exp(-(x**2 + y**2) / 60), np.pi / 4)

    field = field_of(square(24), lambda x, _: 0.0 * x, skew, stroke=5)
    row, column = pixels_under(all_points(streamlines(field, 1.0)))
    picture = field.image(field.degenerate) > 0
    deep = picture.copy()
    for axis in (0, 1):
        deep &= np.roll(deep, 1, axis) & np.roll(deep, -1, axis)
    assert deep.sum() > 10
    assert not deep[row, column].any()
    assert (~picture)[row, column].any()


@for_each("shape", [(1, 1), (1, 6), (5, 1)])
def test_tiny_grids_have_streamlines(shape):
    lines = streamlines(field_of(np.ones(shape), lambda x, _: 0.6 + 0 * x), 0.3)
    assert {int(line.families[0]) for line in lines} == {0, 1}
    row, column = pixels_under(all_points(lines))
    assert 0 <= row.min() <= row.max() < shape[0]
    assert 0 <= column.min() <= column.max() < shape[1]
