"""Forged certificates of orthogonal crosses: each breaks one assumption of a lemma, and nothing else."""

import itertools
import re
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from certificate_arrays import claiming, of_instance, with_array, with_entry, with_head
from crossfield.models.orthogonal.energy import OrthogonalEnergy
from crossfield.models.proof.checkers import check_orthogonal as checker
from crossfield.models.proof.checkers.check_certificate import NotProvenError, UnreadableError
from crossfield.models.proof.descent import orthogonal
from meshes import torus
from orthogonal_certificates import certificate_at, shares_of_star, star
from small_meshes import fan, random_hull, random_instance, strokeless, try_all_integers

HALF = np.pi / 2
BOTH = ([1, 1], [1, -1])  # one pair, there and back


def refusal(arrays):
    """The message with which a certificate is refused."""
    with pytest.raises((NotProvenError, UnreadableError)) as caught:
        checker.check_arrays(arrays)
    return str(caught.value)


def local_optima(instance):
    """Integers of the least and of the next energy near the best ones, with these energies."""
    energy, (least, best) = OrthogonalEnergy.of(instance), try_all_integers(instance)
    near = [best + np.array(step) for step in itertools.product((-1, 0, 1), repeat=len(best))]
    worse = min((z for z in near if energy.least_total(z) > least + 1e-6), key=energy.least_total)
    return least, best, energy.least_total(worse), worse


def test_a_ring_along_one_pair_there_and_back_is_refused():
    instance = star()
    least, _, worse, z = local_optima(instance)
    make = {"divisions": 60, "shares": shares_of_star}
    honest = checker.check_arrays(certificate_at(instance, z, **make))
    assert (honest.status, honest.bound) == ("gap", pytest.approx(least, abs=1e-8))
    sound = certificate_at(instance, z, **make)
    forged = sound | {"ring_start": np.array([0, 2], "i4"), "ring_pair": np.array(BOTH[0], "i4")}
    forged |= {"ring_sign": np.array(BOTH[1], "i1"), "level_0_rings": np.zeros(1, "i4")}
    twice = np.zeros(2 * 61 * 61, "i4")
    forged |= {"level_0_shares": np.append(sound["level_0_shares"], twice)}
    assert "different points and pairs" in refusal(with_head(forged, bound=worse - 1e-8, status="optimal"))


def numbers_that_round_up(count, unit):
    """Whole numbers near 2^31 whose multiples, added one after the other, round up each time."""
    rng, total, numbers = np.random.default_rng(0), 0.0, []
    for _ in range(count):
        choices = rng.integers(2**31 - 4000, 2**31 - 1, 16)
        best = int(((total + choices * unit) - total - choices * unit).argmax())
        numbers.append(float(choices[best]))
        total += numbers[-1] * unit
    return numbers


@pytest.mark.slow
def test_thousands_of_tables_of_one_pair_do_not_round_up():
    at, theta = np.array([[0, 0], [1, 1]]), np.array([0.3, 0.9])
    instance = cf.Instance.on_pixels("square", np.ones((2, 2), bool), at, theta, np.ones(2), orthogonal=True)
    _, z = try_all_integers(instance)
    numbers, ring = numbers_that_round_up(4000, 1 / 3), ([0, 3, 2, 1], [1, -1, -1, 1])

    def tables(level):
        sizes = np.diff(level.pairs.begin)[ring[0]]
        return [np.full(size, number * (k == 0)) for number in numbers for k, size in enumerate(sizes)]

    rings = {"rings": [ring] * len(numbers), "tables": tables, "unit": 1 / 3}
    forged, sound = certificate_at(instance, z, 3, **rings), certificate_at(instance, z, 3)
    assert checker.check_arrays(forged).levels < checker.check_arrays(sound).levels


@pytest.fixture(scope="module")
def mesh():
    """A bent fan, the best integers on it, and a certificate."""
    instance = fan()
    _, z = try_all_integers(instance)
    return instance, z, certificate_at(instance, z, 45)


def test_a_turn_between_frames_that_is_not_the_meshs_is_refused(mesh):
    _, _, sound = mesh
    kappa = sound["kappa"]
    assert checker.check_arrays(sound).bound > 0
    for wrong in (1e-11, 1e-8, 2 * np.pi, 2e6 * np.pi, 5.3e16):
        for e in range(len(kappa)):
            forged = np.where(np.arange(len(kappa)) == e, kappa + wrong, kappa)
            assert "kappa" in refusal(sound | {"kappa": forged})


