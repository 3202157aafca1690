"""Submitted runs: records, refusals, and the status of entries that follows."""

import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from itertools import combinations

import highspy
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.cli.library_command import solve_command
from crossfield.export.library.building.build import build, rebuild
from crossfield.export.library.checking.check_library import verify_library
from crossfield.export.library.contributions.solve import drop_refuted, solve_library
from crossfield.export.library.documents.documents import read_library, read_sidecar
from crossfield.export.library.ledger.ledger import Record, add_record, read_ledger
from crossfield.export.library.ledger.standing import MAKERS, standing
from crossfield.export.library.plan.spec import read_spec
from crossfield.export.solvers_table import SOLVERS
from crossfield.models.errors import CrossfieldError, InputError, SolutionError
from forging import seal
from submitting import submit_one

pytestmark = pytest.mark.usefixtures("short_searches")

SPEC = """
format = "crossfield-library-spec"
version = 1
title = "runs"
formulations = ["milp-mccormick", "miqcp-bilinear-l1", "qp-fixed"]
[rungs.medium]
sizes = [4]
formats = ["mps"]
compress = false
[[sketches]]
name = "rand"
random = "full"
seeds = [1, 2]
"""
MILP, BILINEAR, QP = (f"cf_rand_n004_s1_{short}" for short in ("milp", "bilin1", "qp"))
OTHER = "cf_rand_n004_s2_milp"
"""An entry whose best known point a run of HiGHS improves."""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library, and the logs and solutions of HiGHS on two of its entries; not to be changed."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "spec.toml").write_text(SPEC)
    library = build(read_spec(folder / "spec.toml"), folder / "lib")
    for entry in (MILP, OTHER):
        highs = highspy.Highs()
        for option, value in (
            ("output_flag", True), ("log_to_console", False), ("log_file", str(folder / f"{entry}.log")),
            ("threads", 1), ("mip_rel_gap", 0.0), ("mip_abs_gap", 0.0), ("mip_feasibility_tolerance", 1e-9),
            ("primal_feasibility_tolerance", 1e-9)
        ):  # fmt: skip
            highs.setOptionValue(option, value)
        highs.readModel(str(library.folder / f"{entry}.mps"))
        highs.run()
        highs.writeSolution(str(folder / f"{entry}.sol"), 0)
        highs.setOptionValue("output_flag", False)
    return folder


@pytest.fixture
def lib(built, tmp_path):
    return shutil.copytree(built / "lib", tmp_path / "lib")


def entry_of(lib, name=MILP):
    return read_sidecar(lib / f"{name}.json")


def record_of(lib, solver, name=MILP, **given):
    sidecar = entry_of(lib, name)
    facts = {"status": "optimal", "bound": sidecar["best"]["objective"]} | given
    return Record(name, sidecar["problem_sha256"], solver, "1", **facts)


# records


def test_a_run_is_kept_with_its_log_and_claims_the_optimum(built, lib):
    facts = {"machine": "a machine", "by": "A. Name", "date": "2026-11-22"}
    happened = submit_one(lib, built / f"{MILP}.log", **facts)
    assert (happened.entries, happened.outcome, happened.status) == ((MILP,), "accepted", "claimed")
    sidecar = entry_of(lib)
    (run,) = sidecar["runs"]
    stated = {"machine": "a machine", "by": "A. Name", "date": "2026-11-22", "evidence": "log", "threads": 1}
    assert run.items() >= stated.items()
    assert (run["solver"], run["status"], run["bound"]) == ("HiGHS", "optimal", sidecar["bound"])
    assert run["trace"][-1][1] == pytest.approx(sidecar["bound"])
    assert (lib / run["log"]).read_bytes() == (built / f"{MILP}.log").read_bytes()
    assert sidecar["claimed"] == [{"solver": "HiGHS", "version": run["version"]}]
    assert entry_of(lib, BILINEAR)["claimed"] == [sidecar["claimed"][0] | {"via": MILP}]
    assert entry_of(lib, BILINEAR)["runs"] == []
    assert entry_of(lib, QP)["solved"]["by"] == "tangent"
    solu = (lib / "library.solu").read_text().splitlines()
    assert f"=best= {MILP} {sidecar['best']['objective']!r}" in solu
    assert verify_library(lib) == []
    again = submit_one(lib, built / f"{MILP}.log", **facts)
    assert again.outcome == "not better"


