"""Builds of a specification: what a library holds, the same bytes in every way, and files of the user."""

import csv
import io
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from typing import Final

import casadi
import crossfield as cf
import highspy
import numpy as np
import pytest
from cases import SKEWED
from children import command_lines, complaints, descendants
from command_line import invoke
from crossfield.export.library.building import fields
from crossfield.export.library.building.build import build, rebuild
from crossfield.export.library.documents.lock import library_lock
from crossfield.export.library.documents.statistics import tangent_bound
from crossfield.models.formulations.catalogue import FORMULATIONS
from folders import LIST
from libraries import content, defects, document, library_of, problem, spec_of, write_spec
from processors import PROCESSORS

WHOLE: Final = """[rungs.tiny]
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
sample = "mouse"
rungs = ["tiny"]
points = "greedy"
[[sketches]]
name = "rand"
random = "ragged"
seeds = [2]
rungs = ["medium"]
points = "greedy"
"""
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
BARE: Final = '[[sketches]]\nname = "bare"\nfile = "bare.scap"\n'
BOTTLE: Final = '[[sketches]]\nname = "bottle"\nsample = "bottle"\n'


@pytest.fixture
def short_searches(monkeypatch):
    """Builds in this process use one round of search: the quality of their fields does not matter here."""
    monkeypatch.setattr(fields, "_ROUNDS", 1)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library in every formulation; not to be changed."""
    return library_of(tmp_path_factory.mktemp("built"), WHOLE)


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A library of two entries; not to be changed."""
    return library_of(tmp_path_factory.mktemp("small"), SMALL).folder


@pytest.fixture
def lib(small, tmp_path):
    """A copy that a test may change, beside its specification."""
    shutil.copy(small.parent / "spec.toml", tmp_path)
    return shutil.copytree(small, tmp_path / "lib")


def run_build(lib, *more):
    """Build a library by the command, from the specification beside it; return the exit code."""
    return invoke(["library", "build", str(lib.parent / "spec.toml"), "-o", str(lib), *more])


def by_formulation(library, instance, facet="hull"):
    """The entries of an instance by formulation."""
    return {
        entry["formulation"]: entry
        for entry in library.entries
        if entry["instance"]["file"] == f"{instance}.instance.json" and entry["options"]["facet"] == facet
    }


# What is built


def test_a_library_holds_every_entry_in_every_format_or_the_reason(built):
    printed = sum("facet" in FORMULATIONS[name].option_names for name in SKEWED)
    assert len(built.entries) == 2 * (len(SKEWED) + printed) + len(SKEWED)
    for entry in built.entries:
        wanted = {"nl", "gms", "lp", "mps"} if entry["rung"] == "tiny" else {"nl", "mps"}
        written = {file["format"] for file in entry["files"]} - {"sol"}
        assert written.isdisjoint(entry["refused"])
        assert written | set(entry["refused"]) == wanted
        if entry["formulation"] == "minlp-parity":
            assert set(entry["refused"]) == wanted & {"lp", "mps"}
        models = [file["name"] for file in entry["files"] if file["format"] in {"mps", "gms", "lp"}]
        assert {name.endswith(".gz") for name in models} <= {entry["rung"] == "medium"}
    names = [name for name in content(built.folder) if name.startswith("cf_")]
    assert all(re.fullmatch(r"cf_[a-z0-9_]{1,29}(\.[A-Za-z0-9]+)+", name) for name in names)


def test_the_table_has_the_facts_of_the_entries(built):
    rows = list(csv.DictReader(io.StringIO((built.folder / "entries.csv").read_text())))
    for row, entry in zip(rows, built.entries, strict=True):
        assert (row["name"], row["rung"]) == (entry["name"], entry["rung"])
        assert float(row["objective"]) == entry["best"]["objective"]
        assert row["seed"] == ("2" if entry["rung"] == "medium" else "")
        assert (row["optimum"] != "") == (entry["status"] == "optimal")
    assert {row["convex"] for row in rows} == {"true", "false"}


