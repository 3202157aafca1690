"""Instances: every rule has its message, windows and jump bounds hold what docs/mathematics.md promises,
symmetries are symmetries.
"""

from dataclasses import replace

import numpy as np
import pytest
from cases import make_instance
from crossfield.models.errors import InstanceError
from crossfield.models.instance.angles import HALF
from crossfield.models.instance.instance import GAUGES, Instance
from crossfield.models.instance.symmetries import mirrored, transposed, turned
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each

GOOD = {
    "name": "small",
    "mask": np.array([[1, 1, 1], [1, 1, 0]], dtype=bool),
    "stroke_pixels": np.array([[0, 1], [1, 0]]),
    "theta": np.array([0.5, 3.0]),
    "w": np.array([1.0, 0.25]),
}


@st.composite
def instances(draw):
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    mask = rng.random((draw(st.integers(1, 5)), draw(st.integers(1, 5)))) < 0.7
    mask[rng.integers(mask.shape[0]), rng.integers(mask.shape[1])] = True
    pixels = np.argwhere(mask)
    pixels = pixels[np.sort(rng.permutation(len(pixels))[: draw(st.integers(1, 6))])]
    return Instance.on_pixels(
        "random",
        mask,
        pixels,
        rng.uniform(-9, 9, len(pixels)),
        1 - rng.random(len(pixels)),
        gauge=draw(st.sampled_from(["strokes", "box"])),
    )


@for_each(
    "change,message",
    [
        ({"name": "Upper"}, "the name 'Upper' is not allowed"),
        ({"name": ""}, "the name '' is not allowed"),
        ({"name": "1st"}, "the name '1st' is not allowed"),
        ({"name": "a" * 33}, "at most 31"),
        ({"name": "line\n"}, "is not allowed"),
        ({"gauge": "free"}, "no gauge 'free'; choose one of strokes, box"),
        ({"stroke_coefficient": -1}, "stroke_coefficient is -1.0; it must be between 0 and 1e+06"),
        ({"stroke_coefficient": np.inf}, "stroke_coefficient is inf"),
        ({"stroke_coefficient": 1e308}, "stroke_coefficient is 1e+308; it must be between 0 and 1e+06"),
        ({"skew_coefficient": 1e7}, "skew_coefficient is 10000000.0; it must be between 0 and 1e+06"),
        ({"pixel_size": 1e-320}, "it must be between 1e-100 and 1e+100"),
        ({"origin": (1e308, 0)}, "origin is (1e+308, 0.0); it must be two numbers between"),
        ({"theta": [0.5, 1e308]}, "stroke pixel [1, 0]: theta is beyond 1e+06 radians"),
        ({"skew_coefficient": np.nan}, "skew_coefficient is nan"),
        ({"skew_coefficient": -1e-9}, "skew_coefficient is -1e-09"),
        ({"pixel_size": 0}, "pixel_size is 0.0; it must be between 1e-100 and 1e+100"),
        ({"pixel_size": np.nan}, "pixel_size is nan"),
        ({"origin": (0, np.inf)}, "origin is (0.0, inf); it must be two numbers between -1e+100 and 1e+100"),
        ({"source": "two\nlines"}, "source holds a line break"),
        ({"source": "\ud800"}, "source holds a line break or a control character"),
        ({"mask": np.zeros((2, 3), bool)}, "the mask has no pixel"),
        ({"mask": np.ones(3, bool)}, "the mask has no pixel"),
        ({"mask": np.ones((1, 10000), bool)}, "the grid is 10000 x 1; at most 9999"),
        ({"theta": [0.5]}, "2 stroke pixels need as many theta and w, but there are 1 and 2"),
        ({"w": [1, 1, 1]}, "but there are 2 and 3"),
        ({"stroke_pixels": [], "theta": [], "w": []}, "no stroke lies inside the mask"),
        ({"theta": [0.5, np.nan]}, "stroke pixel [1, 0]: theta is not a finite number (1 in all)"),
        ({"theta": [-np.inf, np.nan]}, "stroke pixel [0, 1]: theta is not a finite number (2 in all)"),
        ({"w": [0, 1]}, "stroke pixel [0, 1]: w is not in (0, 1]"),
        ({"w": [1, 1.01]}, "stroke pixel [1, 0]: w is not in (0, 1]"),
        ({"w": [1, np.nan]}, "stroke pixel [1, 0]: w is not in (0, 1]"),
        ({"stroke_pixels": [[0, 1], [1, 2]]}, "stroke pixel [1, 2]: is outside the mask"),
        ({"stroke_pixels": [[0, 1], [5, 0]]}, "stroke pixel [5, 0]: is outside the mask"),
        ({"stroke_pixels": [[-1, 0], [1, 0]]}, "stroke pixel [-1, 0]: is outside the mask"),
        ({"stroke_pixels": [[1, 0], [0, 1]]}, "stroke pixel [0, 1]: is out of order or listed twice"),
        ({"stroke_pixels": [[1, 0], [1, 0]]}, "stroke pixel [1, 0]: is out of order or listed twice"),
        ({"stroke_pixels": [[0, 0.5], [1, 0]]}, "stroke_pixels holds something other than whole numbers"),
        (
            {"stroke_pixels": [[0, 2**32 + 1], [1, 0]]},
            "stroke_pixels holds something other than whole numbers",
        ),
        ({"stroke_pixels": [[0, np.nan], [1, 0]]}, "stroke_pixels holds something other than whole numbers"),
        ({"stroke_pixels": [0, 1, 1, 0]}, "stroke_pixels has shape (4,)"),
        ({"stroke_pixels": [[0, 1, 1, 0]]}, "stroke_pixels has shape (1, 4)"),
    ],
)
def test_every_rule_names_the_place(change, message):
    with pytest.raises(InstanceError) as caught:
        Instance.on_pixels(**(GOOD | change))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_arrays_are_copies_that_cannot_be_written():
    mask = GOOD["mask"].copy()
    instance = Instance.on_pixels(**(GOOD | {"mask": mask}))
    mask[0, 1] = False
    assert instance.mask[0, 1]
    for array in (instance.mask, instance.stroke_pixels, instance.theta, instance.w):
        with pytest.raises(ValueError):
            array[0] = 0


