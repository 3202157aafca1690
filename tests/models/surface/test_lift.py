"""Surfaces over cross fields: near the truth, independent of the notation of crosses, and always ended."""

import functools
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.errors import InputError
from crossfield.models.instance.angles import HALF
from crossfield.models.instance.instance import Instance
from crossfield.models.smooth.polyvector import HOLDS
from loops import for_each
from moves import MOVES, lines

pytestmark = pytest.mark.numeric


@functools.cache
def exact(name, size):
    """An analytic instance, and the field of its exact crosses."""
    true = cf.analytic(name, size)
    return true, cf.CrossField.from_lines(true.instance, true.u_angle, true.v_angle)


def bent(instance):
    return cf.bend_field(cf.polyvector_field(instance, hold=max(HOLDS)))


def apart(first, second):
    """Angles in degrees between unit normals."""
    return np.degrees(np.arccos(np.clip((first * second).sum(axis=1), -1, 1)))


def error(surface, true):
    """Mean angle to the true normals, on the side of the truth."""
    return min(apart(side.normals, true.normals).mean() for side in (surface, surface.flipped()))


def middle(true, slant=None):
    """The hint of the pixel next to the middle of the mask."""
    pixels = np.argwhere(true.instance.mask)
    at = np.argmin(((pixels - pixels.mean(axis=0)) ** 2).sum(axis=1))
    x, y, z = true.normals[at]
    return cf.Hint(
        *map(int, pixels[at]), float(np.arccos(z)) if slant is None else slant, float(np.arctan2(y, x))
    )


@for_each("name, most", [("vase", 3), ("ellipsoid", 3)])
def test_exact_crosses_lead_to_the_surface(name, most):
    true, field = exact(name, 16)
    lifted = cf.surface(field)
    assert error(lifted, true) <= most
    assert apart(lifted.normals, true.normals).mean() < 90  # the default side is the true one
    assert lifted.doubts == ()
    assert lifted.confidence.mean() > 0.9


@pytest.mark.parametrize("size", [pytest.param(48, marks=pytest.mark.slow), 16])
@pytest.mark.parametrize("name", ["tilted_cylinder", "wave_sheet"])
def test_a_hint_chooses_among_surfaces_of_the_same_crosses(name, size):
    true, field = exact(name, size)
    loose, settled = cf.surface(field), cf.surface(field, [middle(true)])
    assert apart(settled.normals, true.normals).mean() < (1 if size == 48 else 2)
    assert [len(lifted.freedom) for lifted in (loose, settled)] == [1, 0]


def test_a_hint_and_flip_choose_the_side():
    true, field = exact("spheroid", 12)
    hint = middle(true)
    other = replace(hint, tilt=hint.tilt + np.pi)
    plain, turned = cf.surface(field), cf.surface(field, flip=True)
    assert turned.heights == pytest.approx(-plain.heights, nan_ok=True)
    assert turned.normals == pytest.approx(plain.flipped().normals)
    flipped = [cf.surface(field, [one], flip=True) for one in (hint, other)]
    assert [(apart(one.normals, true.normals).mean() < 20) for one in flipped] == [True, False]
    straight = cf.surface(field, [replace(hint, slant=0.05)], flip=True)
    assert straight.normals[:, :2].ravel() @ plain.normals[:, :2].ravel() < 0  # no side follows


@for_each(
    "hint, message",
    [
        (
            (-1, 3, 0.1, 0),
            "row -1, column 3 lies outside the mask of spheroid, which has 12 rows and 10 columns",
        ),
        ((2, 99, 0.1, 0), "outside the mask"),
        ((12.5, 10, 0.1, 0), "row 12.5, column 10 lies outside the mask"),
        ((0, 0, 0.1, 0), "outside the mask"),
        ((6, 5, HALF, 0), "slant of 90 degrees; give one from 0 to less than 90"),
        ((6, 5, -0.1, 0), "slant"),
        ((6, 5, np.nan, 0), "slant of nan degrees"),
        ((6, 5, 0.1, np.inf), "tilt inf, not a direction"),
    ],
)
def test_hints_that_say_nothing_possible_are_refused(hint, message):
    with pytest.raises(InputError, match=message):
        cf.surface(exact("spheroid", 12)[1], [cf.Hint(*hint)])


