"""Meshes in a library: next to a drawing, built, verified, shown, and answers to their files read back."""

import gzip
import shutil

import crossfield as cf
import highspy
import pytest
from crossfield.export.library.building.table import read_table
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.plan.recipe import plan_library
from crossfield.export.library.plan.spec import spec_of as spec_of_document
from crossfield.models.errors import InputError
from libraries import improve, library_of, spec_of

pytestmark = pytest.mark.usefixtures("short_searches")

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
[[sketches]]
name = "disc"
mesh = "disc"
"""
DISC = "cf_disc_f0054"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    return library_of(tmp_path_factory.mktemp("meshes"), SPEC)


def test_a_mesh_has_one_instance_per_gauge_named_after_its_faces(built):
    names = [planned.recipe.name for planned in plan_library(built.spec)]
    assert names == ["cf_rand_n004_s6", DISC, f"{DISC}_box"]
    shorts = [name.rpartition("_")[2] for name in built.document["entries"]]
    # Cycles are for orthogonal crosses, in a gauge with all labels; milp is in the 1-norm.
    assert shorts == ["exact", "milp", "qp", *("exact", "qp", "cycle"), "exact", "qp"]
    related = {each["entry"] for each in built.entry(f"{DISC}_cycle")["equivalent"]}
    assert f"{DISC}_exact" in related
    instance, sample = cf.read_instance(built.folder / f"{DISC}.instance.json"), cf.sample("disc")
    assert instance.orthogonal
    assert instance.mesh.faces.tolist() == sample.mesh.faces.tolist()
    assert (instance.stroke_coefficient, instance.theta.tolist()) == (
        sample.stroke_coefficient,
        sample.theta.tolist(),
    )


def test_sidecar_and_table_state_faces_for_meshes_and_pixels_for_grids(built):
    sidecar = built.entry(f"{DISC}_exact")
    assert sidecar["instance"]["faces"] == sidecar["source"]["size"] == 54
    assert sidecar["source"]["euler_characteristic"] == 1
    assert "height" not in sidecar["source"]
    rows = {row["name"]: row for row in read_table(built.folder / "entries.csv")}
    sizes = [(row["pixels"], row["faces"]) for row in rows.values()]
    assert sizes == [(16, None)] * 3 + [(None, 54)] * 5


def test_a_library_of_meshes_is_what_a_build_makes_again(built):
    assert verify_library(built.folder) == []
    assert spec_of_document(built.document["spec"], built.folder / "library.json") == built.spec


def test_an_optimum_of_a_mesh_comes_back_as_a_better_point(built, tmp_path):
    lib = shutil.copytree(built.folder, tmp_path / "lib")
    name = f"{DISC}_qp"
    model = tmp_path / f"{name}.mps"
    model.write_bytes(gzip.decompress((lib / f"{name}.mps.gz").read_bytes()))
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.readModel(str(model))
    highs.run()
    answer = tmp_path / f"{name}.sol"
    highs.writeSolution(str(answer), 0)
    field = cf.search(cf.read_instance(lib / f"{DISC}_box.instance.json"), rounds=4, jobs=1).field
    cf.write_field(field, tmp_path / "better.json")
    (tmp_path / "sent").mkdir()
    for path in (answer, tmp_path / "better.json"):
        path.rename(tmp_path / "sent" / path.name)
    improved, refused = improve(lib, tmp_path / "sent")
    assert refused == {}
    assert improved[answer.name] == []
    assert "better.json" in improved


def test_the_page_shows_meshes_with_faces_and_pictures(built):
    assert (built.folder / "cf_disc.field.png").read_bytes()[:4] == b"\x89PNG"
    page = (built.folder / "index.html").read_text()
    assert "<option>mesh</option>" in page
    assert 'src="cf_disc.field.png"' in page


def test_the_certificate_of_a_mesh_that_ships_proves_its_entries():
    entry = cf.entry("cf_bracket_f0760_cycle")
    assert entry.status == "optimal"
    assert entry.certificate.status == "optimal"
    assert entry.certificate.bound == pytest.approx(entry.bound, rel=1e-12)
    assert not [one.name for one in cf.entries(rung="mesh") if one.name.endswith(("milp", "cycle1"))]


def test_a_mesh_may_be_on_the_rung_of_large_grids(tmp_path):
    text = SPEC.replace("[rungs.mesh]", "[rungs.large]\nsizes = [5]\nprove = true\n[rungs.mesh]")
    planned = plan_library(spec_of(tmp_path, text + 'rungs = ["large"]\n'))[-1]
    assert (planned.recipe.name, planned.recipe.rung, planned.recipe.prove) == (DISC, "large", (2,))
    assert [entry.formulation for entry in planned.entries] == ["miqp-exact", "qp-fixed", "miqp-cycle"]


MESH = '[[sketches]]\nname = "a"\nmesh = "disc"\n'
WRONG = {
    "a size": (
        f"[rungs.mesh]\n{MESH}sizes = {{ mesh = [4] }}\n",
        "sketches[0].sizes: .*meshes have their own",
    ),
    "sizes of the rung": (f"[rungs.mesh]\nsizes = [4]\n{MESH}", "rungs.mesh.sizes: .*meshes have their own"),
    "no rung": (
        f"[rungs.tiny]\nsizes = [4]\n{MESH}",
        "sketches[0].mesh: no rung takes it; add mesh to rungs",
    ),
    "no rung of pixels": (f"[rungs.mesh]\n{MESH.replace('mesh', 'sample', 1)}", "no rung takes it; add tiny"),
    "another rung": (
        f'[rungs.tiny]\nsizes = [4]\n[rungs.mesh]\n{MESH}rungs = ["tiny"]\n',
        "there is no rung 'tiny'; choose one of mesh",
    ),
    "an unknown mesh": (f"[rungs.mesh]\n{MESH.replace('disc', 'dish')}", "there is no mesh 'dish'; choose"),
    "strokes nearby": (f'[rungs.mesh]\n{MESH}points = "none"\n', "search, greedy or proven"),
    "a formulation on no rung": (
        f'formulations = ["milp", "qp"]\n[rungs.mesh]\n{MESH}',
        "no rung has milp-mccormick; omit milp-mccormick",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_specification_of_meshes_is_refused(tmp_path, case):
    text, words = WRONG[case]
    with pytest.raises(InputError, match=words.replace("[0]", r"\[0\]")):
        spec_of(tmp_path, text)
