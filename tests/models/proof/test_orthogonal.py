"""Proofs for orthogonal crosses: no bound above the optimum, no worse field called optimal."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.models.array_archive import pack_arrays
from crossfield.models.errors import InputError
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.mesh import Mesh
from crossfield.models.orthogonal.energy import OrthogonalEnergy, integers_of
from crossfield.models.processes.deadline import Deadline, never, silent
from crossfield.models.proof.certificate import check_proof
from crossfield.models.proof.checkers import check_certificate
from crossfield.models.proof.checkers import check_orthogonal as checker
from crossfield.models.proof.checkers.check_certificate import NotProvenError, UnreadableError, unpack_archive
from crossfield.models.proof.descent.descent import Termination
from crossfield.models.proof.descent.orthogonal import prove_orthogonal
from small_meshes import (
    beyond_forest,
    keeps_optimum,
    prove_from,
    random_instance,
    try_all_integers,
    worse_integers,
)

REFUSALS = (NotProvenError, UnreadableError)
MOST_FREE = 6  # integers that are tried


def can_try_all(instance):
    return len(beyond_forest(OrthogonalEnergy.of(instance))) <= MOST_FREE


def check_seed(seed, *, grid, levels=4):
    instance = random_instance(seed, grid=grid)
    if not can_try_all(instance):
        return
    optimum, z = try_all_integers(instance)
    best = prove_from(instance, z, levels=levels)
    assert best.energy == pytest.approx(optimum, abs=1e-9)
    assert best.bound <= optimum + 1e-9
    for worse in worse_integers(instance, z, seed):
        proof = prove_from(instance, worse, levels=levels)
        assert proof.bound <= optimum + 1e-9
        assert proof.status == "gap" or proof.energy <= optimum + 1e-7


@pytest.mark.parametrize("grid", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_no_bound_exceeds_the_optimum_of_all_integers(seed, grid):
    check_seed(seed, grid=grid)


@pytest.mark.slow
@pytest.mark.parametrize("grid", [False, True])
@pytest.mark.parametrize("decade", range(1, 21))
def test_no_bound_exceeds_the_optimum_of_many_instances(decade, grid):
    for seed in range(10 * decade, 10 * decade + 10):
        check_seed(seed, grid=grid, levels=4 if decade == 1 else 3)  # a fourth takes twelve times as long


@pytest.mark.parametrize("seed", [2, 7, 21])
def test_all_levels_keep_the_crosses_of_the_optimum(seed):
    instance = random_instance(seed)
    _, z = try_all_integers(instance)
    for integers in (z, *worse_integers(instance, z, seed)):
        assert keeps_optimum(instance, z, prove_from(instance, integers))


def test_partial_sums_on_rings_that_are_cut_off_lose_the_optimum(monkeypatch):
    # steps of a ring may cost less than nothing, so that a sum above the gap can still come down
    instance = random_instance(40)
    _, z = try_all_integers(instance)
    complete, sums = checker.kept_of, checker.min_plus

    def kept_of(level, excess, forests, most):
        def cut(one, other):
            total = sums(one, other)
            return np.where(total > most - excess.bound, np.inf, total)

        with monkeypatch.context() as patch:
            patch.setattr(checker, "min_plus", cut)
            return complete(level, excess, forests, most)

    monkeypatch.setattr(checker, "kept_of", kept_of)
    assert not keeps_optimum(instance, z, prove_from(instance, z))


def test_a_single_pair_of_labels_is_kept_with_its_square():
    # a cross between two labels is rounded to both, so one that may stay keeps all squares that it touches
    ends = {"first": np.array([0]), "second": np.array([1])}
    rows = SimpleNamespace(size=2, fixed=np.array([False, False, True]), memory=1 << 20, taken=0, **ends)
    level = checker.CellLevel(rows, 3, np.repeat([0, 1, 2], [3, 3, 1]), np.array([0, 1, 2, 0, 1, 2, 0]))
    corners = np.array(list(level.corners())).reshape(4, 3, 3)
    places = np.argwhere((corners == 4 * 1 + 2).any(axis=0))
    assert places.tolist() == [[0, 1], [0, 2], [1, 1], [1, 2]]
    assert sorted(corners[:, 1, 2].tolist()) == [4 * x + y for x in (1, 2) for y in (2, 3)]


def minimise_by_gurobi(instance):
    """The least energy, by the free edition of Gurobi with its gap of 1e-6."""
    import gurobipy as gurobi

    energy = OrthogonalEnergy.of(instance)
    model = gurobi.Model(env=gurobi.Env(params={"OutputFlag": 0, "Threads": 1}))
    alpha = model.addVars(energy.size, lb=-10, ub=10)
    z = model.addVars(len(energy.first), lb=-4, ub=4, vtype="I")
    for point in energy.pins:
        alpha[point].lb = alpha[point].ub = 0
    for row in np.flatnonzero(~np.isin(np.arange(len(energy.first)), beyond_forest(energy))):
        z[row].lb = z[row].ub = 0
    terms = [
        alpha[i] - (alpha[j] if j < energy.size else 0) + c + np.pi / 2 * z[row]
        for row, (i, j, c) in enumerate(zip(energy.first, energy.second, energy.constant, strict=True))
    ]
    model.setObjective(gurobi.quicksum(w * t * t for w, t in zip(energy.weight, terms, strict=True)))
    model.setParam("MIPGap", 1e-6)
    model.optimize()
    return model.ObjVal


@pytest.mark.needs("gurobi")
@pytest.mark.parametrize("part", ["fan", "square"])
def test_gurobi_finds_the_proven_optimum(part):
    instance = fan() if part == "fan" else flat_square(0.2)
    proof = cf.prove(instance)
    assert proof.status == "optimal"
    assert minimise_by_gurobi(instance) == pytest.approx(proof.energy, rel=1e-5)


def fan(turn=0.0, *, shift=0):
    """A vertex with eight faces around it, bent like a saddle, whose boundary is stroked; frames may turn."""
    around = np.arange(8) * np.pi / 4
    rim = np.c_[np.cos(around), np.sin(around), 0.4 * np.cos(2 * around)]
    c, s = math.cos(turn), math.sin(turn)
    vertices = np.vstack([np.zeros(3), rim]) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    faces = np.array([np.roll([0, 1 + k, 1 + (k + 1) % 8], shift) for k in range(8)], dtype=np.int32)
    mesh = Mesh(vertices, faces)
    begin, end = mesh.vertices[1 + np.arange(8)], mesh.vertices[1 + (np.arange(8) + 1) % 8]
    theta = mesh.angle_in(np.arange(8, dtype=np.int32), end - begin)
    return Instance.on_faces("fan", mesh, np.arange(8), theta, np.ones(8), stroke_coefficient=2.0)


def test_a_fan_is_proven_and_its_certificate_read(tmp_path):
    proof = cf.prove(fan())
    assert proof.status == "optimal" == proof.ended
    assert proof.energy == pytest.approx(try_all_integers(fan())[0], abs=1e-9) if can_try_all(fan()) else True
    path = tmp_path / "fan.npz"
    claim = cf.write_certificate(proof, path)
    again = cf.read_certificate(path, on=proof.field.instance)
    assert (again.bound, again.status, again.forced) == (claim.bound, "optimal", 8)
    assert np.array_equal(again.field.alpha, proof.field.alpha)
    cf.write_certificate(cf.prove(fan()), tmp_path / "again.npz")
    assert path.read_bytes() == (tmp_path / "again.npz").read_bytes()


def test_the_shortest_time_limit_leaves_a_bound_that_is_checked(tmp_path):
    proof = cf.prove(cf.sample("disc"), limits=cf.Limits(1e-9, gap=0.0))
    assert (proof.ended, len(proof.levels)) == ("time", 1)
    assert 0 < cf.write_certificate(proof, tmp_path / "disc.npz").bound == proof.bound
    assert cf.read_certificate(tmp_path / "disc.npz").bound == proof.bound


def test_levels_end_while_there_is_time_for_their_check(monkeypatch):
    # a clock by which the exclusions of a level take a second, in the prover and in the check
    seconds, complete = [], checker.kept_of
    monkeypatch.setattr(checker, "kept_of", lambda *parts: seconds.append(1) or complete(*parts))
    ends = Termination(Deadline.after(12, lambda: float(len(seconds))), never, gap=0.0, work=math.inf)
    proof = check_proof(*prove_orthogonal(cf.sample("disc").with_gauge("strokes"), None, ends, silent))
    assert proof.ended == "time"
    assert 0 < len(seconds) <= 12


def test_the_checker_runs_without_crossfield(tmp_path):
    certificate = tmp_path / "fan.npz"
    claim = cf.write_certificate(cf.prove(fan()), certificate)
    for module in (checker, check_certificate):
        shutil.copy(module.__file__, tmp_path)
    (tmp_path / "absent").mkdir()
    (tmp_path / "absent" / "crossfield.py").write_text("raise ImportError\n")

    def run(program, file):
        command = [sys.executable, tmp_path / program, file]
        environment = {**os.environ, "PYTHONPATH": str(tmp_path / "absent")}
        return subprocess.run(command, check=False, capture_output=True, text=True, env=environment)

    done = run("check_orthogonal.py", certificate)
    assert done.returncode == 0, done.stderr
    assert f"bound  {claim.bound!r}" in done.stdout
    assert "optimal: no field has less" in done.stdout
    done = run("check_certificate.py", certificate)
    assert (done.returncode, done.stdout.strip()[-25:]) == (2, "; run check_orthogonal.py")
    forged = pack_arrays(with_head(unpack_archive(certificate.read_bytes()), bound=2 * claim.energy))
    certificate.write_bytes(forged)
    done = run("check_orthogonal.py", certificate)
    assert (done.returncode, done.stdout[:23]) == (1, "refused: bound is claimed"[:23])


def test_turned_frames_and_meshes_have_the_same_optimum():
    energy = cf.prove(fan()).energy
    for turn, shift in ((0.7, 0), (0.0, 1), (2.1, 2)):
        proof = cf.prove(fan(turn, shift=shift))
        assert proof.status == "optimal"
        assert proof.energy == pytest.approx(energy, abs=1e-8)


def flat_square(turn):
    """A planar grid of triangles, turned, with strokes along its boundary that go along a wave."""
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0))
    c, s = math.cos(turn), math.sin(turn)
    vertices = np.c_[(c * x - s * y).ravel(), (s * x + c * y).ravel(), np.zeros(16)]
    at = np.arange(16).reshape(4, 4)
    a, b, d, e = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel()
    mesh = Mesh(vertices, np.concatenate([np.c_[a, b, e], np.c_[a, e, d]]).astype(np.int32))
    faces = np.array([0, 2, 6, 9, 12, 17])
    along = turn + np.array([0.1, 0.5, 0.8, 0.2, 1.1, 0.6])
    theta = mesh.angle_in(faces, np.c_[np.cos(along), np.sin(along), np.zeros(6)])
    return Instance.on_faces("square", mesh, faces, theta, np.ones(6), stroke_coefficient=20.0)


def test_a_planar_grid_has_the_optimum_of_its_rotated_copy():
    proofs = [cf.prove(flat_square(turn)) for turn in (0.0, 0.4)]
    assert {proof.status for proof in proofs} == {"optimal"}
    assert proofs[0].energy == pytest.approx(proofs[1].energy, abs=1e-8)


def test_a_grid_with_right_angles_is_proven(tmp_path):
    instance = replace(cf.sample("mouse", 8), orthogonal=True)
    proof = cf.prove(instance)
    assert proof.status == "optimal"
    assert not proof.field.beta.any()
    cf.write_instance(instance, tmp_path / "mouse.json")
    result = invoke(["prove", str(tmp_path / "mouse.json"), "-o", str(tmp_path), "--json"])
    report = json.loads(result.output) if hasattr(result, "output") else {}
    assert not report or report["status"] == "optimal"
    assert cf.read_certificate(tmp_path / f"{instance.name}.proof.certificate.npz").status == "optimal"
    with pytest.raises(InputError, match="norm 2 only"):
        cf.prove(instance, norm=1)


@pytest.fixture(scope="module")
def forgeable():
    """Certificates of a best field, with rings, and of a worse one, each with the optimum."""
    instance = fan()
    proof = cf.prove(instance)
    z = integers_of(proof.field)
    for pair in range(8):
        z[pair] += 1
        worse = prove_from(instance, z)
        if worse.energy > proof.energy + 1e-3:
            return proof.energy, [proof.certificate(), worse.certificate()]
    return None


def with_head(arrays, **changes):
    head = json.loads(arrays["head"].tobytes()) | changes
    return arrays | {"head": np.frombuffer(json.dumps(head).encode(), np.uint8)}


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
            for _ in range(1):
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


def test_files_that_are_no_certificate_are_refused(forgeable, tmp_path):
    _, (best, _) = forgeable
    path = tmp_path / "part.npz"
    data = pack_arrays(best)
    for cut in (10, len(data) // 2, len(data) - 30):
        path.write_bytes(data[:cut])
        with pytest.raises(InputError, match="certificate"):
            cf.read_certificate(path)
    path.write_bytes(pack_arrays({name: array for name, array in best.items() if name != "centre"}))
    with pytest.raises(InputError, match="centre"):
        cf.read_certificate(path)
    assert set(unpack_archive(data)) == set(best)
