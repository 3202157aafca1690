"""Builds of a specification: content, correctness, and the same bytes in every way."""

import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from typing import Final

import casadi
import highspy
import jsonschema
import numpy as np
import places
import pytest
from cases import SKEWED
from children import command_lines, complaints, descendants
from crossfield.export.cli.app import invoke
from crossfield.export.library.building.build import build, rebuild
from crossfield.export.library.building.fields import improve_in_1norm
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.documents.documents import problem_of, read_library
from crossfield.export.library.documents.lock import library_lock
from crossfield.export.library.documents.statistics import tangent_bound
from crossfield.export.library.plan.instances import make_instance
from crossfield.export.library.plan.recipe import plan_library
from crossfield.export.library.plan.spec import read_spec
from crossfield.export.solutions.solution import read_solution
from crossfield.models.errors import InputError, OutputError
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.problem import formulate
from crossfield.models.instance.file import read_instance
from crossfield.models.samples.samples import sample
from crossfield.models.search.greedy import greedy_field
from crossfield.models.sketch.publication import svg_of_curves
from crossfield.models.sketch.samples import sample_svg
from crossfield.models.sketch.svg import read_svg
from crossfield.models.written_files import LIST
from libraries import HEAD, content, library_of, spec_of
from loops import for_each

SMALL: Final = """formulations = ["qp", "exact"]
[rungs.tiny]
sizes = [3]
formats = ["mps"]
[[sketches]]
name = "rand"
random = "full"
seeds = [1]
points = "greedy"
"""
SCHEMAS = places.ROOT / "export" / "library" / "documents"

SPEC = (
    HEAD
    + """
[rungs.tiny]
sizes = [4]
formats = ["nl", "gms", "lp", "mps"]
gauges = ["strokes", "box"]
facets = ["hull", "printed"]

[rungs.medium]
sizes = [6]
formats = ["nl", "mps"]
compress = true

[[sketches]]
name = "own"
file = "drawn by hand.svg"
rungs = ["tiny"]

[[sketches]]
name = "rand"
random = "ragged"
seeds = [2]
rungs = ["medium"]
"""
)


def write_spec(folder, text=SPEC):
    """A specification in a folder, beside the drawing that it names."""
    (folder / "drawn by hand.svg").write_text(sample_svg("mouse"))
    path = folder / "spec.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def searched(short_searches, tmp_path_factory):
    """A library whose points come from short searches; not to be changed."""
    folder = tmp_path_factory.mktemp("searched")
    return build(read_spec(write_spec(folder)), folder / "library")


@pytest.fixture(scope="module")
def spec(searched, tmp_path_factory):
    """The specification with those points, so that builds in other processes do not search either."""
    folder = tmp_path_factory.mktemp("spec")
    return write_spec(folder, f'points = "{searched.folder}"\n' + SPEC)


@pytest.fixture(scope="module")
def built(spec, tmp_path_factory):
    """The library of the specification, built in this process; not to be changed."""
    return build(read_spec(spec), tmp_path_factory.mktemp("built") / "library")


@pytest.fixture
def copy(built, tmp_path):
    """A copy that a test may change."""
    shutil.copytree(built.folder, tmp_path / "library")
    return tmp_path / "library"


def by_formulation(library, instance, facet="hull"):
    return {
        entry["formulation"]: entry
        for entry in library.entries
        if entry["instance"]["file"] == f"{instance}.instance.json" and entry["options"]["facet"] == facet
    }


# The specification