@pytest.mark.parametrize("formulation", ["minlp-parity", "minlp-quartic", "qp-fixed"])
def test_casadi_evaluates_the_nl_at_its_point_as_the_sidecar_states(built, formulation):
    entry = by_formulation(built, "cf_own_n004")[formulation]
    model = casadi.NlpBuilder()
    model.import_nl(str(built.folder / f"{entry['name']}.nl"))
    lines = (built.folder / entry["best"]["nl_point"]).read_text().splitlines()
    values = list(map(float, lines[-entry["counts"]["variables"] - 1 : -1]))
    assert lines[-1].startswith("objno 0")
    evaluate = casadi.Function("f", [casadi.vertcat(*model.x)], [model.f, casadi.vertcat(*model.g)])
    objective, rows = evaluate(values)
    assert float(objective) == pytest.approx(entry["best"]["objective"], rel=1e-9, abs=1e-12)
    rows = np.array(rows).ravel()
    assert (rows >= np.array(model.g_lb) - 1e-9).all()
    assert (rows <= np.array(model.g_ub) + 1e-9).all()


def test_the_tangent_bound_never_exceeds_the_optimum(built):
    entry = by_formulation(built, "cf_own_n004")["qp-fixed"]
    convex, rng = problem(built.folder, entry["name"]), np.random.default_rng(3)
    bounds = [tangent_bound(convex, rng.uniform(convex.lower, convex.upper)) for _ in range(50)]
    assert entry["status"] == "optimal"
    assert max(bounds) <= entry["best"]["objective"] + 1e-12
    assert tangent_bound(cf.formulate(convex.instance, "miqp-exact"), np.zeros(1)) is None


def test_instances_that_fail_or_do_not_suit_are_reported_and_the_others_are_built(tmp_path, capsys):
    """A drawing without strokes, and a sample on too coarse a grid, in a new folder and again."""
    (tmp_path / "bare.scap").write_text("#9 9\n")
    lib = write_spec(tmp_path, SMALL + BARE + BOTTLE).parent / "lib"
    for _ in range(2):
        assert run_build(lib) == 1
        shown = capsys.readouterr()
        assert shown.out.endswith(": 2 entries, 1 instances or entries failed, 1 instances skipped\n")
        skipped, failed = complaints(shown.err).splitlines()
        assert "cf_bottle_n003 is skipped: its outline leaves no room" in skipped
        assert "choose a larger size" in skipped
        assert "cf_bare_n003 failed: " in failed
    index = document(lib, "library")
    assert index["entries"] == ["cf_rand_n003_s1_qp", "cf_rand_n003_s1_exact"]
    assert "holds no stroke" in index["skipped"]["cf_bare_n003"]
    assert index["skipped"].keys() == {"cf_bare_n003", "cf_bottle_n003"}
    assert all(f"{name}: " in (lib / "README.md").read_text() for name in index["skipped"])
    assert not list(lib.glob("cf_b*_n*"))
    assert defects(lib).keys() == {"cf_bare_n003"}


@pytest.mark.parametrize("sketch, reason", [(BARE, "holds no stroke"), (BOTTLE, "none of its instances can")])
def test_a_build_of_which_nothing_is_left_is_refused_and_writes_nothing(sketch, reason, tmp_path):
    (tmp_path / "bare.scap").write_text("#9 9\n")
    spec = spec_of(tmp_path, f'formulations = ["qp"]\n[rungs.tiny]\nsizes = [3]\n{sketch}')
    for folder in ("new", "old"):
        with pytest.raises(cf.InputError, match=reason):
            build(spec, tmp_path / folder)
        assert list((tmp_path / folder).iterdir()) == []
        (tmp_path / "old").mkdir(exist_ok=True)


# The same bytes, however it is made


