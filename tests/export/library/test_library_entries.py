"""Entries of the library that ships, by name: the same as in a build, without one."""

import json
from dataclasses import replace

import crossfield as cf
import pytest
from command_line import invoke
from crossfield.export.library.building.build import build
from crossfield.export.library.building.shipped_entries import SHIPPED
from crossfield.export.library.ledger.points import complete_point
from crossfield.export.library.plan.instances import make_instance
from crossfield.export.library.plan.recipe import plan_library
from crossfield.export.library.plan.spec import default_spec
from folders import contents
from loops import for_each

REMEDY = "build `default` and copy its entries.csv to export/library/plan/entries.csv"


def build_part(folder, names, **changed):
    """Build the tiny instances of the library that ships, of some sketches alone if they are named."""
    spec = default_spec()
    rungs = [replace(rung, gauges=("strokes",), **changed) for rung in spec.rungs if rung.name == "tiny"]
    sketches = [
        replace(sketch, rungs=("tiny",), sizes={key: sketch.sizes[key] for key in {*sketch.sizes} & {"tiny"}})
        for sketch in spec.sketches
        if "tiny" in sketch.rungs and sketch.name in (names or [sketch.name])
    ]
    return build(replace(spec, sketches=tuple(sketches), rungs=tuple(rungs)), folder / "library")


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The smallest instance of one sketch; not to be changed."""
    return build_part(tmp_path_factory.mktemp("built"), ["cyl"])


def models_of(sidecar):
    return [file["name"] for file in sidecar["files"] if file["format"] != "sol"]


def set_of(sidecar):
    """The files that belong to an entry without a library: models, manifest and instance."""
    return [*models_of(sidecar), f"{sidecar['name']}.manifest.json", sidecar["instance"]["file"]]


@pytest.mark.slow
def test_the_table_and_the_instances_that_ship_are_those_of_a_build(tmp_path):
    """The points that ship are about them, so nothing is searched; the table depends on no format."""
    library = build_part(tmp_path, None, formats=("nl",))
    assert (library.notices, library.failed, library.skipped) == ([], {}, {})
    _, *rows = (library.folder / "entries.csv").read_text().splitlines()
    assert {*rows} == {row for row in SHIPPED.read_text().splitlines() if ",tiny,strokes," in row}, REMEDY
    for planned in plan_library(default_spec()):
        (shipped,) = cf.entries(planned.entries[0].name)
        assert shipped.instance.sha256 == make_instance(planned).sha256


def test_entries_have_the_facts_problems_points_and_files_of_a_build(built, tmp_path, capsys):
    for sidecar in built.entries:
        (entry,) = cf.entries(sidecar["name"])
        facts = entry.facts
        assert facts["pairs"] == sidecar["instance"]["pairs"]
        assert facts["columns"] == sidecar["counts"]["variables"]
        assert facts["integers"] == sidecar["counts"]["binary"] + sidecar["counts"]["integer"]
        assert (facts["optimum"] is None) == (sidecar["status"] != "optimal")
        assert (facts["status"] == "open") == (facts["difficulty"] == "open")
        assert (built.folder / facts["jumps_file"]).is_file()
        assert entry.instance.sha256 == sidecar["instance"]["sha256"]
        assert entry.problem.sha256 == sidecar["problem_sha256"]
        assert entry.objective == sidecar["best"]["objective"]
        point = complete_point(entry.problem, entry.field)
        assert entry.problem.objective_value(point) == entry.objective
        assert entry.problem.violation(point).worst <= 1e-12
        assert (entry.bound, entry.status) == (sidecar["bound"], facts["status"])
        assert f"{entry.name}: {entry.status}" in repr(entry)
    names = built.document["entries"]
    assert [entry.name for entry in cf.entries(rung="tiny") if entry.name in names] == names
    assert invoke(["library", "get", *names, "--rung", "tiny", "-o", str(tmp_path), "--json"]) == 0
    written = {sidecar["name"]: set_of(sidecar) for sidecar in built.entries}
    assert json.loads(capsys.readouterr().out) == written
    assert set(contents(tmp_path)) == {name for files in written.values() for name in files}
    for name in {name for sidecar in built.entries for name in models_of(sidecar)}:
        assert (tmp_path / name).read_bytes() == (built.folder / name).read_bytes()


@pytest.mark.parametrize(
    "name, norm",
    [("exact", 2), ("parity", 2), ("milp", 1), ("bilin1", 1), ("miqp", "mixed"), ("bilin", "mixed")],
)
def test_an_entry_has_the_certificate_of_its_norm(name, norm):
    (proven,) = cf.entries(f"cf_cyl_n005_{name}")
    assert (proven.certificate.norm, proven.certificate.status) == (norm, "optimal")
    assert proven.certificate.bound <= proven.objective
    assert proven.objective == pytest.approx(proven.certificate.energy, rel=1e-6)


def test_the_certificate_of_a_mesh_proves_its_entry():
    (entry,) = cf.entries("cf_bracket_f0760_cycle")
    assert (entry.status, entry.certificate.status) == ("optimal", "optimal")
    assert entry.certificate.bound == pytest.approx(entry.bound, rel=1e-12)


# The command


def test_files_of_the_user_are_not_replaced_by_those_of_an_entry(tmp_path, capsys):
    mine = tmp_path / "cf_cyl_n005.instance.json"
    mine.write_text("mine")
    command = ["library", "get", "cf_cyl_n005_exact", "-o", str(tmp_path)]
    assert invoke(command) == 1
    assert "cf_cyl_n005.instance.json: is not crossfield's, or has changed" in capsys.readouterr().err
    assert contents(tmp_path) == {mine.name: b"mine"}
    assert invoke([*command, "--force"]) == 0
    assert mine.read_text() != "mine"
    assert invoke(command) == 0


@pytest.mark.needs("highs")
def test_the_answers_to_files_of_one_folder_are_read_back(tmp_path, monkeypatch, capsys):
    """The plain windows and the narrower ones of a certificate, of one formulation in one folder."""
    import highspy

    monkeypatch.chdir(tmp_path)
    names = ["cf_saddle_n009_milp", "cf_saddle_n009_milp_tight"]
    assert invoke(["library", "get", *names, "-o", "."]) == 0
    for name in names:
        (entry,), highs = cf.entries(name), highspy.Highs()
        highs.setOptionValue("output_flag", False)
        highs.readModel(next(str(path) for path in tmp_path.glob(f"{name}.mps*")))
        for column, value in enumerate(entry.problem.point(entry.field).tolist()):
            if entry.problem.integer[column]:  # whole numbers of the optimum, so that the solve is short
                highs.changeColBounds(column, value, value)
        highs.run()
        highs.writeSolution(f"{name}.sol", 0)
        capsys.readouterr()
        command = ["read", f"{name}.sol", "--manifest", f"{name}.manifest.json", "-o", f"{name}.npz"]
        assert invoke([*command, "--json"]) == 0
        facts = json.loads(capsys.readouterr().out)
        assert facts["objective_recomputed"] == pytest.approx(entry.objective, rel=1e-6)
        assert cf.read_field(f"{name}.npz").instance.sha256 == entry.instance.sha256


@for_each(
    "arguments, words",
    [
        ([], "name entries, or select them with --rung"),
        (["cf_cyl_n005_mlip"], "or cf_cyl_n005_milp"),
        (["--rung", "huge"], "there is no rung 'huge'; choose one of tiny, small, medium, large, mesh"),
        (["cf_cyl_n005_milp", "--rung", "large"], "no entry of the library that ships is selected"),
    ],
)
def test_a_bad_selection_is_one_line_and_writes_nothing(tmp_path, capfd, arguments, words):
    assert invoke(["library", "get", *arguments, "-o", str(tmp_path / "out")]) == 1
    shown = capfd.readouterr()
    assert shown.out == ""
    assert words in " ".join(shown.err.split())
    assert not (tmp_path / "out").exists()