RUNG = "[rungs.tiny]\nsizes = [4]\n"
SKETCH = '[[sketches]]\nname = "a"\nsample = "mouse"\n'
BAD = {
    "no TOML": ("[[[", "not valid TOML"),
    "another kind": (
        'format = "x"\n',
        "; write format, version, title, tables [rungs.NAME] and [[sketches]]",
    ),
    "unknown key": (
        HEAD + 'colour = "red"\n' + RUNG + SKETCH,
        "('colour' was unexpected); write format, version, title",
    ),
    "unknown key of a rung": (
        HEAD + RUNG + "speed = 1\n" + SKETCH,
        "rungs.tiny: Additional properties are not allowed ('speed' was unexpected); write a table",
    ),
    "no rung": (HEAD + SKETCH, "'rungs' is a required property; write"),
    "no sketch": (HEAD + RUNG, "'sketches' is a required property; write"),
    "size too large": (
        HEAD + "[rungs.tiny]\nsizes = [1000]\n" + SKETCH,
        "sizes[0]: 1000 is greater than the maximum of 999",
    ),
    "size twice": (HEAD + RUNG + "[rungs.small]\nsizes = [4]\n" + SKETCH, "a has size 4 on two rungs"),
    "no facet of a formulation": (
        HEAD + 'formulations = ["parity", "milp"]\nfacets = ["printed"]\n' + RUNG + SKETCH,
        "formulations: minlp-parity has no facet 'printed'; add hull to facets, or omit minlp-parity",
    ),
    "a rung without entries": (
        HEAD
        + 'formulations = ["cubic"]\n'
        + RUNG
        + '[rungs.small]\nsizes = [5]\nfacets = ["printed"]\n'
        + SKETCH,
        "rungs.small.facets: none of the formulations has the facet 'printed'; add hull",
    ),
    "entries without a model file": (
        HEAD + 'formulations = ["milp", "parity"]\n' + RUNG + 'formats = ["lp", "mps"]\n' + SKETCH,
        "rungs.tiny.formats: none of lp, mps holds minlp-parity; add nl or gms, or omit the formulation",
    ),
    "duplicate name": (HEAD + RUNG + SKETCH + SKETCH, "sketches[1].name: 'a' is the name of two sketches"),
    "name with a path": (
        HEAD + RUNG + SKETCH.replace('"a"', '"../a"'),
        "sketches[0].name: '../a' does not match",
    ),
    "name too long": (
        HEAD
        + 'formulations = ["milp-mccormick"]\n'
        + RUNG
        + 'facets = ["printed"]\ngauges = ["box"]\n'
        + SKETCH.replace('"a"', '"abcdefghijklmn"'),
        "has 39 characters; shorten",
    ),
    "missing file": (
        HEAD + RUNG + '[[sketches]]\nname = "a"\nfile = "gone.svg"\n',
        "sketches[0].file: there is no file",
    ),
    "no source": (HEAD + RUNG + '[[sketches]]\nname = "a"\n', "of a name and exactly one of sample, file"),
    "sizes on a rung that is not": (
        HEAD + RUNG + SKETCH + "sizes = { large = [9] }\n",
        "sketches[0].sizes.large: is unknown",
    ),
    "two lines in a name": (HEAD + RUNG + SKETCH.replace('"a"', '"a\\n"'), "sketches[0].name: "),
    "a rung without sizes": (
        HEAD + "[rungs.tiny]\n" + SKETCH,
        "rungs.tiny: 'sizes' is a required property; write a table of sizes",
    ),
    "a drawing without strokes": (
        HEAD + RUNG + '[[sketches]]\nname = "a"\nfile = "spec.toml"\n',
        "cf_a_n004",
    ),
}


@pytest.mark.slow
@for_each("case", BAD)
def test_a_bad_specification_is_one_line_with_file_or_name_and_nothing_half_written(tmp_path, capfd, case):
    text, words = BAD[case]
    path = write_spec(tmp_path, text)
    assert invoke(["library", "build", str(path), "-o", str(tmp_path / "out")]) == 1
    shown = capfd.readouterr()
    assert shown.out == ""
    assert len(complaints(shown.err).splitlines()) == 1
    assert words in shown.err
    assert "spec.toml" in shown.err or "cf_a" in shown.err
    out = tmp_path / "out"
    assert not out.exists() or sorted(content(out)) in ([], ["ledger.json"])


# What is built


