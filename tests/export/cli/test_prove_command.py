"""The command `prove`: field, certificate and report, and the check of a certificate."""

import json
import subprocess
import sys
from importlib.resources import files

import crossfield as cf
import numpy as np
import pytest
from archives import pack_arrays
from command_line import invoke
from folders import contents

CHECKER = files("crossfield") / "models/proof/checkers/check_certificate.py"


def prove(folder, size, weight, *options):
    """Write a proof of the mouse to a folder; return its report, field and path of the certificate."""
    instance = cf.write_instance(cf.sample("mouse", size, stroke_weight=weight), folder / "mouse.json")
    command = ["prove", str(instance), "-o", str(folder / "out"), "--time-limit", "100", *options]
    assert invoke(command) == 0
    assert contents(folder / "out").keys() == {
        f"mouse.proof.{suffix}" for suffix in ("certificate.npz", "field.npz", "json")
    }
    report = json.loads((folder / "out" / "mouse.proof.json").read_text())
    field = cf.read_field(folder / "out" / "mouse.proof.field.npz")
    return report, field, folder / "out" / report["describes"]


@pytest.fixture(scope="module")
def proven(tmp_path_factory):
    return prove(tmp_path_factory.mktemp("proof"), 8, 0.3)


def test_field_certificate_and_report_agree(proven):
    report, field, certificate = proven
    assert report["status"] == report["ended"] == "optimal"
    assert certificate.name == "mouse.proof.certificate.npz"
    assert report["energy"] == pytest.approx(field.energy().total, abs=1e-12)
    assert report["bound"] == pytest.approx(report["energy"], abs=1e-8)
    assert report["forced_jumps"] == report["pairs"] == len(field.p)
    assert all(level["bound"] <= report["energy"] for level in report["levels"])


def test_a_proof_in_the_1_norm_is_checked_with_its_norm(tmp_path, capsys):
    report, field, certificate = prove(tmp_path, 4, 0.2, "--norm", "1")
    capsys.readouterr()
    assert invoke(["prove", "--check", str(certificate), "--json"]) == 0
    assert json.loads(capsys.readouterr().out).items() <= report.items()
    assert (report["norm"], report["status"]) == (1, "optimal")
    assert report["energy"] == pytest.approx(field.energy(1).total, abs=1e-12)


def test_certificates_are_checked(proven, capsys, tmp_path):
    report, _, certificate = proven
    assert invoke(["prove", "--check", str(certificate), "--json"]) == 0
    assert json.loads(capsys.readouterr().out).items() <= report.items()
    assert invoke(["prove", "--check", str(certificate)]) == 0
    assert "the certificate is valid" in capsys.readouterr().out
    command = [sys.executable, "-I", str(CHECKER), str(certificate)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "optimal: no field has less" in done.stdout
    arrays = dict(np.load(certificate))
    arrays["beta"] = arrays["beta"] + np.eye(1, len(arrays["beta"]), 2)[0] * 1e-5
    wrong = tmp_path / "wrong.npz"
    wrong.write_bytes(pack_arrays(arrays))
    assert invoke(["prove", "--check", str(wrong)]) == 1
    printed = capsys.readouterr().err
    assert "wrong.npz: is refused as a certificate: energy is claimed as" in printed
    assert printed.count("\n") == 1


def test_a_field_without_energy_is_proven_with_a_bound_of_0(tmp_path, capsys):
    """All edges of a cube are parallel to its crosses; rounding leaves an energy of some 1e-22."""
    assert invoke(["prove", "cube", "-o", str(tmp_path / "proof"), "--time-limit", "60"]) == 0
    capsys.readouterr()
    assert invoke(["prove", "--check", str(tmp_path / "proof" / "cube.proof.certificate.npz")]) == 0
    assert "the certificate is valid" in capsys.readouterr().out