def test_a_turn_that_may_be_rounded_otherwise_is_deducted(mesh):
    instance, z, sound = mesh
    kappa = sound["kappa"]
    claims = [checker.check_arrays(certificate_at(instance, z, 45, kappa=kappa + by)) for by in (0, 1e-12)]
    lost, more = (claim.energy - claim.bound for claim in claims)
    assert more - lost == pytest.approx(np.pi * 1e-12 * len(kappa), rel=0.1)


@pytest.mark.parametrize("scale", [1e-200, 3e-81, 1e20])
def test_a_mesh_of_any_size_has_its_turns(scale, mesh):
    _, _, sound = mesh
    scaled = sound | {"instance_vertices": sound["instance_vertices"] * scale}
    assert checker.check_arrays(scaled).bound == pytest.approx(checker.check_arrays(sound).bound, abs=1e-9)
    kappa = sound["kappa"]
    for wrong in (0 * kappa, np.full_like(kappa, np.round(np.pi, 12))):
        assert "kappa" in refusal(scaled | {"kappa": wrong})


def test_meshes_without_a_size_are_refused(mesh):
    _, _, sound = mesh
    vertices, faces = sound["instance_vertices"], sound["instance_faces"]
    assert "too far away" in refusal(sound | {"instance_vertices": vertices * 1e80})
    for forged in (vertices * 0, vertices * [1, 0, 0], vertices * [1, 1e-13, 0]):
        assert "no area" in refusal(sound | {"instance_vertices": forged})
    repeated = np.where(np.arange(len(faces))[:, None] == 0, faces[:, [0, 0, 1]], faces)
    assert "faces" in refusal(sound | {"instance_faces": repeated})
    none = {"instance_faces": faces[:0], "instance_stroke_faces": np.zeros(0, "i4")}
    assert "none" in refusal(sound | none)


def test_centres_far_away_are_refused_and_their_size_is_deducted():
    instance = star()
    _, z = try_all_integers(instance)
    centre = certificate_at(instance, z)["centre"]
    bounds = []
    for turns in (0, 1, 100):
        shifted = certificate_at(instance, z, centre=centre + HALF * turns)
        bounds.append(checker.check_arrays(shifted).levels[0])
    assert bounds[0] > bounds[1] > bounds[2]
    far = centre + HALF * 636_620
    assert "centre" in refusal(certificate_at(instance, z) | {"centre": far})


def test_a_jump_is_forced_only_where_the_field_has_it():
    # the worse field passes the right neighbour on the other side of a quarter turn
    instance = star()
    z, worse = np.array([[0, 0, 0, 0, -1, -1], [0, 0, 0, 0, -1, 0]])
    energy = OrthogonalEnergy.of(instance)
    assert local_optima(instance)[::2] == pytest.approx((energy.least_total(z), energy.least_total(worse)))
    centre = energy.fit_angles(z)
    claim = checker.check_arrays(certificate_at(instance, worse, 120, shares=shares_of_star, centre=centre))
    alone = checker.check_arrays(certificate_at(instance, z, 120, shares=shares_of_star))
    assert (alone.status, claim.status) == ("optimal", "gap")
    assert alone.forced_pairs.tolist() == [True, False, True]
    assert claim.forced_pairs.tolist() == [True, False, False]