@pytest.mark.slow
@pytest.mark.parametrize("points", ["", 'points = "lib"\n'], ids=["searched", "given"])
def test_jobs_hash_seeds_and_processors_make_the_same_bytes(points, short_searches, tmp_path):
    text = SMALL.replace('"qp", "exact"', '"qp", "exact", "milp"').replace('points = "greedy"\n', "")
    if points:
        library_of(tmp_path, text)
    spec = write_spec(tmp_path, points + text)
    for jobs, processor in (("1", PROCESSORS[0]), ("2", PROCESSORS[-1])):
        environment = {"OPENBLAS_NUM_THREADS": "1", "PYTHONHASHSEED": jobs} | processor
        command = build_command(spec, tmp_path / jobs, jobs)
        subprocess.run(command, check=True, capture_output=True, env=os.environ | environment)
    assert content(tmp_path / "1") == content(tmp_path / "2")
    assert defects(tmp_path / "2") == {}


@pytest.mark.slow
def test_a_search_does_not_depend_on_earlier_runs_of_highs(short_searches, tmp_path):
    """Its threads stay in the process, and another number of them makes the next run fail."""
    for threads in (1, 2):
        highs = highspy.Highs()
        highs.setOptionValue("output_flag", False)
        highspy.Highs.resetGlobalScheduler(True)
        highs.setOptionValue("threads", threads)
        highs.addConstr(highs.addVariable(ub=5, obj=-1, type=highspy.HighsVarType.kInteger) <= 2.5)
        assert highs.run() == highspy.HighsStatus.kOk
        text = SMALL.replace('"qp", "exact"', '"milp"').replace('points = "greedy"\n', "")
        library_of(tmp_path, text.replace("[3]\n", "[4]\nprove = false\n"), str(threads))
    assert content(tmp_path / "1") == content(tmp_path / "2")
    assert document(tmp_path / "1", "cf_rand_n004_s1_milp")["best"]["solver"] == "HiGHS"


def test_only_missing_or_damaged_files_are_made_again(built, tmp_path):
    lib, messages = shutil.copytree(built.folder, tmp_path / "library"), []
    times = {path.name: path.stat().st_mtime_ns for path in lib.glob("cf_*_n*")}
    build(built.spec, lib, progress=messages.append)
    assert messages == ["index and checksums"]
    assert times == {path.name: path.stat().st_mtime_ns for path in lib.glob("cf_*_n*")}
    (lib / "cf_own_n004_milp.json").unlink()
    (lib / "cf_rand_n006_s2_qp.nl.gz").write_bytes(b"half")
    (lib / "cf_own_n004_box_parity.json").write_text("{}")
    download = lib / ".cf_own_n004_qp.json.abc.part"  # of a browser
    download.write_bytes(b"half")
    with pytest.raises(cf.OutputError, match=r"have changed since they were written: .*--force"):
        build(built.spec, lib)
    build(built.spec, lib, force=True, progress=messages.append)
    assert sorted(line.split(": ")[1] for line in messages[1:-1]) == [
        "cf_own_n004_box_parity",
        "cf_own_n004_milp",
        "cf_rand_n006_s2_qp",
    ]
    assert content(lib) == {**content(built.folder), download.name: b"half"}


def test_a_library_is_brought_up_to_date_from_itself_alone(small, lib):
    for name in ("cf_rand_n003_s1_qp.json", "cf_rand_n003_s1.about.json"):
        (lib / name).unlink()
    rebuild(lib)
    assert content(lib) == content(small)


def test_a_library_without_its_hidden_list_is_one_still_and_loses_what_left_its_specification(lib):
    """A release holds no hidden files; its checksums tell which files are its own."""
    (lib / LIST).unlink()
    mine = {"notes.txt": b"mine", "cf_mine_n003_qp.nl": b"mine too"}
    for name, data in mine.items():
        (lib / name).write_bytes(data)
    smaller = write_spec(lib.parent, SMALL.replace(', "exact"', ""))
    assert run_build(lib) == 0
    assert invoke(["library", "build", str(smaller), "-o", str(lib.parent / "alone")]) == 0
    assert content(lib) == content(lib.parent / "alone") | mine
    assert not list(lib.glob("*_exact*"))


# Files of the user