def test_theta_is_taken_modulo_pi():
    angles = np.array([-0.1, np.pi])
    instance = Instance.on_pixels(**(GOOD | {"theta": angles}))
    assert instance.theta == pytest.approx([np.pi - 0.1, 0.0])
    tiny = Instance.on_pixels(**(GOOD | {"theta": [-1e-20, 0.0]}))
    assert (tiny.theta < np.pi).all()


def test_windows_lie_round_strokes_or_are_the_box():
    degrees = np.radians([30.0, 150.0])
    strokes = Instance.on_pixels(**(GOOD | {"theta": degrees}))
    assert strokes.stroke_index.tolist() == [1, 3]
    assert np.degrees(strokes.target) == pytest.approx([30, 150])
    assert np.degrees(strokes.alpha_lower) == pytest.approx([0, -15, 0, 105, 0])
    assert np.degrees(strokes.alpha_upper) == pytest.approx([90, 75, 90, 195, 90])
    box = strokes.with_gauge("box")
    assert np.degrees(box.target) == pytest.approx([30, -30])
    assert (box.alpha_lower == 0).all()
    assert (box.alpha_upper == HALF).all()


@pytest.mark.parametrize("theta,target", [(-45, -45), (135, -45), (134.9, 134.9), (0, 0), (90, 90), (180, 0)])
def test_box_takes_theta_between_minus_45_and_135_degrees(theta, target):
    instance = Instance.on_pixels("one", [[True]], [[0, 0]], [np.radians(theta)], [1.0], gauge="box")
    assert np.degrees(instance.target) == pytest.approx([target])


@given(instances(), st.integers(0, 2**32 - 1))
def test_best_even_and_best_odd_jump_lie_in_the_bounds(instance, seed):
    grid = instance.grid
    share = np.random.default_rng(seed).random((40, grid.size))
    share[:2] = [[0], [1]]
    alpha = instance.alpha_lower + HALF * share
    d = alpha[:, grid.first] - alpha[:, grid.second]
    every = np.arange(-8, 9)
    cost = np.abs(d[..., None] + HALF * every)
    inside = (every >= instance.p_min[:, None]) & (every <= instance.p_max[:, None])
    for parity in (0, 1):
        chosen = every % 2 == parity
        best = cost[..., chosen].min(axis=-1)
        allowed = np.where(inside, cost, np.inf)[..., chosen].min(axis=-1)
        assert np.allclose(best, allowed, atol=1e-8)


@given(instances())
def test_four_turns_two_mirrors_two_transpositions_change_nothing(instance):
    def same(moved):
        return (
            (moved.mask == instance.mask).all()
            and (moved.stroke_pixels == instance.stroke_pixels).all()
            and (moved.w == instance.w).all()
            and np.allclose(np.exp(2j * moved.theta), np.exp(2j * instance.theta))
        )

    assert same(turned(turned(turned(turned(instance)))))
    assert same(mirrored(mirrored(instance)))
    assert same(transposed(transposed(instance)))
    assert same(mirrored(transposed(turned(instance))))


