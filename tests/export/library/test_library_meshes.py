"""Meshes in a library: next to a drawing, built, verified, shown, and answers to their files read back."""

import csv
import io
import shutil

import crossfield as cf
import pytest
from answers import by_highs
from libraries import defects, document, improve, library_of

SPEC = """formulations = ["exact", "milp", "qp", "cycle"]
[rungs.medium]
sizes = [4]
formats = ["mps"]
[rungs.mesh]
formats = ["mps", "nl"]
compress = true
gauges = ["strokes", "box"]
[[sketches]]
name = "rand"
random = "full"
seeds = [6]
points = "greedy"
[[sketches]]
name = "disc"
mesh = "disc"
points = "greedy"
"""
DISC = "cf_disc_f0054"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    return library_of(tmp_path_factory.mktemp("meshes"), SPEC)


def test_a_mesh_has_one_instance_per_gauge_named_after_its_faces(built):
    names = [f"cf_rand_n004_s6_{short}" for short in ("exact", "milp", "qp")]
    # Cycles are for orthogonal crosses, in a gauge with all labels; milp is in the 1-norm.
    names += [f"{DISC}_{short}" for short in ("exact", "qp", "cycle", "box_exact", "box_qp")]
    assert built.document["entries"] == names
    assert f"{DISC}_exact" in {one["entry"] for one in built.entry(f"{DISC}_cycle")["equivalent"]}
    instance, sample = cf.read_instance(built.folder / f"{DISC}.instance.json"), cf.sample("disc")
    assert instance.orthogonal
    assert instance.mesh.faces.tolist() == sample.mesh.faces.tolist()
    assert instance.theta.tolist() == sample.theta.tolist()
    assert instance.stroke_coefficient == sample.stroke_coefficient
    assert defects(built.folder) == {}


def test_sidecar_table_and_page_state_faces_for_meshes_and_pixels_for_grids(built):
    sidecar = built.entry(f"{DISC}_exact")
    assert sidecar["instance"]["faces"] == sidecar["source"]["size"] == 54
    assert sidecar["source"]["euler_characteristic"] == 1
    assert "height" not in sidecar["source"]
    rows = csv.DictReader(io.StringIO((built.folder / "entries.csv").read_text()))
    assert [(row["pixels"], row["faces"]) for row in rows] == [("16", "")] * 3 + [("", "54")] * 5
    assert (built.folder / "cf_disc.field.png").read_bytes()[:4] == b"\x89PNG"
    page = (built.folder / "index.html").read_text()
    assert "<option>mesh</option>" in page
    assert 'src="cf_disc.field.png"' in page


def test_an_optimum_and_a_proof_of_a_mesh_come_back(built, tmp_path):
    lib, sent = shutil.copytree(built.folder, tmp_path / "lib"), tmp_path / "sent"
    sent.mkdir()
    by_highs(lib / f"{DISC}_qp.mps.gz", sent / f"{DISC}_qp.sol")
    proof = cf.prove(cf.read_instance(lib / f"{DISC}.instance.json"), work=500, jobs=1)
    cf.write_certificate(proof, sent / "proof.npz")
    improved, refused = improve(lib, sent)
    assert refused == {}
    assert improved == {f"{DISC}_qp.sol": [], "proof.npz": [f"{DISC}_exact", f"{DISC}_cycle"]}
    assert document(lib, f"{DISC}_cycle")["bound"] == pytest.approx(proof.bound)
