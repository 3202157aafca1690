"""Forged certificates of orthogonal crosses: each breaks one assumption of a lemma, and nothing else."""

import itertools

import numpy as np
import pytest
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.mesh import Mesh
from crossfield.models.orthogonal.energy import OrthogonalEnergy
from crossfield.models.proof.checkers import check_orthogonal as checker
from crossfield.models.proof.checkers.check_certificate import NotProvenError, UnreadableError
from orthogonal_certificates import certificate_at, shares_of_star, star, with_head
from small_meshes import try_all_integers

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


def fan(faces=5, bend=0.4):
    """Faces around a vertex, two of them with strokes that no field follows exactly."""
    around = np.arange(faces) * 2 * np.pi / faces
    rim = np.c_[np.cos(around), np.sin(around), bend * np.cos(2 * around)]
    rolled = [np.roll([0, 1 + k, 1 + (k + 1) % faces], k) for k in range(faces)]
    mesh = Mesh(np.vstack([np.zeros(3), rim]), np.array(rolled, np.int32))
    return Instance.on_faces("fan", mesh, np.array([0, 2]), np.array([0.3, 1.2]), np.ones(2), orthogonal=True)


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
    instance = Instance.on_pixels("square", np.ones((2, 2), bool), at, theta, np.ones(2), orthogonal=True)
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


def with_entry(name, at, value):
    """A function that returns arrays with one entry of an array changed."""

    def change(arrays):
        array = arrays[name].copy()
        array.reshape(-1)[at] = value
        return arrays | {name: array}

    return change


def of_instance(**changes):
    """A function that returns arrays with other keys in the head of the instance."""

    def change(arrays):
        head = {"head": arrays["instance_head"]}
        return arrays | {"instance_head": with_head(head, **changes)["head"]}

    return change


BROKEN = {
    "the gauge": (of_instance(gauge="box"), "gauge"),
    "crosses of any angle": (of_instance(orthogonal=False), "orthogonal"),
    "1 for true": (of_instance(orthogonal=1), "orthogonal"),
    "a weight of strokes below 0": (of_instance(w_strokes=-1.0), "w_strokes"),
    "a weight of strokes that is no number": (of_instance(w_strokes=np.nan), "w_strokes"),
    "a stroke direction of pi": (with_entry("instance_theta", 0, np.pi), "theta"),
    "a stroke without weight": (with_entry("instance_w", 0, 0.0), "instance_w"),
    "a heavy stroke": (with_entry("instance_w", 0, 1.5), "instance_w"),
    "one stroke twice": (with_entry("instance_stroke_pixels", [2, 3], [0, 1]), "strokes"),
    "a stroke at -1": (with_entry("instance_stroke_pixels", 1, -1), "stroke_pixels"),
    "a pair without weight": (with_entry("instance_pair_weights", 0, 0.0), "pair_weights"),
    "a pair below 0": (with_entry("instance_pair_weights", 0, -1.0), "pair_weights"),
    "a heavy pair": (with_entry("instance_pair_weights", 0, 2e6), "pair_weights"),
    "a pair that is no number": (with_entry("instance_pair_weights", 0, np.nan), "pair_weights"),
    "a field outside its window": (with_entry("alpha", 0, 3.0), "alpha"),
    "a field that is no number": (with_entry("alpha", 0, np.nan), "alpha"),
    "a great jump": (with_entry("p", 0, 65), "p[0]"),
    "the least jump of 32 bits": (with_entry("p", 0, -(2**31)), "p[0]"),
    "a far centre": (with_entry("centre", 0, -1e4), "centre"),
    "a shift by a step": (with_entry("half", 0, 2), "half"),
    "too few cells": (with_entry("divisions", 0, 2), "divisions"),
    "too many cells": (with_entry("divisions", 0, 10_001), "divisions"),
    "a unit below 0": (with_entry("level_0_unit", 0, -1e-9), "unit"),
    "a great unit": (with_entry("level_0_unit", 0, 1.1), "unit"),
    "angles of a case": (with_entry("cases", 0, 2e3), "cases"),
    "pair -1 in a forest": (lambda a: a | {"level_0_forests": np.array([[-1]], "i4")}, "forests"),
    "a pair too many in a forest": (lambda a: a | {"level_0_forests": np.array([[3]], "i4")}, "forests"),
    "one pair twice in a forest": (lambda a: a | {"level_0_forests": np.array([[0, 0]], "i4")}, "cycle"),
    "many forests": (lambda a: a | {"level_0_forests": np.zeros((9, 0), "i4")}, "forests are too many"),
    "ring -1": (lambda a: a | {"level_0_rings": np.array([-1], "i4")}, "rings[0] is no ring"),
    "rings that begin later": (with_entry("ring_start", 0, 1), "ring_start"),
    "no rings at all": (lambda a: a | {"ring_start": np.zeros(0, "i4")}, "ring_start"),
    "a ring of length 0": (lambda a: a | {"ring_start": np.zeros(2, "i4")}, "ring_start"),
    "a ring backwards": (lambda a: a | {"ring_start": np.array([0, 2, 0], "i4")}, "ring_start"),
    "an array too many": (lambda a: a | {"instance_crossings": np.zeros(0)}, "too many"),
    "a mesh on a mask": (lambda a: a | {"instance_faces": np.zeros((1, 3), "i4")}, "instance_stroke_faces"),
    "a claim below everything": (lambda a: with_head(a, bound=-np.inf), "bound is not in"),
    "a claim that is no number": (lambda a: with_head(a, bound=np.nan), "bound is not in"),
    "a claim above the energy": (lambda a: with_head(a, bound=1.0), "only"),
    "a threshold below the energy": (lambda a: with_head(a, threshold=0.1), "threshold"),
    "an infinite threshold": (lambda a: with_head(a, threshold=np.inf), "threshold"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_each_broken_assumption_is_refused_by_name(kind):
    instance = star()
    sound = certificate_at(instance, try_all_integers(instance)[1], 30)
    assert checker.check_arrays(sound).status == "optimal"
    change, message = BROKEN[kind]
    assert message in refusal(change(sound))