def test_files_of_the_user_stop_a_build_before_any_work_unless_it_is_forced(small, tmp_path, capsys):
    """A lock and an unfinished download are in nobody's way, and stay either way."""
    names = ("README.md", "LICENSE", "index.html", "cf_rand_n003_s1.field.json", "SHA256SUMS")
    users = dict.fromkeys(names, b"of the user")
    others = {".lock": b"", "film.mkv.part": b"half", "cf_other_n003.json": b"{}"}
    lib = write_spec(tmp_path, SMALL).parent / "lib"
    lib.mkdir()
    for name, data in (users | others).items():
        (lib / name).write_bytes(data)
    assert run_build(lib) == 1
    said = capsys.readouterr().err
    assert "has files that are not crossfield's, or have changed since they were written: " in said
    assert all(name in said for name in users)
    assert "--force" in said
    assert content(lib) == users | others
    assert run_build(lib, "--force") == 0
    assert content(lib) == content(small) | others
    (lib / "README.md").write_text("my notes")
    before = content(lib)
    assert run_build(lib) == 1
    assert "README.md: is not crossfield's, or has changed" in capsys.readouterr().err
    assert content(lib) == before


# Builds that end early, and builds at the same time


def build_command(spec, out, jobs="2"):
    return [sys.executable, "-m", "crossfield", "library", "build", str(spec), "-o", str(out), "--jobs", jobs]


@pytest.mark.slow
def test_builds_in_one_folder_wait_for_one_another(small, tmp_path):
    """Each ends with the library of a single one, and neither writes a lock."""
    out, spec = tmp_path / "out", small.parent / "spec.toml"
    program = (
        "import sys; from libraries import build, read_spec\n"
        "build(read_spec(sys.argv[1]), sys.argv[2], progress=lambda line: print(line, flush=True))"
    )
    command = [sys.executable, "-c", program, str(spec), str(out)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    out.mkdir()
    with library_lock(out, "this test"):
        both = [
            subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) for _ in range(2)
        ]
        for process in both:
            assert any("waits for another process, which is at work on" in line for line in process.stdout)
    for process in both:
        process.communicate()
    assert [process.returncode for process in both] == [0, 0]
    assert content(out) == content(small)


def kill_worker(build_process):
    lines = command_lines()
    workers = [each for each in descendants(build_process) if b".child_program" in lines.get(each, b"")]
    assert len(workers) == 2
    os.kill(workers[0], signal.SIGKILL)


INTERRUPTED = "crossfield: interrupted; all written files are complete\n"
DIED = (
    "crossfield: a process ended before its work was done: it was killed by signal SIGKILL, probably "
    "for lack of memory; try fewer jobs or threads; complete files are kept\n"
)
ENDS = {
    "killed": (lambda build_process: os.killpg(build_process, signal.SIGKILL), -signal.SIGKILL, ""),
    "interrupted": (lambda build_process: os.killpg(build_process, signal.SIGINT), 1, INTERRUPTED),
    "without a worker": (kill_worker, 1, DIED),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", ENDS)
def test_a_build_that_ends_early_leaves_whole_files_and_continues(case, built, tmp_path):
    end, code, words = ENDS[case]
    out, whole = tmp_path / "out", content(built.folder)
    command = build_command(built.folder.parent / "spec.toml", out)
    process = subprocess.Popen(command, start_new_session=True, stderr=subprocess.PIPE, text=True)
    while process.poll() is None and not list(out.glob("cf_*_n*_milp.json")):
        time.sleep(0.01)
    end(process.pid)
    assert (complaints(process.communicate()[1]), process.returncode) == (words, code)
    early = {name: data for name, data in content(out).items() if not name.endswith(".part")}
    assert 0 < len(early) < len(whole)
    assert all(whole[name] == data for name, data in early.items())
    if case != "killed":
        assert [path.name for path in out.glob(".*")] == [LIST]
        return
    messages = []
    build(built.spec, out, progress=messages.append)
    assert not {f"{line.split(': ')[1]}.json" for line in messages[:-1] if " entries: " in line} & set(early)
    assert content(out) == whole
