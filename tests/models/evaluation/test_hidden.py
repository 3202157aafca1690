"""Hidden curves: the strokes that are removed and kept, and the angle to a field."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.errors import InstanceError
from crossfield.models.evaluation.hidden import MOST, SHORTEST, hidden_curves, summary
from crossfield.models.field.field import CrossField
from crossfield.models.sketch.tracing import curves_of


def traced(name, size=24):
    instance = cf.sample(name, size)
    return instance, curves_of(instance, name)


def strokes_of(instance):
    """Direction and reliability by pixel."""
    pixels = map(tuple, instance.stroke_pixels.tolist())
    return dict(zip(pixels, zip(instance.theta, instance.w, strict=True), strict=True))


def at_random(instance, rng):
    """Crosses in any direction, with lines at right angles."""
    grid = instance.grid
    return CrossField(instance, rng.uniform(0, np.pi, grid.size), np.zeros(grid.size), 0 * grid.first)


def test_crosses_at_random_are_22_and_a_half_degrees_off():
    rng = np.random.default_rng(5)
    angles = []
    for name in ("mouse", "singular", "bottle"):
        for hidden in hidden_curves(*traced(name), 4):
            angles += [hidden.deviation(at_random(hidden.rest, rng)) for _ in range(40)]
    found = summary(np.degrees(angles))
    assert found.count == len(angles) > 400
    assert abs(found.mean - 22.5) < 4 * found.error < 1.5


def test_the_nearer_line_counts_whichever_it_is():
    instance, curve = traced("skew")
    for hidden in hidden_curves(instance, curve, 3):
        grid, off = instance.grid, 0.2
        on_curve = np.zeros(grid.size)
        on_curve[instance.stroke_index[hidden.stroke]] = instance.theta[hidden.stroke]
        for label, sign in ((0.0, 1), (np.pi / 2, -1)):  # line u, then line v
            beta = np.full(grid.size, 0.1)
            field = CrossField(instance, on_curve + off - label - sign * beta, beta, 0 * grid.first)
            assert hidden.deviation(field) == pytest.approx(off, abs=1e-9)


def test_hiding_changes_neither_the_mask_nor_the_other_strokes():
    for name in ("mouse", "ring", "saddle"):
        instance, curve = traced(name)
        strokes = strokes_of(instance)
        found = hidden_curves(instance, curve, 100)
        assert len(found) > 3
        assert [len(each.stroke) for each in found] == sorted((len(h.stroke) for h in found), reverse=True)
        for hidden in found:
            rest = hidden.rest
            gone = {tuple(pixel) for pixel in instance.stroke_pixels[hidden.stroke].tolist()}
            assert np.array_equal(rest.mask, instance.mask)
            assert strokes_of(rest) == {at: value for at, value in strokes.items() if at not in gone}
            assert SHORTEST <= len(gone) <= MOST * len(strokes)
            assert (curve[hidden.stroke] == hidden.number).all()
        assert {each.number for each in hidden_curves(instance, curve, 2)} == {h.number for h in found[:2]}


def test_a_part_of_the_mask_keeps_a_stroke():
    mask = np.ones((5, 9), dtype=bool)
    mask[:, 4] = False  # two parts: one curve on the left, two on the right
    pixels = np.array([[row, column] for row in range(5) for column in (1, 5, 7)])
    instance = cf.Instance("two", mask, pixels, np.full(15, np.pi / 2), np.ones(15))
    curve = np.tile(np.array([0, 1, 2], dtype=np.int32), 5)
    assert [hidden.number for hidden in hidden_curves(instance, curve, 9)] == [1, 2]


def test_a_field_on_other_pixels_is_refused():
    (hidden,) = hidden_curves(*traced("mouse"), 1)
    with pytest.raises(InstanceError, match="not on the pixels of mouse"):
        hidden.deviation(cf.greedy_field(cf.sample("bottle", 12)))


def test_the_summary_of_some_angles():
    found = summary(np.array([1.0, 2.0, 6.0]))
    assert (found.count, found.mean, found.median) == (3, 3.0, 2.0)
    assert found.error == pytest.approx(np.sqrt(7 / 3))
    assert summary(np.array([4.0])).error is None
    assert summary(np.array([])) is None
