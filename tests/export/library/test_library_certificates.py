"""Certificates of a library: shipped, valid for all equivalent entries, and always checked."""

import json
import shutil
import subprocess
import sys
from dataclasses import replace

import crossfield as cf
import pytest
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.ledger.known_points import read_points
from crossfield.export.library.plan.recipe import NORMS, plan_library
from crossfield.export.library.plan.spec import default_spec
from crossfield.models.errors import CrossfieldError, InputError
from crossfield.models.proof.certificate import read_certificate, write_certificate
from forging import change, seal
from libraries import library_of, spec_of

pytestmark = [pytest.mark.usefixtures("short_searches"), pytest.mark.slow]

SPEC = """formulations = ["miqp-exact", "minlp-cubic", "milp-mccormick", "qp-fixed"]

[rungs.tiny]
sizes = [3]
formats = ["mps"]
gauges = ["strokes", "box"]

[[sketches]]
name = "rand"
random = "full"
seeds = [1, 2]
"""
STEM = "cf_rand_n003_s1"
CERTIFICATE = f"{STEM}.certificate.npz"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library of small instances under both gauges; not to be changed."""
    return library_of(tmp_path_factory.mktemp("certified"), SPEC).folder


@pytest.fixture
def lib(built, tmp_path):
    return shutil.copytree(built, tmp_path / "lib")


def document(lib, name):
    return json.loads((lib / f"{name}.json").read_text())


def defects(lib):
    seal(lib)
    return {defect.file: defect.what for defect in verify_library(lib)}


def test_a_certificate_proves_all_entries_that_minimise_its_norm(built):
    certificate = read_certificate(built / CERTIFICATE)
    assert certificate.status == "optimal"
    facts = (built / "library.solu").read_text()
    for token in ("exact", "cubic"):
        entry = document(built, f"{STEM}_{token}")
        (bound,) = entry["bounds"]
        assert (bound["bound"], bound["certificate"]) == (certificate.bound, CERTIFICATE)
        assert entry["status"] == "optimal"
        assert f"=opt= {STEM}_{token} " in facts
    (bound,) = document(built, f"{STEM}_milp")["bounds"]
    assert bound["certificate"] == f"{STEM}.l1.certificate.npz"
    assert read_certificate(built / bound["certificate"]).norm == 1
    for other in (f"{STEM}_qp", f"{STEM}_box_exact"):
        assert not [claim for claim in document(built, other)["bounds"] if "certificate" in claim]
    assert verify_library(built) == []


def test_it_lies_in_the_library_with_its_checksum_and_its_checker(built):
    assert CERTIFICATE in (built / "SHA256SUMS").read_text()
    assert CERTIFICATE in {
        facts["file"] for facts in document(built, f"{STEM}.about")["certificates"].values()
    }
    command = [sys.executable, built / "check_certificate.py", built / CERTIFICATE]
    assert subprocess.run(command, check=False, capture_output=True).returncode == 0
    assert (built / CERTIFICATE).stat().st_size < 100_000


def test_a_forged_certificate_is_found(lib):
    """The certificate of another instance, one of a worse field with the same claim, and changed bytes."""
    good, name = (lib / CERTIFICATE).read_bytes(), f"{STEM}.about.json"
    shutil.copy(lib / "cf_rand_n003_s2.certificate.npz", lib / CERTIFICATE)
    assert "is a certificate of another instance" in defects(lib)[CERTIFICATE]
    proof = cf.prove(cf.read_instance(lib / f"{STEM}.instance.json"), jobs=1)
    worse = replace(proof.field, beta=0.9 * proof.field.beta)
    weak = replace(proof.with_levels(1, "gap"), field=worse, energy=worse.energy().total)
    assert write_certificate(weak, lib / CERTIFICATE, force=True).status == "gap"
    assert "states another norm, status, bound or energy" in defects(lib)[name]
    half = len(good) // 2
    (lib / CERTIFICATE).write_bytes(good[:half] + bytes([good[half] ^ 1]) + good[half + 1 :])
    assert CERTIFICATE in defects(lib)


@pytest.mark.parametrize("key, value", [("bound", 99.0), ("status", "gap"), ("energy", 99.0)])
def test_points_that_claim_more_than_their_certificate_are_refused(lib, key, value):
    instance = cf.read_instance(lib / f"{STEM}.instance.json")
    assert read_points(lib)(STEM).certificates(instance, [2])[0].facts["status"] == "optimal"
    change(lib / f"{STEM}.about.json", **{f"certificates__2__{key}": value})
    with pytest.raises(InputError, match=f"{STEM}.about.json: states another norm, status, bound or energy"):
        read_points(lib)(STEM).certificates(instance, [2])


def test_points_with_a_certificate_of_another_instance_are_refused(lib):
    shutil.copy(lib / "cf_rand_n003_s2.certificate.npz", lib / CERTIFICATE)
    seal(lib)
    with pytest.raises(InputError, match="is a certificate of another instance"):
        read_points(lib)(STEM).certificates(cf.read_instance(lib / f"{STEM}.instance.json"), [2])


@pytest.mark.parametrize(
    "change_it, words",
    [
        (lambda path: change(path, title="half \ud800"), "half of a surrogate pair"),
        (lambda path: change(path, fields__least_2__seconds=float("inf")), "a number that is not finite"),
        (lambda path: change(path, name="cf_other"), "is about cf_other; its name must be cf_other.about"),
        (lambda path: change(path, certificates__2__file=f"{STEM}.another.npz"), "cannot be read"),
        (lambda path: change(path, version=True), "has version True"),
    ],
)
def test_points_with_a_damaged_document_are_refused(lib, change_it, words):
    change_it(lib / f"{STEM}.about.json")
    with pytest.raises(CrossfieldError, match=words):
        read_points(lib)


def test_a_rung_may_do_without(tmp_path):
    spec = spec_of(tmp_path, SPEC.replace("[3]", "[3]\nprove = false"))
    assert not any(planned.recipe.prove for planned in plan_library(spec))
    for shipped in plan_library(default_spec()):
        norms = (2,) if shipped.recipe.sketch.kind == "mesh" else NORMS  # of orthogonal crosses
        assert shipped.recipe.prove == (norms if shipped.recipe.gauge == "strokes" else ())
