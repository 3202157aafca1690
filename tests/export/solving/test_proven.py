"""A run tells of every field how far from the least 2-norm energy it is at most, with a certificate of it."""

import json

import crossfield as cf
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.solving.methods import METHODS
from crossfield.export.solving.proven import Proven, certified
from crossfield.models.proof.certificate import read_certificate


def test_a_run_says_what_is_proven_of_every_field(tmp_path, capsys):
    given = ["run", "skew", "--size", "6", "--time-limit", "5", "--threads", "1"]
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
    assert "kept, the least 2-norm energy, proven optimal" in out
    assert f"{certificate.bound:.10g}; certificate: {tmp_path / 'certificate.npz'}" in out


@pytest.mark.parametrize("energy, gap, optimal", [(2.0, 0.0, True), (2.5, 0.2, False)])
def test_the_gap_is_relative_to_the_energy(tmp_path, energy, gap, optimal):
    facts = Proven(2.0, tmp_path).facts(energy)
    assert facts == {"bound_2_norm": 2.0, "gap_2_norm": gap, "proven_optimal": optimal}


def test_without_a_proof_there_is_neither_a_number_nor_the_certificate_of_yesterday(tmp_path):
    path = tmp_path / "certificate.npz"
    path.write_bytes(b"of yesterday")
    assert certified(None, path) is None
    assert not path.exists()


def test_the_method_leaves_its_certificate_beside_the_field(tmp_path, capsys):
    given = ["solve", "skew", "--size", "6", "-m", "prove", "--time-limit", "5", "--json"]
    assert invoke([*given, "-o", str(tmp_path)]) == 0
    facts = json.loads(capsys.readouterr().out)
    field = cf.read_field(tmp_path / "skew.prove.field.npz")
    certificate = read_certificate(tmp_path / "skew.prove.certificate.npz", on=field.instance)
    assert facts["energy_2_norm"] == pytest.approx(field.energy().total, rel=1e-12)
    assert (facts["proven_optimal"], facts["bound_2_norm"]) == (True, certificate.bound)
    assert METHODS["prove"].timed
