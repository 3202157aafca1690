"""A run reports for every field its greatest gap to the least 2-norm energy, with a certificate."""

import json
import os
import subprocess
import sys
from dataclasses import replace

import crossfield as cf
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.runs.proven import ProvenBound
from crossfield.models.proof.certificate import read_certificate


@pytest.mark.slow
def test_a_run_says_what_is_proven_of_every_field(tmp_path, capsys):
    command = ["run", "skew", "--size", "4", "--time-limit", "20", "--threads", "1"]
    assert invoke([*command, "-o", str(tmp_path)]) == 0
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
    facts = ProvenBound(2.0, tmp_path).facts(energy)
    assert facts == {"bound_2_norm": 2.0, "gap_2_norm": gap, "proven_optimal": optimal}


@pytest.mark.parametrize(
    "ended,words",
    [
        ("time", "the time limit ended before a bound was proven"),
        ("interrupted", "the proof was interrupted before its check confirmed a bound"),
        ("work", "the limit of work ended"),
        ("gap", "the requested gap allows the bound 0"),
    ],
)
def test_the_reason_of_a_missing_certificate_is_the_true_one(tmp_path, ended, words):
    proof = replace(cf.prove(cf.sample("skew", 4), work=1), bound=0.0, levels=(), ended=ended)
    with pytest.raises(cf.SolverError, match=words):
        ProvenBound.write(proof, tmp_path / "certificate.npz")


@pytest.mark.slow
def test_what_proofs_call_is_compiled_once_and_before_the_time_limit_begins(tmp_path):
    # The clock passes the time limit while the functions are compiled, and stands still otherwise.
    program = """
import crossfield as cf
from crossfield.models.processes.deadline import Deadline
from numba.core.event import install_recorder

lines = []
deadline = Deadline(500.0, lambda: 1000.0 * any("compiling" in line for line in lines))
with install_recorder("numba:compile") as compiled:  # a child process compiles
    proof = cf.prove(cf.sample("skew", 4), limits=cf.Limits(500.0).until(deadline), progress=lines.append)
    assert (proof.ended, proof.status, len(proof.levels) > 0) == ("optimal", "optimal", True)
    assert proof.seconds < 500
    cf.prove(cf.sample("mouse", 8), norm=1, work=1)
assert not compiled.buffer
"""

    def call(*command):
        settings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
        assert subprocess.run([sys.executable, *command], env=settings, check=False).returncode == 0
        times = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.nb?")}
        return {path: time for path, time in times.items() if not path.name.startswith("parts.")}

    kept = call("-c", program)
    assert any(path.name.startswith("clusters.") for path in kept)
    out = tmp_path / "out"
    options = ["--time-limit", "100", "-o", str(out), "--quiet"]
    assert kept == call("-m", "crossfield", "prove", "mouse", "--size", "8", *options)
    assert (out / "mouse.proof.certificate.npz").exists()


@pytest.mark.slow
def test_a_run_that_is_stopped_while_it_compiles_has_the_fields_of_untimed_methods(tmp_path):
    program = """
import sys
import crossfield as cf

seen = []
stop = lambda: "compiling" in seen[-1]
report = cf.run(cf.sample("skew", 4), sys.argv[1], limits=cf.Limits(1.0), progress=seen.append, stop=stop)
print(report.interrupted, [each.method for each in report.candidates])
"""
    settings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-c", program, str(tmp_path / "out")]
    done = subprocess.run(command, env=settings, capture_output=True, text=True, check=True)
    interrupted, methods = done.stdout.split(maxsplit=1)
    assert (interrupted, "'bend'" in methods, "'search'" in methods) == ("compiling", True, False)
    assert json.loads((tmp_path / "out" / "report.json").read_text())["interrupted"] == "compiling"
