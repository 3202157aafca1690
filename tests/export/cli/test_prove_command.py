"""The command `prove`: field, certificate and report, and the check of a certificate."""

import json
import subprocess
import sys

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.models.array_archive import pack_arrays
from crossfield.models.field.file import read_field
from crossfield.models.proof.checkers import check_certificate
from folders import contents


def write_instance(folder, size, weight):
    """The path of an instance of the mouse."""
    return str(cf.write_instance(cf.sample("mouse", size, stroke_weight=weight), folder / "mouse.json"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder that `prove` wrote for a small sample, and its report."""
    folder = tmp_path_factory.mktemp("proof")
    instance = write_instance(tmp_path_factory.mktemp("instance"), 8, 0.3)
    command = ["prove", instance, "-o", str(folder), "--time-limit", "100", "-q"]
    assert invoke(command) == 0
    (report,) = folder.glob("*.proof.json")
    return folder, json.loads(report.read_text())


def of(folder, suffix):
    (path,) = folder.glob(f"*.proof.{suffix}")
    return path


def test_field_certificate_and_report_agree(folder):
    folder, report = folder
    field = read_field(of(folder, "field.npz"))
    assert report["status"] == "optimal"
    assert report["ended"] == "optimal"
    assert report["energy"] == pytest.approx(field.energy().total, abs=1e-12)
    assert report["bound"] == pytest.approx(report["energy"], abs=1e-8)
    assert report["forced_jumps"] == report["pairs"] == len(field.p)
    assert all(level["bound"] <= report["energy"] for level in report["levels"])
    assert sorted(name.split(".", 1)[1] for name in contents(folder)) == [
        "proof.certificate.npz",
        "proof.field.npz",
        "proof.json",
    ]


def test_a_proof_in_the_1_norm_is_checked_with_its_norm(tmp_path, capsys):
    instance = write_instance(tmp_path, 4, 0.2)
    command = ["prove", instance, "--norm", "1", "--time-limit", "100", "--json"]
    assert invoke([*command, "-o", str(tmp_path)]) == 0
    report = json.loads(capsys.readouterr().out)
    assert invoke(["prove", "--check", str(of(tmp_path, "certificate.npz")), "--json"]) == 0
    assert json.loads(capsys.readouterr().out).items() <= report.items()
    field = read_field(of(tmp_path, "field.npz"))
    assert (report["norm"], report["status"]) == (1, "optimal")
    assert report["energy"] == pytest.approx(field.energy(1).total, abs=1e-12)


def test_certificates_are_checked(folder, capsys, tmp_path):
    folder, report = folder
    certificate = of(folder, "certificate.npz")
    assert invoke(["prove", "--check", str(certificate), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document.items() <= report.items()
    assert invoke(["prove", "--check", str(certificate)]) == 0
    assert "the certificate is valid" in capsys.readouterr().out
    command = [sys.executable, "-I", check_certificate.__file__, str(certificate)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "optimal: no field has less" in done.stdout
    arrays = check_certificate.read_arrays(str(certificate))
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
