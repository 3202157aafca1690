"""Proofs from end to end: true for all weights, gauges and masks."""

import json
import math
import os
import re
import subprocess
import sys
import threading
from dataclasses import replace
from itertools import pairwise

import crossfield as cf
import numpy as np
import pytest
from children import interrupted
from crossfield.export.cli.app import invoke
from crossfield.models.errors import InputError, InstanceError
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.symmetries import mirrored, transposed, turned
from crossfield.models.processes.deadline import Deadline
from crossfield.models.proof.checkers import check_certificate
from crossfield.models.proof.descent import orthogonal
from exhaustive import exact, optimum, random_instance, sketch
from small_drawings import read, svg

pytestmark = pytest.mark.numeric


def test_small_instances_are_proven_at_the_least_energy_over_all_jumps():
    """All jumps are tried by dense least squares, where no window binds."""
    for seed in range(12):
        instance = random_instance(seed, shape=(2, 2))
        proof = cf.prove(instance, jobs=1)
        assert proof.status == "optimal", seed
        assert proof.bound <= proof.energy <= proof.bound + 1e-9 * (1 + proof.energy)
        assert proof.energy == proof.field.energy().total
        low = exact(instance)
        assert proof.energy >= low - 1e-9
        if np.abs(proof.field.beta).max() < np.pi / 4 - 1e-6:
            assert proof.energy == pytest.approx(low, abs=1e-6), seed


def test_fields_with_a_vortex_are_proven_at_the_least_energy_over_all_jumps(tmp_path):
    vortices = 0
    for seed in range(60):
        theta = np.random.default_rng(seed).uniform(0, np.pi, (2, 3))
        instance = replace(sketch(np.ones((2, 3), bool), theta, 1.0), stroke_coefficient=30.0)
        if len(cf.greedy_field(instance).singularities.index) == 0:
            continue
        proof = cf.prove(instance, jobs=1)
        certificate = cf.write_certificate(proof, tmp_path / "it.npz")
        assert certificate.status == "optimal", seed
        assert certificate.bound <= exact(instance) + 1e-9
        vortices += len(proof.field.singularities.index)
    assert vortices


@pytest.mark.slow
def test_clusters_close_a_gap_that_finer_lattices_leave(tmp_path):
    """Without clusters the bound stays at 3.4859, however fine the lattice."""
    instance = random_instance(47, shape=(5, 5), strokes=25)
    instance = replace(instance, stroke_coefficient=30.0, skew_coefficient=1.0)
    proof = cf.prove(instance, jobs=2)
    assert proof.status == "optimal"
    assert cf.write_certificate(proof, tmp_path / "it.npz").status == "optimal"


def test_one_pixel_and_one_row_are_proven():
    for mask, theta in (([[True]], [[2.0]]), ([[True] * 5], [[0.3, np.nan, 1.2, np.nan, 2.9]])):
        proof = cf.prove(sketch(np.array(mask), np.array(theta)), jobs=1)
        assert proof.status == "optimal"


def test_the_proof_in_the_gauge_box_is_that_of_the_gauge_strokes():
    for seed in range(5):
        instance = random_instance(seed, shape=(2, 2), gauge="box")
        proof = cf.prove(instance, start=cf.greedy_field(instance), jobs=1)
        assert proof.status == "optimal"
        assert proof.field.instance.sha256 == instance.with_gauge("strokes").sha256
        assert proof.energy <= optimum(instance).energy().total + 1e-9


