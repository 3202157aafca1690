"""A run reports for every field its greatest gap to the least 2-norm energy, with a certificate."""

import json
import os
import subprocess
import sys

import crossfield as cf
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.cli.solve_command import _by_method
from crossfield.export.solving.methods import METHODS, Request
from crossfield.export.solving.proven import Proven
from crossfield.models.processes.deadline import Deadline
from crossfield.models.proof.certificate import read_certificate


@pytest.mark.slow
def test_a_run_says_what_is_proven_of_every_field(tmp_path, capsys):
    given = ["run", "skew", "--size", "4", "--time-limit", "20", "--threads", "1"]
    assert invoke([*given, "-o", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    report = json.loads((tmp_path / "report.json").read_text())
    certificate = read_certificate(tmp_path / report["proof"]["certificate"])
    assert report["proof"]["status"] == certificate.status == "optimal"
    assert report["proof"]["bound_2_norm"] == certificate.bound
    for row in report["methods"]:
        energy, gap = row["energy_2_norm"], row["gap_2_norm"]
        assert row["bound_2_norm"] == certificate.bound <= energy
        assert gap == (0.0 if row["proven_optimal"] else (energy - certificate.bound) / energy)
    rows = {row["method"]: row for row in report["methods"]}
    assert rows["prove"]["proven_optimal"] is rows[report["best"]]["proven_optimal"] is True
    assert rows["power"]["gap_2_norm"] > 0.01
    assert "least 2-norm energy, proven optimal: " in out
    assert f"{certificate.bound:.10g}; certificate: {tmp_path / 'certificate.npz'}" in out


@pytest.mark.parametrize("energy, gap, optimal", [(2.0, 0.0, True), (2.5, 0.2, False)])
def test_the_gap_is_relative_to_the_energy(tmp_path, energy, gap, optimal):
    facts = Proven(2.0, tmp_path).facts(energy)
    assert facts == {"bound_2_norm": 2.0, "gap_2_norm": gap, "proven_optimal": optimal}


def test_the_method_leaves_its_certificate_beside_the_field(tmp_path, capsys):
    given = ["solve", "mouse", "--size", "6", "-m", "prove", "--time-limit", "60", "--json"]
    assert invoke([*given, "-o", str(tmp_path)]) == 0
    facts = json.loads(capsys.readouterr().out)
    field = cf.read_field(tmp_path / "mouse.prove.field.npz")
    certificate = read_certificate(tmp_path / "mouse.prove.certificate.npz", on=field.instance)
    assert facts["energy_2_norm"] == pytest.approx(field.energy().total, rel=1e-12)
    assert (facts["proven_optimal"], facts["bound_2_norm"]) == (True, certificate.bound)
    assert METHODS["prove"].timed


def test_a_field_stands_where_no_time_is_left_for_its_certificate(tmp_path):
    request = Request(cf.sample("skew", 4), tmp_path)
    candidate, proven, path = _by_method("prove", request, Deadline(at=0.0))
    assert proven is None
    assert cf.read_field(path).energy().total == candidate.field.energy().total
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.slow
def test_what_proofs_compile_is_compiled_once_within_the_limit(tmp_path):
    def solve(seconds):
        command = [sys.executable, "-m", "crossfield", "solve", "skew", "--size", "4", "-m", "prove"]
        command += ["--time-limit", seconds, "-o", str(tmp_path / "out"), "--quiet"]
        settings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
        return subprocess.run(command, env=settings, capture_output=True, text=True, check=False)

    first = solve("1")
    assert first.returncode == 1
    assert "once per machine" in first.stderr
    assert solve("250").returncode == 0
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.nb?")}
    assert kept
    (tmp_path / "out" / "compiling.log").unlink()
    assert solve("100").returncode == 0
    assert kept == {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.nb?")}
    assert not (tmp_path / "out" / "compiling.log").exists()