BROKEN = [
    ("gauge", of_instance(gauge="box")),
    ("orthogonal", of_instance(orthogonal=False)),
    ("orthogonal", of_instance(orthogonal=1)),
    ("w_strokes", of_instance(w_strokes=-1.0)),
    ("w_strokes", of_instance(w_strokes=np.nan)),
    ("theta", with_entry("instance_theta", 0, np.pi)),
    ("instance_w", with_entry("instance_w", 0, 0.0)),
    ("instance_w", with_entry("instance_w", 0, 1.5)),
    ("strokes", with_entry("instance_stroke_pixels", [2, 3], [0, 1])),
    ("stroke_pixels", with_entry("instance_stroke_pixels", 1, -1)),
    ("pair_weights", with_entry("instance_pair_weights", 0, 0.0)),
    ("pair_weights", with_entry("instance_pair_weights", 0, -1.0)),
    ("pair_weights", with_entry("instance_pair_weights", 0, 2e6)),
    ("pair_weights", with_entry("instance_pair_weights", 0, np.nan)),
    ("alpha", with_entry("alpha", 0, 3.0)),
    ("alpha", with_entry("alpha", 0, np.nan)),
    ("p[0]", with_entry("p", 0, 65)),
    ("p[0]", with_entry("p", 0, -(2**31))),
    ("centre", with_entry("centre", 0, -1e4)),
    ("half", with_entry("half", 0, 2)),
    ("divisions", with_entry("divisions", 0, 2)),
    ("divisions", with_entry("divisions", 0, 10_001)),
    ("unit", with_entry("level_0_unit", 0, -1e-9)),
    ("unit", with_entry("level_0_unit", 0, 1.1)),
    ("cases", with_entry("cases", 0, 2e3)),
    ("rings[0] is no ring", with_array("level_0_rings", [-1])),
    ("ring_start", with_entry("ring_start", 0, 1)),
    ("ring_start", lambda a: a | {"ring_start": np.zeros(0, "i4")}),
    ("ring_start", lambda a: a | {"ring_start": np.zeros(2, "i4")}),
    ("ring_start", with_array("ring_start", [0, 2, 0])),
    ("too many", lambda a: a | {"instance_crossings": np.zeros(0)}),
    ("instance_stroke_faces", lambda a: a | {"instance_faces": np.zeros((1, 3), "i4")}),
    ("bound is not in", claiming(bound=-np.inf)),
    ("bound is not in", claiming(bound=np.nan)),
    ("only", claiming(bound=1.0)),
    ("threshold", claiming(threshold=0.1)),
    ("threshold", claiming(threshold=np.inf)),
]
"""Messages, and the changes that they refuse."""


def test_each_broken_assumption_is_refused_by_name(subtests):
    instance = star()
    sound = certificate_at(instance, try_all_integers(instance)[1], 30)
    assert checker.check_arrays(sound).status == "optimal"
    for number, (message, change) in enumerate(BROKEN):
        with subtests.test(message, number=number):
            assert message in refusal(change(sound))


@pytest.mark.parametrize("instance", [fan(8), random_instance(0, grid=True)])
def test_indices_that_the_field_or_the_vertices_have_not_are_refused(instance):
    vertex = instance.domain.ring_vertices[0]
    sound = cf.prove(replace(instance, indices=[(vertex, 1)]), work=20_000).certificate()
    rows = checker.CentredRows(sound)
    assert (rows.limit >= np.pi / 4).all()  # not Lemma 1: a change of an integer may break other limits
    for message, forged in (
        ("other sums", {"instance_indices": [[vertex, 0]]}),
        ("without a ring", {"instance_indices": [[1, 1]]}),
        ("without a ring", {"instance_indices": [[10**6, 1]]}),
        ("out of order", {"instance_indices": [[vertex, 1], [vertex, 1]]}),
        ("too far", {"potential": [1e9]}),
    ):
        arrays = {name: np.array(array, sound[name].dtype) for name, array in forged.items()}
        assert message in refusal(sound | arrays)
    assert "has no array potential" in refusal({n: a for n, a in sound.items() if n != "potential"})
    assert "too many" in refusal({n: a for n, a in sound.items() if n != "instance_indices"})


def of_sole_loop(rows, signs):
    """A function that returns arrays with one loop alone."""
    loop = {"loop_start": [0, len(rows)], "loop_row": rows}
    arrays = {name: np.array(numbers, "i4") for name, numbers in loop.items()}
    return lambda a: a | arrays | {"loop_sign": np.array(signs, "i1")}


def with_cells(arrays, particle, loop, weight):
    """Arrays with one more loop at the end of the clouds of some particles."""
    start, more = arrays["stage_0_start"], np.zeros(len(arrays["stage_0_start"]), "i4")
    more[particle + 1] = 1
    cells, weights = arrays["stage_0_loop"], arrays["stage_0_weight"]
    return arrays | {
        "stage_0_start": start + np.cumsum(more, dtype="i4"),
        "stage_0_loop": np.insert(cells, start[particle + 1], loop),
        "stage_0_weight": np.insert(weights, start[particle + 1], np.float32(weight)),
    }


def covering_the_other_sign(arrays):
    return with_cells(arrays, np.array([0]), np.nonzero(arrays["stage_0_negative"])[0][-1:], 1e-3)


def with_a_cloud_each(arrays):
    loops = np.append(*(np.nonzero(arrays[f"stage_0_{side}"])[0] for side in ("positive", "negative")))
    bare = np.nonzero(np.diff(arrays["stage_0_start"]) == 0)[0]
    return with_cells(arrays, bare, loops[bare], 1e-3)