def test_a_better_point_comes_with_its_run(built, lib):
    before = entry_of(lib, OTHER)["best"]["objective"]
    happened = submit_one(lib, built / f"{OTHER}.sol", built / f"{OTHER}.log")
    sidecar = entry_of(lib, OTHER)
    assert happened.better_point
    assert sidecar["best"]["objective"] < before
    assert (sidecar["best"]["solver"], sidecar["status"]) == ("HiGHS", "claimed")
    assert sidecar["runs"][0]["objective"] == sidecar["best"]["objective"]
    assert verify_library(lib) == []


def test_the_best_run_of_each_solver_is_shown(lib):
    best = entry_of(lib)["best"]["objective"]
    for bound in (0.5, 0.7, 0.6):
        submit_one(lib, entry=MILP, solver="scip", version="10", bound=bound * best, seconds=3.0, threads=2)
    submit_one(lib, entry=MILP, solver="Own", bound=0.1 * best, status="no point", time_limit=60.0)
    runs = entry_of(lib)["runs"]
    assert [(each["solver"], each["bound"] / best) for each in runs] == [
        ("Own", pytest.approx(0.1)),
        ("SCIP", pytest.approx(0.7)),
    ]
    assert {each["evidence"] for each in runs} == {"word"}
    assert runs[0]["limit"] == 60.0
    assert len(read_ledger(lib).records) == 3
    assert verify_library(lib) == []


def test_a_build_takes_runs_and_logs_of_its_ledger_over(built, lib, tmp_path):
    submit_one(lib, built / f"{MILP}.log")
    (tmp_path / "spec.toml").write_text(f'ledger = "{lib / "ledger.json"}"' + SPEC)
    again = build(read_spec(tmp_path / "spec.toml"), tmp_path / "again").folder
    log = entry_of(lib)["runs"][0]["log"]
    assert entry_of(again)["runs"] == entry_of(lib)["runs"]
    assert (again / log).read_bytes() == (lib / log).read_bytes()
    assert verify_library(again) == []


# refusals


def test_an_invalid_run_is_refused_in_one_line_and_changes_nothing(built, lib, tmp_path):
    best = entry_of(lib)["best"]["objective"]
    log = (built / f"{MILP}.log").read_text()
    higher = re.sub(r"(Dual bound +)\S+", rf"\g<1>{2 * best}", log)
    stopped = re.sub(r"(Status +)Optimal", r"\1Time limit reached", log)
    larger = log.replace(MILP, "model").replace(" cols;", "9 cols;", 1)
    other = built / f"{OTHER}.log"
    files = {"higher": higher, "stopped": stopped, "larger": larger, "none": "no log"}
    for name, text in files.items():
        (tmp_path / f"{name}.log").write_text(text)
    before = {path.name: path.read_bytes() for path in lib.iterdir()}
    for files, facts, words in (
        ([], {"entry": MILP, "bound": 1.01 * best}, "lies above .* the objective of a feasible point"),
        ([tmp_path / "higher.log"], {"entry": MILP}, "lies above .* of a feasible point"),
        ([built / f"{MILP}.log"], {"bound": 1.001 * best}, "differs from the log's"),
        ([other], {"entry": MILP}, f"is a log of {OTHER}, not of {MILP}"),
        ([tmp_path / "larger.log"], {"entry": MILP}, "is a log of a model of .* columns"),
        ([tmp_path / "none.log"], {"entry": MILP}, "is no solution, field, certificate, log"),
        ([tmp_path / "none.log"], {"entry": MILP, "bound": 0.0}, "is no solution, field, certificate, log"),
        ([built / f"{MILP}.log"], {"solver": "Gurobi"}, "is given as Gurobi, and the log is of HiGHS"),
        ([tmp_path / "stopped.log"], {"entry": MILP, "status": "optimal"}, "search was stopped"),
        ([built / f"{MILP}.sol"], {"entry": MILP, "status": "optimal"}, "is proven by a bound"),
        ([], {"entry": MILP, "solver": "SCIP"}, "an entry and a bound"),
        ([], {"bound": 0.0}, "name the entry"),
        ([], {"entry": "cf_none_milp", "bound": 0.0}, "has no entry"),
        ([], {"entry": MILP, "bound": float("nan")}, "bound is nan; give a finite number"),
        ([], {"entry": MILP, "bound": 0.0, "seconds": -1.0}, "seconds is -1.0; give a finite number"),
        ([], {"entry": MILP, "bound": 0.0, "threads": -1}, "threads is -1; give a finite number"),
        ([], {"entry": MILP, "bound": 0.0, "machine": "a\nb"}, "machine must be one line"),
        ([], {"entry": MILP, "bound": 0.0, "date": "22.11.2026"}, "date is '22.11.2026'; give a day"),
        ([], {"entry": MILP, "bound": 0.0, "status": "solved"}, "status is 'solved'; choose one of optimal"),
        (
            [],
            {"entry": MILP, "bound": 0.0, "time_limit": float("inf")},
            "time limit is inf; give a finite number",
        ),
        ([], {"entry": MILP, "bound": 0.0, "by": "\u202ereversed"}, "by must be one line"),
        ([], {"entry": MILP, "bound": 0.0, "version": "<script>"}, "version is '<script>'; give at most 60"),
    ):
        with pytest.raises(CrossfieldError, match=words) as refused:
            submit_one(lib, *files, **facts)
        assert "\n" not in str(refused.value)
        assert isinstance(refused.value, InputError | SolutionError)
    assert {path.name: path.read_bytes() for path in lib.iterdir() if path.name != ".lock"} == before