def test_results_of_a_proof_in_the_gauge_box_fit_its_instance_or_name_the_remedy(tmp_path, capsys):
    for instance in (random_instance(3, shape=(2, 2), gauge="box"), orthogonal_box()):
        proof = cf.prove(instance, jobs=1)
        begun = cf.search(instance, start=proof.field, rounds=0, jobs=1).field
        assert begun.instance.sha256 == instance.sha256
        assert begun.energy().total <= cf.greedy_field(instance).energy().total + 1e-9
        cf.write_certificate(proof, tmp_path / "it.npz")
        cf.write_field(proof.field, tmp_path / "field.npz")
        moved = cf.read_field(tmp_path / "field.npz", on=instance)
        assert moved.instance.sha256 == instance.sha256
        away = (moved.alpha - proof.field.alpha) / (np.pi / 2)
        clipped = np.isin(moved.alpha, [instance.alpha_lower, instance.alpha_upper])
        assert (clipped | (np.abs(away - np.round(away)) < 1e-9)).all()
        with pytest.raises(InputError, match="choose the gauge strokes"):
            cf.read_certificate(tmp_path / "it.npz", on=instance)
        assert (
            cf.read_certificate(tmp_path / "it.npz", on=instance.with_gauge("strokes")).bound == proof.bound
        )
        with pytest.raises(InstanceError, match="another instance"):
            cf.search(replace(instance, name="other"), start=proof.field, rounds=0)
        cf.write_instance(instance, tmp_path / "it.json")
        files = [str(tmp_path / name) for name in ("it.json", "field.npz", "again")]
        invoke(["prove", files[0], "--start", files[1], "-o", files[2], "--json"])
        assert json.loads(capsys.readouterr().out)["energy"] <= proof.energy + 1e-12


def orthogonal_box():
    return replace(random_instance(5, shape=(2, 3), gauge="box"), orthogonal=True)


def test_a_check_without_memory_gives_its_reason_and_is_not_repeated(tmp_path):
    program = """if True:
        import resource
        from dataclasses import replace
        import crossfield as cf

        checks = []

        def leave_no_memory(line):
            if line == "checking the levels":
                checks.append(line)
                used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
                resource.setrlimit(resource.RLIMIT_AS, (used + 2**20, resource.RLIM_INFINITY))

        instance = replace(cf.sample("mouse", 24), orthogonal=True)
        proof = cf.prove(instance, jobs=1, progress=leave_no_memory, work=1)
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        print(len(checks), proof.bound, len(proof.levels), proof.energy == proof.field.energy().total)
        try:
            cf.write_certificate(proof, "it.npz")
        except cf.CrossfieldError as error:
            print(error)
    """
    command = [sys.executable, "-c", program]
    freed = os.environ | {"MALLOC_MMAP_THRESHOLD_": "65536", "MALLOC_TRIM_THRESHOLD_": "0"}  # at once
    result = subprocess.run(command, cwd=tmp_path, env=freed, capture_output=True, text=True, check=True)
    counts, error = result.stdout.splitlines()
    assert counts == "1 0.0 0 True"
    assert "the check of its levels takes more memory than there is" in error
    assert not (tmp_path / "it.npz").exists()


@pytest.mark.slow
@pytest.mark.parametrize("room", [1 << 20, 1 << 22])
def test_a_proof_ends_at_the_last_level_that_its_checker_takes(room, monkeypatch, tmp_path):
    # with so little skew weight, levels get ever longer ranges; the room is less than usual, to save time
    circles = "".join(f'<circle cx="{x}" cy="50" r="15" fill="none" stroke="black"/>' for x in (30, 70))
    instance = read(svg(circles), size=9).with_weights(stroke_weight=1, skew_weight=1e-6)
    monkeypatch.setattr(check_certificate, "ROOM", room)
    proof = cf.prove(instance, jobs=1)
    assert (proof.ended, proof.reason) == ("labels", "")
    assert 0 < proof.bound < proof.energy
    cf.write_certificate(proof, tmp_path / "it.npz")
    assert cf.read_certificate(tmp_path / "it.npz", on=instance).bound == proof.bound


