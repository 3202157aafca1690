"""Proofs for orthogonal crosses: no bound above the optimum, no worse field called optimal."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from certificate_arrays import with_head
from crossfield.models.orthogonal.energy import OrthogonalEnergy, integers_of
from crossfield.models.processes.deadline import Deadline, never, silent
from crossfield.models.proof.bound import charges, products
from crossfield.models.proof.bound.charges import charge_arrays
from crossfield.models.proof.certificate import check_proof
from crossfield.models.proof.checkers import check_orthogonal as checker
from crossfield.models.proof.checkers.check_certificate import NotProvenError, UnreadableError
from crossfield.models.proof.descent import orthogonal
from crossfield.models.proof.descent.descent import Termination
from crossfield.models.proof.descent.orthogonal import prove_orthogonal
from instance_kinds import apart, surface
from meshes import torus
from orthogonal_certificates import certificate_at
from scipy.sparse import csr_array
from small_meshes import (
    beyond_forest,
    fan,
    keeps_optimum,
    least_of_charges,
    prove_from,
    random_hull,
    random_instance,
    random_mesh,
    strokeless,
    torus_of_seven,
    try_all_integers,
    worse_integers,
)

REFUSALS = (NotProvenError, UnreadableError)
MOST_FREE = 6  # integers that are tried


def can_try_all(instance):
    return len(beyond_forest(OrthogonalEnergy.of(instance))) <= MOST_FREE


@pytest.mark.parametrize("grid", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_no_bound_exceeds_the_optimum_of_all_integers(seed, grid):
    instance = random_instance(seed, grid=grid)
    if not can_try_all(instance):
        return
    optimum, z = try_all_integers(instance)
    best = prove_from(instance, z, levels=3)
    assert best.energy == pytest.approx(optimum, abs=1e-9)
    assert best.bound <= optimum + 1e-9
    for worse in worse_integers(instance, z, seed):
        proof = prove_from(instance, worse, levels=3)
        assert proof.bound <= optimum + 1e-9
        assert proof.status == "gap" or proof.energy <= optimum + 1e-7


SLOW = [pytest.param(*case, marks=pytest.mark.slow) for case in ((2, False), (1, True))]


@pytest.mark.parametrize("seed, grid", [(0, False), (0, True), *SLOW])
def test_no_bound_exceeds_the_optimum_with_given_indices(seed, grid):
    instance = random_instance(seed, grid=grid)
    vertices, closed = instance.domain.ring_vertices[:2], 0
    for turns in itertools.product((-1, 0, 1), repeat=len(vertices)):
        try:
            part = replace(instance, indices=np.stack([vertices, turns], axis=1))
        except cf.InstanceError:  # residuals of at most pi/4 do not reach it
            continue
        optimum, z = try_all_integers(part)
        energy = OrthogonalEnergy.of(part)
        if energy.least_total(z) > optimum + 1e-9:
            continue
        for worse in map(energy.with_sums, worse_integers(part, z, seed)):
            if energy.least_total(worse) < np.inf:
                assert prove_from(part, worse, levels=2).bound <= optimum + 1e-9
        proof = cf.prove(part, work=2_000)
        assert proof.bound <= optimum + 1e-9 <= proof.energy + 2e-9
        proof.field.check_instance(part)
        closed += proof.status == "optimal"
        if len(part.theta):
            assert keeps_optimum(part, z, prove_from(part, z, levels=3))
    assert closed


def bound_of_charges(arrays):
    threshold = checker.base.json_of(arrays, "head")["threshold"]
    return checker.charges_bound(arrays, checker.CentredRows(arrays), threshold)


def matrix_of_loops(arrays, rows):
    parts = [arrays[name] for name in ("loop_sign", "loop_row", "loop_start")]
    return csr_array(tuple(parts), shape=(len(parts[2]) - 1, rows)).toarray()


def admits_charges(arrays, instance, z):
    """Whether limits and walks exclude no charge of these integers at their best angles."""
    rows, angles = checker.CentredRows(arrays), OrthogonalEnergy.of(instance).fit_angles(z)
    residual, charges = rows.residuals(np.append(angles, 0.0)) + np.pi / 2 * z, checker.Charges(arrays, rows)
    particles = charges.origin + matrix_of_loops(arrays, len(residual)) @ residual / (np.pi / 2)
    return ((particles < charges.most[0] + 0.5) & (particles > -charges.most[1] - 0.5)).all()


@pytest.mark.parametrize("stretch", [(1, 1, 1), (1, 1, 1e-3), (1, 1, 30)])
@pytest.mark.parametrize("points", [4, 5, 6])
def test_charges_have_the_optimum_of_closed_surfaces_and_bound_it(points, stretch):
    mesh = random_hull(points, points, stretch)
    instance = strokeless(mesh)
    optimum, z = try_all_integers(instance)
    assert least_of_charges(mesh) == pytest.approx(optimum, abs=1e-9)
    arrays = prove_from(instance, z, levels=1).certificate()
    assert bound_of_charges(arrays) <= optimum + 1e-9
    assert admits_charges(arrays, instance, z)


@pytest.mark.parametrize("kind", ["closed", "stroked", "sheet", "edges"])
@pytest.mark.parametrize("seed", range(3))
def test_charges_of_parts_strokes_and_weights_do_not_exceed_the_optimum(seed, kind, monkeypatch):
    monkeypatch.setattr(charges, "_MIXED", 1.0)
    rng, hull = np.random.default_rng(seed), random_hull(seed, 4)
    sheet = random_mesh(rng, 7)
    mesh, at = {
        "closed": (apart(hull, random_hull(seed, 4, (1, 1, 3))), []),
        "stroked": (apart(hull, fan().domain), [4, 6]),
        "edges": (random_hull(seed, 5), [0, 1, 2]),
        "sheet": (sheet, np.unique(sheet.boundary // 3)),
    }[kind]
    instance = surface(mesh, at, seed=seed, pair_weights=rng.uniform(0.1, 5, len(mesh.first)))
    optimum, z = try_all_integers(instance)
    arrays = prove_from(instance, z, levels=1).certificate()
    arrays |= charges.charge_arrays(mesh, checker.CentredRows(arrays), optimum + 1e-9, never)
    assert (arrays["loop_row"] >= len(mesh.first)).any() == (kind in ("sheet", "edges"))
    assert bound_of_charges(arrays) <= optimum + 1e-9
    assert admits_charges(arrays, instance, z)


MESHES = [random_hull(3, 10), random_hull(1, 6, (1, 1, 5)), torus_of_seven()]


def all_charges(mesh, rng):
    """What bounds of particles are made of, all choices of particles, and their energies."""
    instance = strokeless(mesh, pair_weights=rng.uniform(0.2, 5, len(mesh.first)))
    rows = checker.CentredRows(prove_from(instance, 0 * mesh.first, levels=1).certificate())
    arrays = charge_arrays(mesh, rows, 99.0, never)
    _, charges, clouds, count = checker.stages_bound(arrays, rows, 99.0)
    particles, walks = checker.Particles(charges, clouds, count), matrix_of_loops(arrays, len(rows.weight))
    places = particles.sign[:, None] * np.eye(charges.size)[particles.loop]
    there = np.array([*itertools.product((0, 1), repeat=len(places))])
    sums, alone = there @ places - charges.origin, there @ np.abs(places) == np.abs(there @ places)
    possible = (np.abs(sums.sum(axis=1)) < 0.1) & alone.all(axis=1)  # charges of a loop have one sign
    there, sums, form = there[possible], sums[possible], np.linalg.pinv((walks / rows.weight) @ walks.T)
    energies = np.pi**2 / 4 * np.einsum("kv,vw,kw->k", sums, form, sums, optimize=True)
    return (charges, clouds, count), there, sums, energies


@pytest.mark.parametrize("mesh", MESHES)
def test_no_branch_has_a_bound_above_the_energies_of_its_charges(mesh):
    rng = np.random.default_rng(0)
    parts, there, _, energies = all_charges(mesh, rng)
    states = rng.choice([0, 1, 2], p=[0.2, 0.2, 0.6], size=(300, there.shape[1]))
    bounds = checker.Branches(*parts).bounds(states, rng.random(states.shape))
    members = ((states[:, None] == there) | (states[:, None] == 2)).all(axis=2)
    assert (bounds <= np.where(members, energies, np.inf).min(axis=1) + 1e-9).all()
    assert members.any(axis=1).sum() > 50


@pytest.mark.parametrize("noise", [0, 1e-3, 1])
@pytest.mark.parametrize("mesh", MESHES[::2])
def test_no_products_have_a_bound_above_the_energies_of_other_charges(mesh, noise, monkeypatch):
    monkeypatch.setattr(products, "_FEW", 1)
    rng = np.random.default_rng(1)
    parts, there, sums, energies = all_charges(mesh, rng)
    first, looks = energies.argmin(), itertools.count()
    options = {"threshold": 99.0, "is_over": lambda _: next(looks) > 500}
    arrays, _, _ = products.products_arrays(*parts, sums[first], **options)
    linear, pairs, triples, weight, (more,) = (arrays[f"products_0_{part}"] for part in checker.PRODUCTS[1:])
    linear, pairs = linear + noise * rng.normal(size=linear.shape), pairs + noise * rng.random(len(pairs))
    of = checker.Products(*parts, arrays["products_known"].astype(int))
    assert of.least == pytest.approx(energies[first])
    bound, with_each = of.bound(
        checker.dual_of(linear, pairs), triples.astype(int), weight * (1 + noise), more + noise
    )
    others, kept = np.delete(energies, first), np.delete(there, first, axis=0)
    assert bound <= others.min() + 1e-9
    assert noise or bound > 0.9 * others.min()
    assert (with_each <= np.where(kept.T, others, np.inf).min(axis=1) + 1e-9).all()


@pytest.mark.parametrize("points, way", [(10, "branches"), (40, "branches"), (40, "products")])
def test_particles_prove_optima_of_closed_surfaces(points, way, monkeypatch):
    if way == "products":
        monkeypatch.setattr(orthogonal, "branch_arrays", lambda *_: ({}, None))
    proof = cf.prove(strokeless(random_hull(points, points)), jobs=1)
    assert (proof.status, proof.levels, way in proof.arrays) == ("optimal", (), True)


def test_charges_do_not_exceed_the_optimum_of_a_torus():
    instance = strokeless(torus_of_seven())
    optimum, z = try_all_integers(instance)
    arrays = prove_from(instance, z, levels=1).certificate()
    assert 0 < bound_of_charges(arrays) <= least_of_charges(instance.domain) < optimum - 0.1


def test_charges_alone_may_meet_the_gap_beside_a_stroke():
    proof = cf.prove(surface(torus(32, 16), [0]), limits=cf.Limits(gap=0.05))
    assert (proof.ended, proof.levels) == ("gap", ())
    assert checker.check_arrays(proof.certificate()).bound == proof.bound > 0.95 * proof.energy


@pytest.mark.parametrize("kind", ["parts", "grid", "weights"])
def test_limits_follow_from_the_resistances_of_the_pseudoinverse(kind):
    mesh = apart(random_hull(1, 150), random_hull(2, 60, (1, 1, 3)))
    instance = strokeless(mesh)
    if kind == "grid":
        mask = np.random.default_rng(0).random((17, 17)) < 0.8
        instance = cf.Instance.on_pixels(
            "holes", mask, np.argwhere(mask)[:2], *np.ones((2, 2)), orthogonal=True
        )
    if kind == "weights":
        instance = strokeless(mesh, pair_weights=np.random.default_rng(0).uniform(0.1, 5, len(mesh.first)))
    energy = OrthogonalEnergy.of(instance)
    rows = np.zeros((len(energy.first), energy.size + 1))
    rows[np.arange(len(rows)), energy.first] = 1
    rows[np.arange(len(rows)), energy.second] -= 1
    inverse = np.linalg.pinv(rows.T * energy.weight @ rows, rcond=1e-9, hermitian=True)
    across = np.einsum("ei,ij,ej->e", rows, inverse, rows)
    limit = checker.CentredRows(certificate_at(instance, np.zeros(len(rows), int))).limit
    assert limit == pytest.approx(np.pi / 4 * (1 - energy.weight * across), abs=1e-7)


@pytest.mark.parametrize("seed", [2, 7, 40])
def test_all_levels_keep_the_crosses_of_the_optimum(seed):
    instance = random_instance(seed)
    _, z = try_all_integers(instance)
    for integers in (z, *worse_integers(instance, z, seed)):
        assert keeps_optimum(instance, z, prove_from(instance, integers, levels=3))


def test_the_shortest_time_limit_leaves_a_bound_that_is_checked(tmp_path):
    proof = cf.prove(cf.sample("disc"), limits=cf.Limits(1e-9, gap=0.0))
    assert (proof.ended, len(proof.levels)) == ("time", 1)
    assert 0 < cf.write_certificate(proof, tmp_path / "disc.npz").bound == proof.bound
    assert cf.read_certificate(tmp_path / "disc.npz").bound == proof.bound


def test_without_time_for_charges_and_levels_many_faces_have_a_field_and_the_reason():
    proof = cf.prove(strokeless(random_hull(0, 3100)), limits=cf.Limits(1e-9))
    assert (proof.ended, proof.levels, proof.has_bound) == ("time", (), False)
    assert re.fullmatch("charges take about 1 s.*; the coarsest level takes about 5 s.*", proof.reason)
    proof = cf.prove(strokeless(random_hull(1, 300)), limits=cf.Limits(1e-9))
    assert 0 < proof.bound < proof.energy
    assert proof.reason.startswith("the coarsest level takes about")


def test_a_bound_of_charges_has_the_reason_why_no_level_follows(monkeypatch):
    monkeypatch.setattr(orthogonal, "_MOST_COSTS", 1000)
    ticks = []
    proof = cf.prove(strokeless(torus_of_seven()), progress=ticks.append, stop=lambda: len(ticks) > 3)
    assert 0 < proof.bound < proof.energy
    assert proof.reason.startswith("the coarsest level has")


@pytest.mark.slow
def test_levels_end_while_there_is_time_for_their_check(monkeypatch):
    # a clock by which the exclusions of a level take a second, in the prover and in the check
    seconds, complete = [], checker.kept_of
    monkeypatch.setattr(checker, "kept_of", lambda *parts: seconds.append(1) or complete(*parts))
    ends = Termination(Deadline.after(6, lambda: float(len(seconds))), never, gap=0.0, work=math.inf)
    proof = check_proof(*prove_orthogonal(cf.sample("disc").with_gauge("strokes"), None, ends, silent))
    assert proof.ended == "time"
    assert 0 < len(seconds) <= 6


@pytest.fixture(scope="module", params=[None, [(0, 1)]])
def forgeable(request):
    """Certificates of a best field, with rings, and of a worse one, each with the optimum."""
    instance = replace(fan(8), indices=request.param)
    proof = cf.prove(instance)
    z = integers_of(proof.field)
    for pair in range(8):
        z[pair] += 1
        z = OrthogonalEnergy.of(instance).with_sums(z)
        worse = prove_from(instance, z, levels=2)
        if worse.energy > proof.energy + 1e-3:
            return proof.energy, [proof.certificate(), worse.certificate()]
    return None


def accepts(arrays):
    """What a certificate proves, or None where the checker refuses it."""
    try:
        return checker.check_arrays(arrays)
    except REFUSALS:
        return None


def test_no_changed_array_proves_more_than_is_true(forgeable):
    optimum, certificates = forgeable
    rng, refused = np.random.default_rng(0), 0
    own = {"alpha", "p", "head"}  # another field, whose energy is computed
    for arrays in certificates:
        for name in sorted(arrays):
            if name.startswith("instance_") or not arrays[name].size:
                continue
            forged = arrays[name].copy()
            flat = forged.reshape(-1)
            at = rng.integers(flat.size, size=max(1, flat.size // 10))
            flat[at] = {"f": lambda v: v + rng.normal(0, 0.3, v.shape)}.get(
                forged.dtype.kind, lambda v: rng.permutation(v) + rng.integers(-2, 3)
            )(flat[at])
            claim = accepts(arrays | {name: forged})
            refused += claim is None
            if claim is not None and name not in own:
                assert claim.bound <= optimum + 1e-9, name
                assert claim.status == "gap" or claim.energy <= optimum + 1e-7, name
    assert refused


def test_claims_beyond_the_proof_are_refused(forgeable):
    optimum, (best, worse) = forgeable
    assert accepts(best).status == "optimal"
    assert accepts(worse).status == "gap"
    for changes in ({"bound": 1.01 * optimum}, {"status": "optimal"}, {"threshold": 0.9 * optimum}):
        assert accepts(with_head(worse, **changes)) is None
    assert accepts(with_head(best, bound=1.01 * optimum)) is None
    assert accepts(with_head(best, energy=0.9 * optimum)) is None