GUROBI = """Gurobi Optimizer version 13.0.3 build v13.0.3rc0 (linux64)
TimeLimit  60
Explored 1 nodes (0 simplex iterations) in 0.05 seconds (0.01 work units)
Optimal solution found (tolerance 1.00e-04)
Best objective 9.000000000000e+99, best bound 1.000000000000e-03, gap 0.0000%
"""
BARON = """ BARON version 26.5. Built: LNX-64
  Lower bound is                      0.001
    Wall clock time:                     -1.00
"""


@pytest.mark.parametrize(
    "text, words",
    [
        (GUROBI.replace("in 0.05 seconds", "in -5 seconds"), "seconds is -5.0; give a finite number"),
        (GUROBI.replace("TimeLimit  60", "TimeLimit  -8"), "time limit is -8.0; give a finite number"),
        (GUROBI.replace("13.0.3 build", "13\x1b[31mX build"), "version is '13.*X'; give at most 60 letters"),
        (GUROBI.replace("13.0.3 build", f"{5000 * '1'} build"), "version is '1+ ... 1+'; give at most 60"),
        (GUROBI.replace("13.0.3 build", "13\u202e build"), "version is"),
        (GUROBI.replace("13.0.3 build", "<script> build"), "version is '<script>'; give at most 60 letters"),
        (BARON, "seconds is -1.0; give a finite number"),
    ],
)
def test_a_log_that_no_ledger_can_hold_is_refused_before_anything_is_written(lib, tmp_path, text, words):
    (tmp_path / "a.log").write_text(text)
    before = {path.name: path.read_bytes() for path in lib.iterdir()}
    with pytest.raises(InputError, match=rf"a\.log: {words}") as refused:
        submit_one(lib, tmp_path / "a.log", entry=MILP)
    assert "\n" not in str(refused.value)
    assert str(refused.value).isprintable()
    assert {path.name: path.read_bytes() for path in lib.iterdir() if path.name != ".lock"} == before
    assert submit_one(lib, entry=MILP, solver="scip", bound=0.0).outcome == "accepted"


def test_stated_facts_replace_those_of_the_log(lib, tmp_path):
    (tmp_path / "a.log").write_text(GUROBI.replace("TimeLimit  60", "TimeLimit  -8"))
    submit_one(lib, tmp_path / "a.log", entry=MILP, time_limit=8.0)
    assert entry_of(lib)["runs"][0]["limit"] == 8.0
    with pytest.raises(InputError, match=r"^version is '\?'; give"):
        submit_one(lib, tmp_path / "a.log", entry=MILP, version="?", time_limit=8.0)


@pytest.mark.parametrize("seconds", [float("inf"), float("nan"), -1.0])
def test_a_point_with_a_time_that_cannot_be_is_refused_before_anything_is_written(built, lib, seconds):
    before = {path.name: path.read_bytes() for path in lib.iterdir()}
    with pytest.raises(InputError, match=f"^seconds is {seconds}; give a finite number"):
        submit_one(lib, built / f"{OTHER}.sol", entry=OTHER, seconds=seconds)
    assert {path.name: path.read_bytes() for path in lib.iterdir() if path.name != ".lock"} == before