@pytest.mark.slow
def test_a_mesh_whose_levels_do_not_fit_has_the_field_of_its_search_and_the_reason(tmp_path):
    program = """if True:
        import resource
        import numpy as np
        import crossfield as cf
        from crossfield.models.instance.instance import Instance
        from crossfield.models.mesh.shapes import torus

        resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
        mesh = torus(150, 150)
        at = np.arange(0, mesh.size, 50)
        instance = Instance.on_faces("torus", mesh, at, np.linspace(0, 3, len(at)), np.ones(len(at)))
        lines = []
        proof = cf.prove(instance, stop=lambda: len(lines) > 2, progress=lines.append)
        print(proof.ended, len(proof.levels), proof.energy <= cf.greedy_field(instance).energy().total)
        try:
            cf.write_certificate(proof, "it.npz")
        except cf.CrossfieldError as error:
            print(error)
    """
    command = [sys.executable, "-c", program]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    counts, error = result.stdout.splitlines()
    assert counts == "interrupted 0 True"
    assert "the coarsest level has 17280000 pairs of labels" in error


def test_the_time_that_no_level_uses_goes_to_the_search(monkeypatch):
    # every line of progress is a tick of the clock: a round of the search
    monkeypatch.setattr(orthogonal, "_MOST_COSTS", 1000)
    instance, results = cf.sample("half_torus"), []
    for find in (cf.search, cf.prove):
        lines = []
        limits = cf.Limits(6.0, gap=0.0).until(Deadline(6.0, lambda lines=lines: float(len(lines))))
        results.append(find(instance, limits=limits, progress=lines.append, jobs=1))
    found, proof = results
    assert found.energies[0][1] > found.field.energy().total + 0.01
    assert proof.energy == pytest.approx(found.field.energy().total, rel=1e-9)
    assert (proof.ended, proof.levels) == ("time", ())
    assert proof.reason.startswith("the coarsest level has")


def test_turned_and_mirrored_sketches_have_the_same_proven_optimum():
    instance = random_instance(8, shape=(4, 3))
    proofs = [
        cf.prove(moved, jobs=1)
        for moved in (instance, turned(instance), mirrored(instance), transposed(instance))
    ]
    assert {proof.status for proof in proofs} == {"optimal"}
    np.testing.assert_allclose([proof.energy for proof in proofs], proofs[0].energy, atol=1e-8)


def test_the_levels_are_a_chain_round_one_centre_and_its_bound_is_theirs():
    proof = cf.prove(random_instance(4, shape=(4, 4)), jobs=1)
    for number, level in enumerate(proof.levels):
        at = f"level_{number}_"
        size = proof.arrays[f"{at}ranges"][:, 1::2].astype(int).prod(axis=1)
        allowed = np.unpackbits(proof.arrays[f"{at}allowed"], count=size.sum())
        grid = proof.field.instance.grid
        labels = np.add.reduceat(allowed, np.cumsum(size) - size, dtype=int)
        assert len(proof.arrays[f"{at}share_steps"]) == labels[np.minimum(grid.first, grid.second)].sum()
        assert len(set(proof.arrays[f"{at}share_unit"])) == 1
        assert labels.sum() == level.size
        assert level.bound <= proof.energy
        assert level.h == proof.arrays[f"{at}h"]
    for before, after in pairwise(proof.levels):
        narrower = after.h == before.h and after.size < before.size
        assert narrower or after.h == before.h / 2


def test_the_same_arguments_give_the_same_proof_for_any_number_of_threads():
    instance = cf.sample("bottle", 12)
    one, two = (cf.prove(instance, jobs=1, limits=cf.Limits(math.inf, 0.01, threads)) for threads in (1, 2))
    assert one.bound == two.bound
    assert one.field.alpha.tobytes() == two.field.alpha.tobytes()


