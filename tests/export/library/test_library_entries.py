"""Entries of the library that ships, by name: the same as in a build, without one."""

import json
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.library.building.build import build
from crossfield.export.library.building.shipped_entries import POINTS, SHIPPED, write_entries
from crossfield.export.library.building.table import COLUMNS, TABLE, read_table
from crossfield.export.library.ledger.points import complete_point
from crossfield.export.library.plan.instances import make_instance
from crossfield.export.library.plan.recipe import plan_library
from crossfield.export.library.plan.spec import default_spec
from crossfield.models.errors import InputError
from crossfield.models.instance.file import instance_to_json
from folders import contents
from loops import for_each

REMEDY = "build `default` and copy its entries.csv to export/library/plan/entries.csv"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A part of the library that ships, built; not to be changed."""
    spec = default_spec()
    sketches = tuple(sketch for sketch in spec.sketches if sketch.name == "cyl")
    rungs = tuple(replace(rung, gauges=("strokes",)) for rung in spec.rungs if rung.name == "tiny")
    sketches = tuple(replace(sketch, rungs=("tiny",), sizes=sketch.sizes[:1]) for sketch in sketches)
    return build(replace(spec, sketches=sketches, rungs=rungs), tmp_path_factory.mktemp("built") / "library")


def models_of(sidecar):
    return [file["name"] for file in sidecar["files"] if file["format"] != "sol"]


def set_of(sidecar):
    """The files that belong to an entry without a library: models, manifest and instance."""
    return [*models_of(sidecar), f"{sidecar['name']}.manifest.json", sidecar["instance"]["file"]]


# The table


def test_the_table_that_ships_has_the_rows_of_a_build(built):
    rows = read_table(built.folder / TABLE)
    assert [row["name"] for row in rows] == built.document["entries"]
    for row in rows:
        assert cf.entry(row["name"]).facts == row, REMEDY


@pytest.mark.slow
def test_the_table_that_ships_is_that_of_a_build(tmp_path):
    library = build(default_spec(), tmp_path / "library", jobs=2)
    assert (library.folder / TABLE).read_bytes() == SHIPPED.read_bytes(), REMEDY


def test_the_facts_are_those_of_the_sidecars(built):
    for sidecar in built.entries:
        facts = cf.entry(sidecar["name"]).facts
        assert facts.keys() == COLUMNS.keys()
        assert facts["pairs"] == sidecar["instance"]["pairs"]
        assert facts["columns"] == sidecar["counts"]["variables"]
        assert facts["integers"] == sidecar["counts"]["binary"] + sidecar["counts"]["integer"]
        assert (facts["optimum"] is None) == (sidecar["status"] != "optimal")
        assert (facts["status"] == "open") == (facts["difficulty"] == "open")
        assert (built.folder / facts["jumps_file"]).is_file()


# Entries


@pytest.mark.parametrize("rung", ["tiny", pytest.param("all", marks=pytest.mark.slow)])
def test_the_instances_that_ship_are_those_of_a_build(rung):
    spec = default_spec()
    assert spec.points == POINTS
    for planned in plan_library(spec):
        if rung in {"all", planned.recipe.rung}:
            shipped = cf.entry(planned.entries[0].name).instance
            assert instance_to_json(shipped) == instance_to_json(make_instance(planned.recipe))


def test_model_files_have_the_bytes_of_a_build(built, tmp_path):
    chosen = [cf.entry(name) for name in built.document["entries"]]
    written = write_entries(tmp_path, chosen)
    assert written == {entry["name"]: set_of(entry) for entry in built.entries}
    assert set(contents(tmp_path)) == {name for names in written.values() for name in names}
    for name in {name for entry in built.entries for name in models_of(entry)}:
        assert (tmp_path / name).read_bytes() == (built.folder / name).read_bytes()


def test_an_entry_has_the_problem_and_the_point_of_its_sidecar(built):
    for sidecar in built.entries:
        entry = cf.entry(sidecar["name"])
        assert entry.instance.sha256 == sidecar["instance"]["sha256"]
        assert entry.problem.sha256 == sidecar["problem_sha256"]
        point = complete_point(entry.problem, entry.field)
        assert entry.problem.objective_value(point) == entry.objective == sidecar["best"]["objective"]
        assert (entry.bound, entry.status) == (sidecar["bound"], entry.facts["status"])
        assert f"{entry.name}: {entry.status}" in repr(entry)


@pytest.mark.parametrize(
    "name, norm",
    [("exact", 2), ("parity", 2), ("milp", 1), ("bilin1", 1), ("miqp", "mixed"), ("bilin", "mixed")],
)
def test_an_entry_has_the_certificate_of_its_norm(name, norm):
    proven = cf.entry(f"cf_cyl_n005_{name}")
    assert (proven.certificate.norm, proven.certificate.status) == (norm, "optimal")
    assert proven.certificate.bound <= proven.objective
    assert proven.objective == pytest.approx(proven.certificate.energy, rel=1e-6)


@pytest.mark.slow
def test_a_proof_finds_no_better_point_than_the_known_one():
    norms = {"minlp-parity": 2, "miqcp-bilinear": "mixed", "milp-mccormick": 1}
    drawn = [
        known
        for known in (*cf.entries(rung="medium"), *cf.entries(rung="large"))
        if known.facts["formulation"] in norms and not known.facts["tightened"]
    ]
    for entry in np.random.default_rng(0).choice(drawn, 5, replace=False):
        proof = cf.prove(entry.instance, norm=norms[entry.facts["formulation"]], work=3_000_000)
        assert proof.energy >= entry.objective * (1 - 1e-6), f"{entry.name}: {REMEDY}"
        assert proof.bound <= entry.objective * (1 + 1e-9)


def test_a_rung_selects_entries():
    assert {entry.facts["rung"] for entry in cf.entries(rung="tiny")} == {"tiny"}


@for_each(
    "name, near",
    [
        ("cf_mouse_n012_exact", "cf_mouse_n032_exact"),
        ("cf_skew_n008_mlip", "cf_skew_n008_milp"),
        ("x", "crossfield.entries() lists them"),
    ],
)
def test_an_unknown_entry_suggests_near_names(name, near):
    with pytest.raises(InputError, match=f"has no entry '{name}'") as error:
        cf.entry(name)
    assert near in str(error.value)


# The command


def test_files_of_the_user_are_not_replaced_by_those_of_an_entry(tmp_path, capsys):
    mine = tmp_path / "cf_cyl_n005.instance.json"
    mine.write_text("mine")
    command = ["library", "get", "cf_cyl_n005_exact", "-o", str(tmp_path), "--quiet"]
    assert invoke(command) == 1
    assert "cf_cyl_n005.instance.json: is not crossfield's, or has changed" in capsys.readouterr().err
    assert contents(tmp_path) == {mine.name: b"mine"}
    assert invoke([*command, "--force"]) == 0
    assert mine.read_text() != "mine"
    assert invoke(command) == 0


def test_the_command_writes_the_files_of_the_selected_entries(built, tmp_path, capsys):
    names = ["cf_cyl_n005_exact", "cf_cyl_n005_milp"]
    assert invoke(["library", "get", *names, "--rung", "tiny", "-o", str(tmp_path), "--json"]) == 0
    written = {name: set_of(built.entry(name)) for name in names}
    assert json.loads(capsys.readouterr().out) == written
    assert set(contents(tmp_path)) == {file for files in written.values() for file in files}


@pytest.mark.needs("highs")
@pytest.mark.parametrize(
    "name", ["cf_cyl_n005_milp", "cf_cyl_n005_printed_milp", "cf_saddle_n009_milp_tight"]
)
def test_the_answer_to_a_file_of_the_command_is_read_back(name, tmp_path, monkeypatch, capsys):
    """Two facets, and the narrower windows of a certificate, of one formulation in one folder."""
    import highspy

    monkeypatch.chdir(tmp_path)
    others = ["cf_cyl_n005_milp", "cf_cyl_n005_printed_milp"]
    assert invoke(["library", "get", name, *others, "-o", ".", "--quiet"]) == 0
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.readModel(next(str(path) for path in tmp_path.glob(f"{name}.mps*")))
    highs.run()
    highs.writeSolution(f"{name}.sol", 0)
    command = ["read", f"{name}.sol", "--manifest", f"{name}.manifest.json", "-o", "field.npz", "--json"]
    assert invoke(command) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["objective_recomputed"] == pytest.approx(cf.entry(name).objective, rel=1e-6)
    assert cf.read_field("field.npz").instance.sha256 == cf.entry(name).instance.sha256


BAD = {
    "nothing": ([], "name entries, or select them with --rung"),
    "unknown": (["cf_cyl_n005_mlip"], "or cf_cyl_n005_milp"),
    "rung": (["--rung", "huge"], "there is no rung 'huge'; choose one of tiny, small, medium, large, mesh"),
    "none": (["cf_cyl_n005_milp", "--rung", "large"], "no entry of the library that ships is selected"),
}


@for_each("case", BAD)
def test_a_bad_selection_is_one_line_and_writes_nothing(tmp_path, capfd, case):
    arguments, words = BAD[case]
    assert invoke(["library", "get", *arguments, "-o", str(tmp_path / "out")]) == 1
    shown = capfd.readouterr()
    assert shown.out == ""
    assert words in " ".join(shown.err.split())
    assert not (tmp_path / "out").exists()