def test_every_sidecar_obeys_the_shipped_schema(built):
    schema = json.loads((SCHEMAS / "library-entry.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    for document in built.entries:
        jsonschema.validate(document, schema)


def test_the_library_is_flat_and_sha256sums_lists_all_but_itself(built):
    names = sorted(content(built.folder))
    sums = dict(reversed(line.split("  ")) for line in (built.folder / "SHA256SUMS").read_text().splitlines())
    assert list(sums) == sorted(sums) == [name for name in names if name != "SHA256SUMS"]
    assert sums == {name: hashlib.sha256((built.folder / name).read_bytes()).hexdigest() for name in sums}
    ours = [name for name in names if name.startswith("cf_")]
    assert all(re.fullmatch(r"cf_[a-z0-9_]{1,29}(\.[A-Za-z0-9]+)+", name) for name in ours)
    assert {"README.md", "LICENSE", "CITATION.cff", "CHANGELOG.md", "library.solu", "check_point.py"} < set(
        names
    )
    assert "own: no licence is stated" in (built.folder / "LICENSE").read_text()


def test_every_wanted_entry_is_there_in_every_format_or_refused(built):
    printed = sum("facet" in FORMULATIONS[name].option_names for name in SKEWED)
    assert len(built.entries) == 2 * (len(SKEWED) + printed) + len(SKEWED)
    for document in built.entries:
        wanted = {"nl", "gms", "lp", "mps"} if document["rung"] == "tiny" else {"nl", "mps"}
        written = {file["format"] for file in document["files"]} - {"sol"}
        assert written | set(document["refused"]) == wanted
        assert not written & set(document["refused"])
        packed = {
            file["name"].endswith(".gz")
            for file in document["files"]
            if file["format"] in {"mps", "gms", "lp"}
        }
        assert packed <= {document["rung"] == "medium"}
        if document["formulation"] == "minlp-parity":
            assert set(document["refused"]) == wanted & {"lp", "mps"}


def test_the_instance_file_is_the_instance_of_the_drawing(built, spec):
    document = built.entry("cf_own_n004_milp")
    instance = read_instance(built.folder / document["instance"]["file"])
    (wanted,) = (
        planned.recipe for planned in plan_library(read_spec(spec)) if planned.recipe.name == "cf_own_n004"
    )
    assert instance.sha256 == document["instance"]["sha256"] == make_instance(wanted).sha256
    assert (document["source"]["sketch"], document["source"]["kind"]) == ("drawn by hand.svg", "file")
    assert (built.folder / "cf_own.sketch.svg").read_bytes() == svg_of_curves(
        read_svg(sample_svg("mouse").encode())
    )
    assert document["instance"]["pixels"] == instance.grid.size
    assert document["instance"]["pairs"] == len(instance.grid.first)


# Points, checked with readers of other projects


@pytest.mark.parametrize(
    "formulation",
    [
        "minlp-parity",
        "minlp-quartic",
        "minlp-cubic",
        "miqcp-bilinear",
        "miqp-mccormick",
        "miqp-exact",
        "qp-fixed",
    ],
)
def test_casadi_evaluates_the_nl_at_its_point_as_the_sidecar_states(built, formulation):
    document = by_formulation(built, "cf_own_n004")[formulation]
    model = casadi.NlpBuilder()
    model.import_nl(str(built.folder / f"{document['name']}.nl"))
    lines = (built.folder / document["best"]["nl_point"]).read_text().splitlines()
    columns = document["counts"]["variables"]
    values = list(map(float, lines[-columns - 1 : -1]))
    assert lines[-1].startswith("objno 0")
    evaluate = casadi.Function("f", [casadi.vertcat(*model.x)], [model.f, casadi.vertcat(*model.g)])
    objective, rows = evaluate(values)
    assert float(objective) == pytest.approx(document["best"]["objective"], rel=1e-9, abs=1e-12)
    rows = np.array(rows).ravel()
    assert (rows >= np.array(model.g_lb) - 1e-9).all()
    assert (rows <= np.array(model.g_ub) + 1e-9).all()


def test_points_are_feasible_beyond_the_tolerance_of_minlplib(built):
    for document in built.entries:
        assert document["best"]["violation"] <= 1e-12
        assert document["best"]["integrality"] == 0.0
        solution = read_solution(built.folder / document["best"]["point"], problem_of(built, document))
        assert solution.objective == pytest.approx(document["best"]["objective"], rel=1e-9, abs=1e-12)
        assert solution.unknown == 0


def test_formulations_of_one_optimum_have_points_of_one_objective(built):
    for instance in ("cf_own_n004", "cf_own_n004_box", "cf_rand_n006_s2"):
        objectives = {
            name: entry["best"]["objective"] for name, entry in by_formulation(built, instance).items()
        }
        for one, other in (
            ("minlp-parity", "minlp-quartic"),
            ("minlp-quartic", "minlp-cubic"),
            ("minlp-quartic", "miqp-exact"),
            ("miqcp-bilinear", "miqp-mccormick"),
            ("miqcp-bilinear-l1", "milp-mccormick"),
        ):
            assert objectives[one] == pytest.approx(objectives[other], rel=1e-9)
        assert objectives["minlp-quartic"] <= objectives["qp-fixed"] + 1e-12


def test_the_printed_facet_gives_a_point_that_is_no_worse(built):
    hull, printed = (by_formulation(built, "cf_own_n004", facet) for facet in ("hull", "printed"))
    assert set(printed) == {"miqp-mccormick", "milp-mccormick"}
    for name, entry in printed.items():
        assert entry["best"]["objective"] <= hull[name]["best"]["objective"] + 1e-12


# Counts, curvature, letters


def test_the_tangent_bound_never_exceeds_the_optimum(built):
    document = by_formulation(built, "cf_own_n004")["qp-fixed"]
    problem = problem_of(built, document)
    optimum = document["best"]["objective"]
    assert document["status"] == "optimal"
    rng = np.random.default_rng(3)
    bounds = [tangent_bound(problem, rng.uniform(problem.lower, problem.upper)) for _ in range(50)]
    assert max(bounds) <= optimum + 1e-12
    assert tangent_bound(formulate(problem.instance, "miqp-exact"), np.zeros(1)) is None


# The same bytes, however it is made


@pytest.mark.slow
def test_another_number_of_jobs_and_another_hash_seed_make_the_same_bytes(tmp_path):
    """Searches included, which the points of the other tests' specification leave out."""
    spec = write_spec(tmp_path)
    for jobs in ("1", "2"):
        done = subprocess.run(
            build_command(spec, tmp_path / jobs, jobs),
            capture_output=True,
            text=True,
            check=False,
            env=os.environ | {"PYTHONHASHSEED": jobs},
        )
        assert (done.returncode, complaints(done.stderr)) == (0, "")
    assert content(tmp_path / "1") == content(tmp_path / "2")


@pytest.mark.slow
def test_the_1_norm_field_does_not_depend_on_earlier_runs_of_highs():
    """Its threads stay in the process, and another number of them makes the next run fail."""
    instance = sample("mouse", 4, gauge="box", stroke_weight=0.2)
    energies = []
    for threads in (1, 2):
        highs = highspy.Highs()
        highs.setOptionValue("output_flag", False)
        highspy.Highs.resetGlobalScheduler(True)
        highs.setOptionValue("threads", threads)
        highs.addConstr(highs.addVariable(ub=5, obj=-1, type=highspy.HighsVarType.kInteger) <= 2.5)
        assert highs.run() == highspy.HighsStatus.kOk
        energies.append(
            [improved.field.energy(1).total for improved in improve_in_1norm(greedy_field(instance), "tiny")]
        )
    assert len(energies[0]) == 2
    assert energies[0] == energies[1]


def test_nothing_whole_is_made_again(built, spec, copy):
    messages = []
    before = {path.name: path.stat().st_mtime_ns for path in copy.glob("cf_*_n*")}
    build(read_spec(spec), copy, progress=messages.append)
    assert messages == ["index and checksums"]
    assert before == {path.name: path.stat().st_mtime_ns for path in copy.glob("cf_*_n*")}


def test_only_missing_or_damaged_files_are_made_again(built, spec, copy):
    (copy / "cf_own_n004_milp.json").unlink()
    (copy / "cf_rand_n006_s2_qp.nl.gz").write_bytes(b"half")
    (copy / "cf_own_n004_box_parity.json").write_text("{}")
    download = copy / ".cf_own_n004_qp.json.abc.part"  # of a browser
    download.write_bytes(b"half")
    messages = []
    with pytest.raises(OutputError, match=r"have changed since they were written: .*--force"):
        build(read_spec(spec), copy)
    build(read_spec(spec), copy, force=True, progress=messages.append)
    assert sorted(line.split(": ")[1] for line in messages[:-1]) == [
        "cf_own_n004_box_parity",
        "cf_own_n004_milp",
        "cf_rand_n006_s2_qp",
    ]
    assert content(copy) == {**content(built.folder), download.name: b"half"}


USERS: Final = {
    name: f"{name} of the user".encode()
    for name in (
        "README.md",
        "LICENSE",
        "CHANGELOG.md",
        "index.html",
        "cf_rand_n003_s1.field.json",
        "SHA256SUMS",
    )
}


def test_files_of_the_user_stop_a_build_before_any_work_unless_it_is_forced(tmp_path, capsys):
    """A lock and an unfinished download are in nobody's way, and stay either way."""
    others = {".lock": b"", "film.mkv.part": b"half", "cf_other_n003.json": b"{}"}
    spec_of(tmp_path, SMALL)
    (tmp_path / "lib").mkdir()
    for name, data in (USERS | others).items():
        (tmp_path / "lib" / name).write_bytes(data)
    command = ["library", "build", str(tmp_path / "spec.toml"), "-o", str(tmp_path / "lib")]
    assert invoke(command) == 1
    said = capsys.readouterr().err
    assert "has files that are not crossfield's, or have changed since they were written: " in said
    assert sum(name in said for name in USERS) >= 5
    assert "--force" in said
    assert content(tmp_path / "lib") == USERS | others

    assert invoke([*command, "--force"]) == 0
    whole = content(build(read_spec(tmp_path / "spec.toml"), tmp_path / "new").folder)
    assert content(tmp_path / "lib") == whole | others


def test_a_file_that_the_user_changed_stops_the_next_build(tmp_path):
    library = library_of(tmp_path, SMALL).folder
    notes = library / "README.md"
    notes.write_text("my notes")
    before = content(library)
    with pytest.raises(OutputError, match=r"README\.md: is not crossfield's, or has changed"):
        build(read_spec(tmp_path / "spec.toml"), library)
    assert content(library) == before
    build(read_spec(tmp_path / "spec.toml"), library, force=True)
    assert notes.read_text() != "my notes"


def test_a_library_that_was_copied_without_its_list_is_one_still(tmp_path):
    """A release holds no hidden files; its checksums tell which files are its own."""
    library = library_of(tmp_path, SMALL).folder
    (tmp_path / "copy").mkdir()
    for name, data in content(library).items():
        (tmp_path / "copy" / name).write_bytes(data)
    smaller = replace(read_spec(tmp_path / "spec.toml"), formulations=("qp-fixed",))
    build(smaller, tmp_path / "copy")
    assert content(tmp_path / "copy") == content(build(smaller, tmp_path / "alone").folder)


def test_an_instance_that_fails_is_reported_and_the_others_are_built(tmp_path, capsys):
    """A drawing without strokes next to a random sketch, in a new folder and again."""
    (tmp_path / "bare.scap").write_text("#9 9\n")
    spec_of(tmp_path, f'{SMALL}[[sketches]]\nname = "bare"\nfile = "bare.scap"\n')
    command = ["library", "build", str(tmp_path / "spec.toml"), "-o", str(tmp_path / "lib"), "--quiet"]
    for _ in range(2):
        assert invoke(command) == 1
        assert "cf_bare_n003 failed: " in capsys.readouterr().err
    library = read_library(tmp_path / "lib")
    assert library.document["entries"] == ["cf_rand_n003_s1_qp", "cf_rand_n003_s1_exact"]
    assert "holds no stroke" in library.skipped["cf_bare_n003"]
    assert "cf_bare_n003: " in (tmp_path / "lib" / "README.md").read_text()
    assert [defect.file for defect in verify_library(tmp_path / "lib")] == ["cf_bare_n003"]


def test_a_build_that_is_refused_leaves_nothing(tmp_path):
    (tmp_path / "bare.scap").write_text("#9 9\n")
    bare = '[[sketches]]\nname = "bare"\nfile = "bare.scap"\n'
    spec = spec_of(tmp_path, f'formulations = ["qp"]\n[rungs.tiny]\nsizes = [4]\n{bare}')
    for folder in ("new", "old"):
        with pytest.raises(InputError, match="holds no stroke"):
            build(spec, tmp_path / folder)
        assert not (tmp_path / folder).exists() or list((tmp_path / folder).iterdir()) == []
        (tmp_path / "old").mkdir(exist_ok=True)
    assert not (tmp_path / "new").exists()


@pytest.mark.slow
def test_two_builds_in_one_folder_come_one_after_the_other(built, spec, tmp_path):
    """Each ends with the library of a single one, and neither writes a lock."""
    out = tmp_path / "out"
    out.mkdir()
    with library_lock(out, "this test"):
        both = [
            subprocess.Popen(build_command(spec, out, "1"), stderr=subprocess.PIPE, text=True) for _ in "ab"
        ]
        for process in both:
            assert any("waits for another process, which is at work on" in line for line in process.stderr)
    for process in both:
        process.communicate()
    assert [process.returncode for process in both] == [0, 0]
    assert content(out) == content(built.folder)


@pytest.mark.slow
def test_a_library_is_brought_up_to_date_from_itself_alone(searched, tmp_path):
    copy = shutil.copytree(searched.folder, tmp_path / "library")
    (copy / "cf_own_n004_milp.json").unlink()
    (copy / "cf_own_n004.about.json").unlink()
    with pytest.raises(InputError, match=r"cf_own_n004_milp\.json: cannot be read"):
        _ = read_library(copy).entries
    rebuild(copy)
    assert content(copy) == content(searched.folder)


def build_command(spec, out, jobs="2"):
    return [sys.executable, "-m", "crossfield", "library", "build", str(spec), "-o", str(out), "--jobs", jobs]


@pytest.fixture
def begun(spec, tmp_path):
    """A build in another process that has written an entry, and its folder."""
    out = tmp_path / "out"
    command = build_command(spec, out)
    process = subprocess.Popen(command, start_new_session=True, stderr=subprocess.PIPE, text=True)
    while process.poll() is None and len(list(out.glob("cf_*_n*_milp.json"))) < 1:
        time.sleep(0.01)
    return process, out


@pytest.mark.slow
def test_a_build_that_was_killed_continues_and_leaves_nothing_half_written(begun, built, spec):
    process, out = begun
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert process.returncode == -signal.SIGKILL
    whole = content(built.folder)
    early = {name: data for name, data in content(out).items() if not name.endswith(".part")}
    assert 0 < len(early) < len(whole)
    assert all(whole[name] == data for name, data in early.items())
    done = [name for name in early if re.fullmatch(r"cf_\w+", name.removesuffix(".json"))]
    messages = []
    build(read_spec(spec), out, progress=messages.append)
    again = {line.split(": ")[1] + ".json" for line in messages[:-1]}
    assert not again & set(done)
    assert content(out) == whole


@pytest.mark.slow
def test_an_interrupted_build_ends_soon_with_one_line_and_whole_files(begun, built):
    process, out = begun
    os.killpg(process.pid, signal.SIGINT)
    error = complaints(process.communicate()[1])
    assert process.returncode == 1
    assert error == "crossfield: interrupted; all written files are complete\n"
    whole = content(built.folder)
    assert all(whole[name] == data for name, data in content(out).items())
    assert [path.name for path in out.glob(".*")] == [LIST]


@pytest.mark.slow
def test_a_process_that_dies_ends_the_build_with_one_line_and_whole_files(begun, built):
    process, out = begun
    lines = command_lines()
    workers = [child for child in descendants(process.pid) if b"processes.child_program" in lines[child]]
    assert len(workers) == 2
    os.kill(workers[0], signal.SIGKILL)
    error = complaints(process.communicate()[1])
    assert process.returncode == 1
    assert len(error.splitlines()) == 1
    assert "a process ended before its work was done: it was killed by signal SIGKILL" in error
    assert "probably for lack of memory; try fewer jobs or threads; complete files are kept" in error
    whole = content(built.folder)
    assert all(whole[name] == data for name, data in content(out).items())


@pytest.mark.slow
def test_entries_that_left_the_specification_leave_the_folder_and_other_files_stay(built, spec, copy):
    (copy / "notes.txt").write_text("mine")
    (copy / "cf_mine_n004_qp.nl").write_text("mine too")
    smaller = replace(read_spec(spec), formulations=("qp-fixed",))
    build(smaller, copy)
    names = set(content(copy))
    assert {"notes.txt", "cf_mine_n004_qp.nl", "cf_own_n004_qp.json"} <= names
    assert not [name for name in names if "_milp" in name or "_exact" in name]