# optima


def test_words_and_unknown_programs_never_solve_an_entry(lib):
    best = entry_of(lib)["best"]["objective"]
    facts = {"solver": "Gurobi", "version": "1", "status": "optimal", "bound": best}
    assert submit_one(lib, entry=MILP, **facts).status == "claimed"
    for solver in ("SCIP", "Xpress", "HiGHS"):
        add_record(lib, record_of(lib, solver, evidence="word"))
    for solver in ("A", "B", "C"):
        add_record(lib, record_of(lib, solver))
    rebuild(lib)
    sidecar = entry_of(lib)
    assert sidecar["status"] == "claimed"
    assert len(sidecar["claimed"]) == 7
    assert "solved" not in sidecar
    assert verify_library(lib) == []


def test_three_programs_of_different_makers_solve_an_entry_and_those_like_it(lib):
    for solver in ("CBC", "Bonmin", "HiGHS"):
        add_record(lib, record_of(lib, solver))
    rebuild(lib)
    assert entry_of(lib)["status"] == "claimed"
    add_record(lib, record_of(lib, "Gurobi", BILINEAR))
    rebuild(lib)
    solved = entry_of(lib)["solved"]
    assert (entry_of(lib)["status"], solved["by"]) == ("optimal", "agreement")
    assert [each["solver"] for each in solved["programs"]] == ["Bonmin", "CBC", "Gurobi", "HiGHS"]
    assert solved["programs"][2]["via"] == BILINEAR
    assert f"=opt= {BILINEAR} " in (lib / "library.solu").read_text()
    assert verify_library(lib) == []


def test_agreement_needs_three_makers_whatever_the_order():
    """Every three programs of the table agree when, and only when, their makers differ."""
    for chosen in combinations(SOLVERS.values(), 3):
        records = [Record("cf_a", "0" * 64, each.title, "1", "optimal", bound=1.0) for each in chosen]
        different = len({each.maker for each in chosen}) == 3
        for given in (records, records[::-1]):
            assert ("solved" in standing(1.0, [], given, "cf_a")) == different
        assert "solved" not in standing(1.0, [], [replace(records[0], bound=0.9), *records[1:]], "cf_a")
    assert MAKERS["CPLEX in GAMS"] == MAKERS["CPLEX"]


# findings


@pytest.mark.slow
def test_a_forged_run_is_found(built, lib, tmp_path):
    submit_one(lib, built / f"{MILP}.log")
    log = entry_of(lib)["runs"][0]["log"]

    def forged(change):
        copy = shutil.copytree(lib, tmp_path / "copy")
        change(copy)
        rebuild(copy)
        seal(copy)
        found = " ".join(map(str, verify_library(copy)))
        shutil.rmtree(copy)
        return found

    def in_ledger(**given):
        def change(folder):
            path = folder / "ledger.json"
            document = json.loads(path.read_text())
            (record,) = document["records"]
            left = {key: value for key, value in (record | given).items() if key not in given or value}
            document["records"] = [left]
            path.write_text(json.dumps(document))

        return lambda: forged(change)

    def in_log(folder):
        (folder / log).write_text((folder / log).read_text() + "\n")

    assert "states another bound" in in_ledger(bound=0.1)()
    assert "and names none" in in_ledger(evidence="log", log=None, log_sha256=None)()
    assert "does not state whether" in in_ledger(evidence=None)()
    assert "another course of the run" in in_ledger(trace=[[0.0, 0.1, 0.2]])()
    assert f"states that {log} is of SCIP" in in_ledger(solver="SCIP")()
    assert "is another file than the one its ledger names" in forged(in_log)
    assert verify_library(lib) == []


def test_a_status_that_does_not_follow_is_found(built, lib):
    submit_one(lib, built / f"{MILP}.log")
    path = lib / f"{MILP}.json"
    sidecar = json.loads(path.read_text())
    solved = {"by": "agreement", "programs": sidecar["claimed"] * 3}
    del sidecar["claimed"]
    path.write_text(json.dumps(sidecar | {"status": "optimal", "solved": solved}))
    seal(lib)
    found = " ".join(map(str, verify_library(lib)))
    for key in ("status", "solved", "claimed"):
        assert f"states another {key} than follows" in found


# the command, and solving with every program


