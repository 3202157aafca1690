"""The built-in samples: complete, drawn as they say, and good instances at every size."""

import crossfield as cf
import numpy as np
from angles import line_difference
from command_line import listed
from loops import for_each
from scipy import ndimage

SAMPLES = [(row["name"], row["kind"]) for row in listed()["samples"] if row["kind"] != "mesh"]


@for_each("name, size", [(name, 24 if kind == "sketch" else 8) for name, kind in SAMPLES])
def test_every_sample_is_one_connected_region_with_enough_strokes_and_no_warning(name, size):
    instance = cf.sample(name, size)
    assert max(instance.mask.shape) == size
    assert instance.name == name
    assert instance.grid.parts == 1
    if size == 24:
        assert instance.reading.warnings == ()
        assert 0.2 < instance.mask.mean() <= 1
        assert 0.1 < len(instance.theta) / instance.grid.size < 0.85
        # Both families are there: even the flattest sample has lines 65 degrees apart.
        assert np.ptp(instance.theta) > np.radians(60)


@for_each("name", ["mouse", "wave_sheet"])
def test_samples_are_the_same_each_time_and_take_a_gauge(name):
    assert cf.sample(name).sha256 == cf.sample(name, 24, gauge="strokes").sha256
    assert cf.sample(name, 20, gauge="box").gauge == "box"
    assert cf.sample(name, 20, gauge="box").with_gauge("strokes").sha256 == cf.sample(name, 20).sha256


def test_the_skewed_sheet_has_a_constant_answer_without_energy():
    instance = cf.sample("skew", 24)
    u, v = np.radians(12), np.radians(77)
    near = line_difference(instance.theta, np.array([[u], [v]])).min(axis=0)
    clear = instance.w > 0.9
    assert clear.sum() > 0.3 * len(clear)
    assert np.degrees(near[clear]).max() < 6
    assert np.degrees(np.median(near)) < 0.5
    everywhere = np.ones(instance.grid.size)
    field = cf.CrossField.from_lines(instance, u * everywhere, v * everywhere)
    assert field.energy().smooth < 1e-20


def test_the_rounded_cube_has_a_singularity_of_a_quarter_at_its_corner():
    instance = cf.sample("singular", 32)
    singularities, (height, width) = cf.power_field(instance).singularities, instance.mask.shape
    down, across = singularities.row / height, singularities.column / width
    corner = (down > 0.3) & (down < 0.62) & (across > 0.35) & (across < 0.72)
    assert singularities.index[corner].sum() == 0.25
    beside = (down > 0.6) & (down < 0.75) & (across > 0.2) & (across < 0.4)
    assert singularities.index[beside].sum() == 0


def test_the_ring_keeps_its_hole_and_the_bend_no_end_cap():
    ring = cf.sample("ring", 48).mask
    hole = ndimage.binary_fill_holes(ring) & ~ring
    assert 0.03 < hole.mean() < 0.3
    pipe = cf.sample("cylinder_bend", 48).mask
    assert not pipe[-8:].any()  # the cap has an outline and no curvature lines
