"""Proofs from end to end: true for all weights, gauges and masks."""

import json
import math
import os
import re
import signal
import subprocess
import sys
import threading
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from command_line import invoke
from crossfield.models.processes.deadline import Deadline
from crossfield.models.proof.checkers import check_certificate
from crossfield.models.proof.descent import descent, orthogonal
from exhaustive import exact, random_instance, sketch
from instance_kinds import kind
from small_drawings import read, svg


def test_fields_with_a_vortex_are_proven_at_the_least_energy_over_all_jumps(tmp_path):
    vortices = 0
    for seed in range(24):
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


EMPTY = (
    "pixel",
    "pixels-apart",
    "strokes-weightless",
    "pixel-orthogonal-weightless",
    "triangle",
    "triangle-stroke",
    "triangles-apart",
)
"""Kinds whose best fields cost nothing."""


@pytest.mark.parametrize("name", EMPTY)
def test_an_instance_that_costs_nothing_is_proven_optimal(name, tmp_path):
    instance, path = kind(name), tmp_path / "it.npz"
    for norm in (2,) if instance.orthogonal else (2, 1, "mixed"):
        proof = cf.prove(instance, norm=norm, jobs=1)
        assert (proof.status, proof.ended, proof.bound) == ("optimal", "optimal", 0.0)
        assert proof.energy == pytest.approx(0.0, abs=1e-12)
        assert cf.write_certificate(proof, path).status == "optimal"
        assert cf.read_certificate(path, on=instance).bound == 0.0


@pytest.mark.slow
def test_a_centre_whose_other_line_carries_the_stroke_has_a_certificate(tmp_path):
    """The prover pruned more than the checker there, and its certificate was refused."""
    instance = cf.random_instance(978, size=5, stroke_weight=5 / 24, skew_weight=1e-6 * (5 / 24) ** 2)
    proof = cf.prove(instance, jobs=1)
    assert cf.write_certificate(proof, tmp_path / "it.npz").status == "optimal"


@pytest.mark.slow
def test_clusters_close_a_gap_that_finer_lattices_leave(tmp_path):
    """Without clusters the bound stays at 3.4859, however fine the lattice."""
    instance = random_instance(47, shape=(5, 5), strokes=25)
    instance = replace(instance, stroke_coefficient=30.0, skew_coefficient=1.0)
    proof = cf.prove(instance, jobs=2)
    assert proof.status == "optimal"
    assert cf.write_certificate(proof, tmp_path / "it.npz").status == "optimal"


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
        with pytest.raises(cf.InputError, match="choose the gauge strokes"):
            cf.read_certificate(tmp_path / "it.npz", on=instance)
        assert (
            cf.read_certificate(tmp_path / "it.npz", on=instance.with_gauge("strokes")).bound == proof.bound
        )
        with pytest.raises(cf.InstanceError, match="another instance"):
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
def test_a_proof_ends_at_the_last_level_that_its_checker_takes(monkeypatch, tmp_path):
    # with so little skew weight, levels get ever longer ranges; the room is less than usual, to save time
    circles = "".join(f'<circle cx="{x}" cy="50" r="15" fill="none" stroke="black"/>' for x in (30, 70))
    instance = read(svg(circles), size=9).with_weights(stroke_weight=1, skew_weight=1e-6)
    monkeypatch.setattr(check_certificate, "ROOM", 1 << 20)
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
        mesh = torus(126, 126)
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
    assert "the coarsest level has 12192768 pairs of labels" in error


def test_the_time_that_no_level_uses_goes_to_the_search(monkeypatch):
    # every line of progress is a tick of the clock: a round of the search
    monkeypatch.setattr(orthogonal, "_MOST_COSTS", 1000)
    instance, results = cf.sample("pin"), []
    for find in (cf.search, cf.prove):
        lines = []
        limits = cf.Limits(3.0, gap=0.0).until(Deadline(3.0, lambda lines=lines: float(len(lines))))
        results.append(find(instance, limits=limits, progress=lines.append, jobs=1))
    found, proof = results
    assert found.energies[0][1] > found.field.energy().total + 0.01
    assert proof.energy == pytest.approx(found.field.energy().total, rel=1e-9)
    assert (proof.ended, proof.levels) == ("time", ())
    assert proof.reason.startswith("the coarsest level has")


def test_limits_end_a_proof_with_what_it_has():
    instance = cf.sample("mouse", 8)
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
        with pytest.raises(cf.InputError):
            cf.prove(instance, **wrong)
    with pytest.raises(cf.InputError, match="norm 2 only"):
        cf.prove(replace(instance, orthogonal=True), norm=1)
    with pytest.raises(cf.InstanceError):
        cf.prove(instance, start=cf.greedy_field(cf.sample("bottle", 9)))


@pytest.mark.parametrize(
    "name, size, words, levels",
    [
        ("mouse", 24, "energy", 0),
        pytest.param("mouse", 8, "checked 2 of", 2, marks=pytest.mark.slow),
        ("bottle", 8, "checking the levels", 0),
    ],
)
def test_ctrl_c_ends_a_proof_with_the_levels_that_are_checked(name, size, words, levels, tmp_path):
    pressed = []

    def press(line):
        if line.startswith(words) and not pressed:
            pressed.append(line)
            signal.raise_signal(signal.SIGINT)

    try:
        proof = cf.prove(cf.sample(name, size), progress=press)
    except KeyboardInterrupt:  # which would end all tests
        pytest.fail("the interrupt is passed on")
    assert proof.ended == "interrupted"
    assert proof.energy == proof.field.energy().total >= proof.bound
    if words == "energy":  # the levels so far are checked
        assert (proof.status, len(proof.levels) > 0) == ("gap", True)
        return
    assert len(proof.levels) == levels
    if levels:
        cf.write_certificate(proof, tmp_path / "some.npz")
        read = cf.read_certificate(tmp_path / "some.npz", jobs=2)
        assert (read.bound, read.gap, read.forced) == (proof.bound, proof.gap, proof.forced)
    else:
        assert proof.bound == 0.0


@pytest.mark.slow
def test_a_proof_ends_where_no_finer_level_fits_in_memory(monkeypatch, tmp_path):
    monkeypatch.setattr(descent, "MOST_LABELS", 30_000)
    proof = cf.prove(cf.sample("ring", 12), jobs=1)
    assert (proof.ended, [round(np.pi / 2 / level.h) for level in proof.levels]) == ("labels", [16, 32])
    assert cf.write_certificate(proof, tmp_path / "it.npz").bound == proof.bound <= proof.energy