def test_limits_end_a_proof_with_what_it_has():
    instance = cf.sample("mouse", 12)
    lines = []
    some = cf.prove(instance, limits=cf.Limits(math.inf, 0.5), progress=lines.append)
    assert some.ended == "gap"
    assert 0 < some.gap <= 0.5
    begin, count = lines.index("checking the levels"), len(some.levels)
    assert lines[begin + 1 :] == [f"checked {number + 1} of {count} levels" for number in range(count)]
    for line in lines[:begin]:
        energy, bound, labels = re.fullmatch(r"energy (\S+), bound (\S+), (\d+) labels", line).groups()
        assert float(bound) <= float(energy)
        assert int(labels) > 0
    asked = threading.Event()
    asked.set()
    for stop in (asked, lambda: True):
        none = cf.prove(instance, stop=stop)
        assert none.ended == "interrupted"
        assert none.bound <= some.energy
    short = cf.prove(instance, limits=cf.Limits(1e-6))
    assert short.ended == "time"
    little = cf.prove(instance, work=1)
    assert little.ended == "work"
    assert little.bound <= some.energy
    for wrong in ({"jobs": 0}, {"jobs": 0, "limits": cf.Limits(1.0, threads=1)}, {"norm": 3}, {"stop": 3}):
        with pytest.raises(InputError):
            cf.prove(instance, **wrong)
    with pytest.raises(InstanceError):
        cf.prove(instance, start=cf.greedy_field(cf.sample("bottle", 11)))


@pytest.mark.slow
def test_ctrl_c_ends_a_proof_with_what_it_has():
    program = (
        "import crossfield as cf\n"
        "lines = lambda line: print(line.split()[-2], flush=True)\n"
        "proof = cf.prove(cf.sample('mouse', 24), progress=lines)\n"
        "print(proof.ended, proof.status, proof.bound <= proof.energy)"
    )
    assert interrupted(program) == ["interrupted", "gap", "True"]


@pytest.mark.parametrize("size", [8, pytest.param(24, marks=pytest.mark.slow)])
def test_ctrl_c_in_the_check_keeps_the_levels_that_are_checked(size, tmp_path):
    program = f"""if True:
        import time
        import crossfield as cf

        def wait(line):
            if line.startswith("checked 2 of"):
                print(1, flush=True)
                time.sleep(600)

        proof = cf.prove(cf.sample("mouse", {size}), progress=wait)
        cf.write_certificate(proof, "some.npz")
        read = cf.read_certificate("some.npz", jobs=2)
        same = (read.bound, read.gap, read.forced) == (proof.bound, proof.gap, proof.forced)
        print(proof.ended, len(proof.levels), same)
    """
    assert interrupted(program, tmp_path) == ["interrupted", "2", "True"]


def test_ctrl_c_before_a_level_is_checked_keeps_the_field():
    program = """if True:
        import time
        import crossfield as cf

        def wait(line):
            if line == "checking the levels":
                print(1, flush=True)
                time.sleep(600)

        proof = cf.prove(cf.sample("bottle", 8), progress=wait)
        print(proof.ended, proof.bound, len(proof.levels), proof.energy == proof.field.energy().total)
    """
    assert interrupted(program) == ["interrupted", "0.0", "0", "True"]


def weighted(seed, **weights):
    """A random instance with a hole and a part without strokes."""
    rng = np.random.default_rng(seed)
    mask = np.ones((3, 5), bool)
    mask[1, 1] = mask[:, 3] = False
    at = np.argwhere(mask[:, :3])[np.sort(rng.permutation(8)[:4])]
    return Instance.on_pixels("holes", mask, at, rng.uniform(0, np.pi, 4), 1 - rng.random(4), **weights)


@pytest.mark.slow
def test_a_stroke_that_either_line_may_carry_leaves_no_gap():
    """At the end one box crosses an edge of its window, on lattices of any spacing."""
    instance = weighted(3, stroke_coefficient=0.1)
    proof = cf.prove(instance, jobs=1)
    assert proof.status == "optimal"
    assert (
        proof.forced == (instance.grid.columns[instance.grid.first] < 3).sum()
    )  # the other part has no stroke