def test_how_crosses_are_written_does_not_matter():
    """Lines exchanged, turned by pi, and other jumps, at random at each pixel."""
    field = bent(cf.sample("mouse", 12))
    steps = np.random.default_rng(0).integers(-3, 4, field.instance.grid.size)
    other = cf.CrossField(
        field.instance, field.alpha + HALF * steps, (-1.0) ** steps * field.beta, np.zeros_like(field.p)
    )
    assert cf.surface(other).heights == pytest.approx(cf.surface(field).heights, abs=1e-6, nan_ok=True)


@pytest.mark.parametrize("moved_instance", MOVES)
def test_the_surface_moves_with_the_sketch(moved_instance):
    move, turn = MOVES[moved_instance]
    _, field = exact("spheroid", 12)
    other = moved_instance(field.instance)
    there = [turn(move(field.image(line)))[other.mask] for line in lines(field)]
    moved = cf.surface(cf.CrossField.from_lines(other, *there)).heights
    assert moved == pytest.approx(move(cf.surface(field).heights), abs=0.05, nan_ok=True)


def constant(mask, u=0.3, v=1.3):
    """A field of the same skew cross everywhere."""
    mask = np.array(mask, dtype=bool)
    instance = Instance.on_pixels("tiny", mask, np.argwhere(mask)[:1], np.array([u]), np.ones(1))
    return cf.CrossField.from_lines(instance, np.full(mask.sum(), u), np.full(mask.sum(), v))


@for_each(
    "mask", [np.ones((1, 1)), np.ones((1, 7)), np.ones((6, 1)), np.eye(4), np.indices((5, 6)).sum(axis=0) % 2]
)
def test_any_mask_has_heights_at_the_corners_of_its_pixels(mask):
    lifted = cf.surface(constant(mask))
    used = np.zeros(np.add(mask.shape, 1), dtype=bool)
    for row, column in np.argwhere(mask):
        used[row : row + 2, column : column + 2] = True
    assert (np.isfinite(lifted.heights) == used).all()
    assert apart(lifted.normals, np.array([0, 0, 1.0])).max() < 75
    assert lifted.confidence.min() > 0.5  # one slope explains one cross; touching corners tie them


def test_parts_of_the_mask_are_independent():
    true, field = exact("spheroid", 12)
    gap = np.zeros((true.instance.mask.shape[0], 1), dtype=bool)
    mask = np.hstack([true.instance.mask, gap, true.instance.mask[:, ::-1]])
    pictures = [field.image(line) for line in lines(field)]
    mirrored = [np.pi - picture[:, ::-1] for picture in pictures]
    twice = [np.hstack([one, gap, other])[mask] for one, other in zip(pictures, mirrored, strict=True)]
    instance = Instance.on_pixels("twice", mask, np.argwhere(mask)[:1], twice[0][:1], np.ones(1))
    both = cf.surface(cf.CrossField.from_lines(instance, *twice)).heights
    alone = cf.surface(field).heights
    wide = alone.shape[1]
    assert both[:, :wide] == pytest.approx(alone, abs=1e-6, nan_ok=True)
    assert both[:, wide:] == pytest.approx(alone[:, ::-1], abs=0.05, nan_ok=True)


def test_crosses_at_right_angles_give_a_flat_sheet_and_the_doubt():
    field = cf.power_field(cf.sample("bottle", 12))
    square = cf.CrossField(field.instance, field.alpha, 0 * field.beta, field.p)
    lifted = cf.surface(square)
    (doubt,) = lifted.doubts
    assert "nearly flat" in doubt
    assert apart(lifted.normals, np.array([0, 0, 1.0])).mean() < 1


@pytest.mark.slow
@for_each("name", ["mouse", "bottle", "saddle", "cylinder_bend", "singular"])
def test_samples_are_trusted_but_not_at_singular_spots(name):
    field = bent(cf.sample(name, 24))
    lifted = cf.surface(field)
    assert lifted.doubts == ()
    at = field.instance.grid.number[field.singularities.row, field.singularities.column]
    assert (lifted.confidence[at] == 0).all()


def test_crosses_of_no_surface_are_doubted():
    instance = cf.sample("mouse", 12)
    angle = np.random.default_rng(0).uniform(0, np.pi, (2, instance.grid.size))
    lifted = cf.surface(cf.CrossField.from_lines(instance, *angle))
    (unfit,) = (doubt for doubt in lifted.doubts if "no one surface" in doubt)
    assert 0 < unfit.index("not curvature lines") < unfit.index("hidden lines")
    assert any("singular spots" in doubt for doubt in lifted.doubts)
    assert lifted.confidence.mean() < 0.7