def test_a_turned_instance_is_that_by_hand():
    instance = Instance.on_pixels(**GOOD)
    moved = turned(instance)
    assert moved.mask.tolist() == [[True, False], [True, True], [True, True]]
    assert moved.stroke_pixels.tolist() == [[1, 0], [2, 1]]
    assert moved.theta == pytest.approx([0.5 + HALF, 3.0 - HALF])
    assert moved.w.tolist() == [1.0, 0.25]


def test_mirrored_and_transposed_instances_are_those_by_hand():
    instance = Instance.on_pixels("one", np.ones((1, 3), bool), [[0, 0]], [np.radians(30)], [1.0])
    left_right, diagonal = mirrored(instance), transposed(instance)
    assert left_right.stroke_pixels.tolist() == [[0, 2]]
    assert np.degrees(left_right.theta) == pytest.approx([150])
    # Mirrored at the line of -45 degrees: 30 becomes -90 - 30 = -120, the line of 60 degrees.
    assert diagonal.mask.shape == (3, 1)
    assert np.degrees(diagonal.theta) == pytest.approx([60])


def test_sha256_tells_contents_apart():
    instance = Instance.on_pixels(**GOOD)
    changes = (
        {"name": "other"},
        {"gauge": "box"},
        {"source": "a.svg"},
        {"stroke_coefficient": 2.0},
        {"skew_coefficient": 0.0},
        {"theta": np.array([0.5, 3.0 + 1e-12])},
        {"w": np.array([1.0, 0.5])},
        {"orthogonal": True},
        {"pair_weights": np.full(len(instance.domain.first), 2.0)},
        {"domain": replace(instance.grid, pixel_size=2.0)},
        {"domain": replace(instance.grid, origin=(1.0, 0.0))},
        {"domain": replace(instance.grid, mask=np.ones((2, 3), bool))},
        {"stroke_index": np.array([0, 1])},
    )
    digests = {replace(instance, **change).sha256 for change in changes}
    assert len(digests | {instance.sha256}) == len(changes) + 1
    assert Instance.on_pixels(**GOOD).sha256 == instance.sha256
    # Published points and bounds are found by this hash, so that it must not change between versions.
    assert make_instance().sha256 == "035960043126af6228e3ed84e94b7cd91824a80bed27eb86a08e049f13c8352a"


def test_numbers_are_rounded_once():
    theta = [1 / 3, np.pi - 1e-12]
    instance = Instance.on_pixels(
        **(GOOD | {"theta": theta, "w": [1 / 3, 1e-9 / 3], "pixel_size": 1 / 3, "origin": (1e5 / 3, -0.0)})
    )
    assert instance.theta.tolist() == [0.333333333333, 0.0]
    assert instance.w.tolist() == [0.333333333333, 1e-9 / 3]
    assert (instance.pixel_size, instance.origin) == (0.333333333333, (33333.3333333, 0.0))
    assert replace(instance).sha256 == instance.sha256
    last = Instance.on_pixels(**(GOOD | {"theta": np.nextafter(theta, 9), "w": [1 / 3 + 1e-16, 1e-9 / 3]}))
    assert (last.theta == instance.theta).all()
    assert (last.w == instance.w).all()


@given(seed=st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=50)
def test_rounding_changes_nothing_twice(seed):
    rng = np.random.default_rng(seed)
    theta = rng.choice([1.0, 1e-9, 1e5, np.pi / 4, np.pi]) * rng.integers(-9, 10, 2) + rng.choice(
        [0, 1e-12], 2
    ) * rng.random(2)
    facts = GOOD | {
        "theta": theta,
        "w": 10 ** rng.uniform(-15, 0, 2),
        "origin": tuple(rng.normal(size=2) * 1e9),
    }
    for gauge in GAUGES:
        once = Instance.on_pixels(**facts, gauge=gauge)
        assert replace(once).sha256 == once.sha256
        assert ((once.theta == 0) | ((once.theta >= 1e-8) & (once.theta <= np.pi - 1e-8))).all()
        assert ((once.target == 0) | (np.abs(once.target) >= 1e-8)).all()
        assert (np.abs(once.target - np.pi / 4) <= np.pi / 2 + (gauge == "strokes") * np.pi / 4).all()