BROKEN_CHARGES = [
    ("loop_start", with_array("loop_start", [])),
    ("loop_start", with_entry("loop_start", 0, 1)),
    ("loop_start", with_entry("loop_start", 1, 0)),
    ("loop_row is no row", with_entry("loop_row", 0, -1)),
    ("one direction", lambda a: with_entry("loop_sign", 0, -a["loop_sign"][0])(a)),
    ("twice", of_sole_loop([0, 0], [1, -1])),
    ("not closed", of_sole_loop([0, 1], [1, -1])),
    ("stages", with_array("stages", [0])),
    ("stage leaves out", with_entry("stage_0_positive", 2, 0)),
    ("price", lambda a: with_entry("stage_0_price", 0, a["stage_0_price"][0] + 1e-9)(a)),
    ("stage_0_price", lambda a: a | {"stage_0_price": a["stage_0_price"] * np.nan}),
    ("potential is too large", lambda a: a | {"stage_0_potential": 0 * a["stage_0_potential"] + 1e308}),
    ("price is too large", lambda a: a | {"stage_0_price": 0 * a["stage_0_price"] - 1e308}),
    ("clouds are not", lambda a: a | {"stage_0_start": a["stage_0_start"][1:]}),
    ("clouds have other lengths", with_entry("stage_0_start", 1, -1)),
    ("clouds have a wrong", with_entry("stage_0_loop", 0, -1)),
    ("clouds have a wrong", with_entry("stage_0_weight", 0, -1e-3)),
    ("clouds name a loop twice", with_entry("stage_0_loop", 0, 70)),
    ("less than nothing", with_entry("stage_0_weight", 0, 1e3)),
    ("clouds cover a particle", covering_the_other_sign),
    ("clouds of both signs meet", with_a_cloud_each),
]
"""As `BROKEN`, of a closed surface."""


def with_tree(arrays, first, end=None):
    """Arrays with more nodes before those of the tree of branches, and another end."""
    tree = np.append(first, arrays["branches"])[:end].astype("i4")
    shares = np.resize(arrays["branch_shares"], ((tree < 0).sum(), arrays["branch_shares"].shape[1]))
    return arrays | {"branches": tree, "branch_shares": shares}


BROKEN_BRANCHES = [
    ("go on after the end", lambda a: with_tree(a, [-1])),
    ("do not end", lambda a: with_tree(a, [], -1)),
    ("by a particle twice", lambda a: with_tree(a, [1, 1])),
    ("by a particle twice", lambda a: with_tree(a, [99])),
    ("branch_particles leaves out", lambda a: a | {"branch_particles": 0 * a["branch_particles"]}),
    ("branch_shares", lambda a: a | {"branch_shares": a["branch_shares"][:, 1:]}),
]


BROKEN_PRODUCTS = [
    ("pairs is negative", with_entry("products_0_pairs", 0, -1.0)),
    ("pairs is too large", with_entry("products_0_pairs", 0, 1e35)),
    ("apart is negative", with_entry("products_0_apart", 0, -1.0)),
    ("triples are not of three", with_entry("products_0_triples", 0, 999)),
    ("particles leaves out", lambda a: a | {"products_1_particles": 0 * a["products_1_particles"]}),
    ("leaves out a particle", with_entry("products_0_linear", 1, 99.0)),
    ("is proven", lambda a: a | {"products_known": 0 * a["products_known"]}),
    ("products", lambda a: a | {"products": np.array([3], np.int32)}),
]


@pytest.mark.parametrize(
    "mesh, gap, broken",
    [
        (torus(12, 6), 0.9, BROKEN_CHARGES),
        (random_hull(20, 20), 0.0, BROKEN_BRANCHES),
        (random_hull(40, 40), 0.0, BROKEN_PRODUCTS),
    ],
)
def test_each_broken_assumption_about_charges_is_refused_by_name(mesh, gap, broken, subtests, monkeypatch):
    if broken is BROKEN_PRODUCTS:
        monkeypatch.setattr(orthogonal, "branch_arrays", lambda *_: ({}, None))
    sound = cf.prove(strokeless(mesh), limits=cf.Limits(gap=gap), jobs=1).certificate()
    assert checker.check_arrays(sound).bound > 0
    for number, (message, change) in enumerate(broken):
        with subtests.test(message, number=number):
            assert message in re.sub(r"\[\d+\]", "", refusal(change(sound)))
