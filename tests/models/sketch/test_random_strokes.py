"""Random instances: the same for the same values, as asked, and equal to those of the library that ships."""

import json
from pathlib import Path

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.library.plan import spec
from crossfield.models.instance.angles import line_difference
from crossfield.models.sketch.random_strokes import STROKES
from loops import for_each

POINTS = Path(spec.__file__).parent / "known" / "points"
PAPER = {"stroke_weight": 24 / 24, "skew_weight": 1e-6}


def test_the_library_that_ships_has_the_instances_of_the_generator():
    for seed in (1, 2, 3):
        name = f"cf_rand_n024_s{seed}"
        instance = cf.random_instance(seed, size=24, mask_share=0.75, name=name, **PAPER)
        about = json.loads((POINTS / f"{name}.about.json").read_text())
        assert instance.sha256 == about["instance"]["sha256"]


@for_each("strokes", STROKES)
def test_seed_and_options_decide_alone(strokes):
    instances = [cf.random_instance(seed, size=9, strokes=strokes) for seed in (5, 5, 6)]
    assert instances[0].sha256 == instances[1].sha256 != instances[2].sha256
    assert instances[0].name == "rand_n009_s5"


def test_the_digits_of_curves_do_not_change():
    """Families that others have built depend on them."""
    instance = cf.random_instance(7, size=8, strokes="curved", mask_share=0.9, noise=0.1, share=0.3)
    assert instance.source == (
        "random strokes on a ragged mask, seed 7, strokes curved, share 0.3, mask_share 0.9, noise 0.1"
    )
    assert instance.sha256 == "cedec9ecc29910a874d3ed8f162c316e973ea4b22b6736a7271d4d5d0e78a870"


@for_each("strokes, share", [("pixels", 0.1), ("pixels", 1.0), ("straight", 0.1), ("curved", 0.4)])
def test_strokes_have_their_share(strokes, share):
    instance = cf.random_instance(1, size=20, strokes=strokes, share=share)
    assert instance.mask.all()
    wanted = round(share * 400)
    assert wanted <= len(instance.theta) <= wanted + (0 if strokes == "pixels" else 40)
    assert 0.1 <= instance.w.min() <= instance.w.max() <= 1


def test_a_ragged_mask_is_one_part_of_its_share():
    instance = cf.random_instance(2, size=40, mask_share=0.8)
    assert instance.grid.parts == 1
    assert 0.7 < instance.mask.mean() < 0.85


def neighbours_that_differ(instance):
    """The median angle in degrees between strokes at neighbouring pixels."""
    at = np.full(instance.grid.size, -1)
    at[instance.stroke_index] = np.arange(len(instance.theta))
    one, other = at[instance.grid.first], at[instance.grid.second]
    both = (one >= 0) & (other >= 0)
    return np.degrees(np.median(line_difference(instance.theta[one[both]], instance.theta[other[both]])))


def test_only_lines_and_curves_have_directions_that_continue():
    angles = {kind: neighbours_that_differ(cf.random_instance(1, size=30, strokes=kind)) for kind in STROKES}
    assert angles["straight"] < 0.1 < angles["curved"] < 10 < angles["pixels"]


def test_noise_turns_directions_by_its_standard_deviation():
    calm, noisy = (
        cf.random_instance(4, size=60, strokes="curved", noise=deviation) for deviation in (0.0, 0.05)
    )
    assert (calm.stroke_pixels == noisy.stroke_pixels).all()
    turned = line_difference(calm.theta, noisy.theta)
    assert 0.045 < np.sqrt((turned**2).mean()) < 0.055


BAD = {
    "seed": (-1, {}, "seed is -1; choose 0 to"),
    "share": (1, {"share": 0.0}, "share is 0.0; choose a number above 0"),
    "mask": (1, {"mask_share": 1.5}, "mask_share is 1.5"),
    "strokes": (1, {"strokes": "wavy"}, "no strokes 'wavy'; choose one of pixels, straight, curved"),
    "noise": (1, {"noise": -1.0, "strokes": "curved"}, "noise is -1.0; choose 0 to 10"),
    "noise of pixels": (1, {"noise": 0.1}, "noise needs strokes straight or curved"),
    "size": (1, {"size": 0}, "size is 0"),
    "not a number": (1, {"share": float("nan")}, "share is nan"),
}


@for_each("case", BAD)
def test_a_bad_option_is_named_with_its_range(case):
    seed, options, words = BAD[case]
    with pytest.raises(cf.InputError, match=words):
        cf.random_instance(seed, **options)


def test_a_mask_without_a_pixel_has_no_strokes():
    with pytest.raises(cf.NoStrokeError, match="choose a larger mask_share"):
        cf.random_instance(1, size=1, mask_share=1e-9)
