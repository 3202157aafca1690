"""The built-in samples: complete, drawn as they say, and good instances at every size."""

from importlib.resources import files

import numpy as np
import pytest
from crossfield.models.errors import InputError
from crossfield.models.field.field import CrossField
from crossfield.models.instance.angles import line_difference
from crossfield.models.samples.samples import sample, samples
from crossfield.models.sketch.samples import SAMPLES, sample_svg
from crossfield.models.sketch.surfaces import SURFACES
from crossfield.models.smooth.polyvector import power_field
from loops import for_each
from scipy import ndimage

SKETCHES = [known.name for known in samples() if known.kind == "sketch"]
ANALYTIC = [known.name for known in samples() if known.kind == "analytic"]


def test_the_table_lists_every_drawing_and_every_surface():
    drawings = {
        path.name.removesuffix(".svg")
        for path in files("crossfield.models.sketch").joinpath("drawings").iterdir()
    }
    assert set(SKETCHES) == drawings
    assert set(ANALYTIC) == set(SURFACES)


@pytest.mark.parametrize("size", [8, 24, *(pytest.param(size, marks=pytest.mark.slow) for size in (48, 96))])
@for_each("name", list(SAMPLES))
def test_every_sample_is_one_connected_region_with_enough_strokes(name, size):
    instance = sample(name, size)
    assert max(instance.mask.shape) == size
    assert instance.name == name
    assert instance.grid.parts == 1
    if size >= 24:
        assert 0.2 < instance.mask.mean() <= 1
        assert 0.1 < len(instance.theta) / instance.grid.size < 0.85
        # Both families are there: even the flattest sample has lines 65 degrees apart.
        assert np.ptp(instance.theta) > np.radians(60)


@pytest.mark.parametrize("name", ["mouse", "wave_sheet"])
def test_samples_are_the_same_each_time_and_take_a_gauge(name):
    assert sample(name, 20).sha256 == sample(name, 20).sha256
    assert sample(name).sha256 == sample(name, 24, gauge="strokes").sha256
    assert sample(name, 20, gauge="box").gauge == "box"
    assert sample(name, 20, gauge="box").with_gauge("strokes").sha256 == sample(name, 20).sha256


@pytest.mark.parametrize("size", [24, 48])
def test_the_skewed_sheet_has_a_constant_answer_without_energy(size):
    instance = sample("skew", size)
    u, v = np.radians(12), np.radians(77)
    clear = instance.w > 0.9
    assert clear.sum() > 0.3 * len(clear)
    near = np.minimum(
        line_difference(instance.theta, np.full_like(instance.theta, u)),
        line_difference(instance.theta, np.full_like(instance.theta, v)),
    )
    assert np.degrees(near[clear]).max() < 6
    assert np.degrees(np.median(near)) < 0.5
    beta = (np.pi / 2 - (v - u)) / 2
    field = CrossField(
        instance,
        np.full(instance.grid.size, u - beta),
        np.full(instance.grid.size, beta),
        np.zeros(len(instance.grid.first)),
    )
    assert field.energy().smooth < 1e-20
    everywhere = np.ones(instance.grid.size)
    assert field.cross_error(u * everywhere, v * everywhere).max() < 1e-12


@pytest.mark.parametrize("size", [32, 48, 64])
def test_the_rounded_cube_has_a_singularity_of_a_quarter_at_its_corner(size):
    instance = sample("singular", size)
    singularities, (height, width) = power_field(instance).singularities, instance.mask.shape
    down, across = singularities.row / height, singularities.column / width
    corner = (down > 0.3) & (down < 0.62) & (across > 0.35) & (across < 0.72)
    assert singularities.index[corner].sum() == 0.25
    beside = (down > 0.6) & (down < 0.75) & (across > 0.2) & (across < 0.4)
    assert singularities.index[beside].sum() == 0


def test_the_ring_keeps_its_hole_and_the_bend_no_end_cap():
    ring = sample("ring", 48).mask
    hole = ndimage.binary_fill_holes(ring) & ~ring
    assert 0.03 < hole.mean() < 0.3
    pipe = sample("cylinder_bend", 48).mask
    assert not pipe[-8:].any()  # the cap has an outline and no curvature lines


def test_unknown_names_are_refused_with_the_choice():
    with pytest.raises(InputError, match="no sample 'sphere'; choose one of cylinder_bend, mouse"):
        sample("sphere")
    with pytest.raises(InputError, match="'wave_sheet' is computed, not drawn; choose one of cylinder_bend"):
        sample_svg("wave_sheet")
    with pytest.raises(InputError, match="size is 0"):
        sample("mouse", 0)
