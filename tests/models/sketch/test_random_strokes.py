"""Random instances: the same for the same values, as asked, and equal to those of the library that ships."""

import json

import crossfield as cf
from loops import for_each
from places import ROOT

POINTS = ROOT / "export/library/plan/known" / "points"
PAPER = {"stroke_weight": 24 / 24, "skew_weight": 1e-6}


@for_each("seed", (1, 2, 3))
def test_the_library_that_ships_has_the_instances_of_the_generator(seed):
    name = f"cf_rand_n024_s{seed}"
    instance = cf.random_instance(seed, size=24, mask_share=0.75, name=name, **PAPER)
    about = json.loads((POINTS / f"{name}.about.json").read_text())
    assert instance.sha256 == about["instance"]["sha256"]


def test_seed_and_options_decide_alone():
    instances = [cf.random_instance(seed, size=9) for seed in (5, 5, 6)]
    assert instances[0].sha256 == instances[1].sha256 != instances[2].sha256
    assert instances[0].name == "rand_n009_s5"


@for_each("share", [0.1, 1.0])
def test_strokes_and_mask_have_their_shares(share):
    instance = cf.random_instance(1, size=20, share=share)
    assert instance.mask.all()
    assert len(instance.theta) == round(share * 400)
    assert 0.1 <= instance.w.min() <= instance.w.max() <= 1
    ragged = cf.random_instance(2, size=40, share=share, mask_share=0.8)
    assert ragged.grid.parts == 1
    assert 0.7 < ragged.mask.mean() < 0.85