def test_the_command_reports_results_and_refusals(built, lib, capfd):
    given = ["library", "submit", str(lib)]
    assert invoke([*given, str(built / f"{MILP}.log"), "--by", "me"]) == 0
    assert "claimed" in capfd.readouterr().out
    assert invoke([*given, "--entry", MILP, "--bound", "9", "--quiet"]) == 1
    shown = capfd.readouterr().err
    assert len(shown.splitlines()) == 1
    assert "lies above" in shown


@pytest.mark.slow
def test_every_installed_program_solves_its_problems(lib):
    names = [
        name for name in ("gurobi", "cplex", "xpress", "scip", "cbc", "glpk") if not SOLVERS[name].missing
    ]
    records = solve_library(lib, solvers=[*names, "highs"], time_limit=60.0, machine="a machine")
    best = entry_of(lib)["best"]["objective"]
    mine = {each["solver"]: each for each in records if each["entry"] == MILP}
    assert set(mine) == {SOLVERS[name].title for name in [*names, "highs"]}
    for record in mine.values():
        assert record["primal"] == pytest.approx(best, abs=2e-6)
        assert record["bound"] is None or record["bound"] <= best + 1e-6
        assert record["machine"] == "a machine"
    assert mine["HiGHS"]["trace"]
    if len({SOLVERS[name].maker for name in names}) > 3:
        assert entry_of(lib)["solved"]["by"] == "agreement"
    assert verify_library(lib) == []
    assert solve_library(lib, solvers=names, time_limit=60.0) == []


def test_a_limit_that_leaves_no_time_to_start_a_solver_is_counted_and_the_others_run(lib, capfd):
    """Writing a model takes longer than a nanosecond, which the command line does not accept as a limit."""
    solve_command(lib, solver=["highs"], time_limit=1e-9)
    said = capfd.readouterr().out
    assert said == f"{lib / 'ledger.json'}: 4 new records, 4 from runs without a point\n"
    records = read_ledger(lib).records
    assert {each.entry for each in records} == {MILP, OTHER, QP, QP.replace("s1", "s2")}
    assert {(each.status, each.seconds, each.trace) for each in records} == {("no point", None, ())}


def test_a_solver_that_is_not_installed_is_one_line(lib, monkeypatch, hidden):
    hidden("glpsol")
    with pytest.raises(CrossfieldError, match=r"^glpk is not installed; apt install glpk-utils$"):
        solve_library(lib, solvers=["glpk"])
    monkeypatch.setitem(SOLVERS, "highs", replace(SOLVERS["highs"], package="no_such_package"))
    with pytest.raises(CrossfieldError, match=r"^highs is not installed; pip install no_such_package$"):
        solve_library(lib, solvers=["highs"])
    with pytest.raises(InputError, match="there is no solver 'none'"):
        solve_library(lib, solvers=["none"])
    assert read_library(lib).entry(MILP)["runs"] == []


def test_measured_bounds_above_a_point_found_later_are_dropped_and_others_stay(built, lib):
    """The library can still be built after a solver has exceeded its tolerances."""
    submit_one(lib, built / f"{OTHER}.sol")
    best = entry_of(lib, OTHER)["best"]["objective"]
    wrong = record_of(lib, "Xpress", OTHER, bound=best + 2e-5)
    sent = record_of(lib, "SCIP", OTHER, bound=best + 2e-5, evidence="word")
    right = record_of(lib, "HiGHS", OTHER, bound=0.9 * best)
    for record in (wrong, sent, right):
        add_record(lib, record)
    drop_refuted(read_library(lib))
    after = {each.solver: each.bound for each in read_ledger(lib).records if each.status == "optimal"}
    assert after == {"Xpress": None, "SCIP": sent.bound, "HiGHS": right.bound}


@pytest.mark.slow
def test_runs_that_are_sent_in_at_one_moment_are_all_kept(lib):
    command = [sys.executable, "-m", "crossfield", "library", "submit", str(lib)]
    given = [(entry, solver) for entry in (MILP, OTHER) for solver in ("SCIP", "Gurobi")]
    others = [
        subprocess.Popen([*command, "--entry", entry, "--solver", solver, "--bound", "0.01", "--quiet"])
        for entry, solver in given
    ]
    assert [other.wait() for other in others] == [0] * len(given)
    assert sorted((each.entry, each.solver) for each in read_ledger(lib).records) == sorted(given)
    assert verify_library(lib) == []
