"""Random instances: the same for the same values, as asked, and equal to those of the library that ships."""

import json
from pathlib import Path

import crossfield as cf
import pytest
from crossfield.export.library.plan import spec
from loops import for_each

POINTS = Path(spec.__file__).parent / "known" / "points"
PAPER = {"stroke_weight": 24 / 24, "skew_weight": 1e-6}


def test_the_library_that_ships_has_the_instances_of_the_generator():
    for seed in (1, 2, 3):
        name = f"cf_rand_n024_s{seed}"
        instance = cf.random_instance(seed, size=24, mask_share=0.75, name=name, **PAPER)
        about = json.loads((POINTS / f"{name}.about.json").read_text())
        assert instance.sha256 == about["instance"]["sha256"]


def test_seed_and_options_decide_alone():
    instances = [cf.random_instance(seed, size=9) for seed in (5, 5, 6)]
    assert instances[0].sha256 == instances[1].sha256 != instances[2].sha256
    assert instances[0].name == "rand_n009_s5"


@for_each("share", [0.1, 1.0])
def test_strokes_have_their_share(share):
    instance = cf.random_instance(1, size=20, share=share)
    assert instance.mask.all()
    assert len(instance.theta) == round(share * 400)
    assert 0.1 <= instance.w.min() <= instance.w.max() <= 1


def test_a_ragged_mask_is_one_part_of_its_share():
    instance = cf.random_instance(2, size=40, mask_share=0.8)
    assert instance.grid.parts == 1
    assert 0.7 < instance.mask.mean() < 0.85


BAD = {
    "seed": (-1, {}, "seed is -1; choose 0 to"),
    "share": (1, {"share": 0.0}, "share is 0.0; choose a number above 0"),
    "mask": (1, {"mask_share": 1.5}, "mask_share is 1.5"),
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
