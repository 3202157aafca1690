"""Runs of installed solvers on a library, and the status and grade of entries that follow from runs."""

import re
import shutil
from dataclasses import replace
from itertools import combinations

import crossfield as cf
import pytest
from children import complaints
from command_line import invoke
from crossfield.export.cli.library_command import solve_command
from crossfield.export.library.contributions.solve import solve_library
from crossfield.export.library.ledger.grades import (
    EASY,
    MAKERS,
    difficulty,
    entry_status,
    is_proven,
    is_refuted,
)
from crossfield.export.library.ledger.ledger import Record, add_record, read_ledger
from crossfield.export.solvers_table import SOLVERS
from folders import LIST
from libraries import OPEN, content, defects, document, library_of, rebuild

MILP, BILINEAR, OTHER = "cf_rand_n004_s6_milp", "cf_rand_n004_s6_bilin1", "cf_rand_n004_s7_milp"
SMALL = """formulations = ["bilin1", "milp", "qp"]
[rungs.tiny]
sizes = [3]
formats = ["mps"]
[[sketches]]
name = "a"
sample = "mouse"
points = "greedy"
"""


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A library of one instance; not to be changed."""
    return library_of(tmp_path_factory.mktemp("small"), SMALL).folder


@pytest.fixture
def copy(small, tmp_path):
    return shutil.copytree(small, tmp_path / "copy")


def record_of(lib, solver, name=MILP, **changes):
    sidecar = document(lib, name)
    facts = {"status": "optimal", "bound": sidecar["best"]["objective"]} | changes
    return Record(name, sidecar["problem_sha256"], solver, "1", **facts)


# Bounds, status and grades


def test_a_bound_a_little_above_a_point_is_cut_and_one_far_above_is_refuted():
    assert not is_refuted(8.4e-9, 1.3e-28)
    assert is_refuted(1e-3, 1.3e-28)
    assert is_proven(1.3e-28, 8.4e-9)


def test_agreement_needs_three_makers_whatever_the_order():
    """Every three programs of the table agree when, and only when, their makers differ."""
    for chosen in combinations(SOLVERS.values(), 3):
        records = [Record("cf_a", "0" * 64, solver.title, "1", "optimal", bound=1.0) for solver in chosen]
        different = len({solver.maker for solver in chosen}) == 3
        for ordered in (records, records[::-1]):
            status = "agreed" if different else "claimed"
            assert entry_status(1.0, [], ordered, "cf_a")["status"] == status
        unequal = [replace(records[0], bound=0.9), *records[1:]]
        assert entry_status(1.0, [], unequal, "cf_a")["status"] == "claimed"
    assert MAKERS["CPLEX in GAMS"] == MAKERS["CPLEX"]


def run(**more):
    facts = {"status": "optimal", "bound": 1.0, "threads": 1, "seconds": EASY} | more
    return Record("cf_a_n004_milp", "0" * 64, "HiGHS", "1", **facts)


@pytest.mark.parametrize(
    "status, runs, tangent, grade",
    [
        ("best known", [run(status="limit")], False, "open"),
        ("optimal", [run()], False, "easy"),
        ("claimed", [run()], False, "easy"),
        ("optimal", [], True, "easy"),
        ("optimal", [], False, "hard"),
        ("optimal", [run(seconds=EASY + 1), run(threads=4), run(seconds=None)], False, "hard"),
        ("optimal", [run(status="limit", seconds=1.0)], False, "hard"),
        ("claimed", [run(bound=0.6)], False, "hard"),
        ("claimed", [run(bound=1.0 - 2e-6), run(bound=None)], False, "hard"),
        ("claimed", [run(bound=1.0 - 5e-7)], False, "easy"),
    ],
)
def test_grades_follow_the_runs_on_an_entry(status, runs, tangent, grade):
    """The best point has the objective 1; a claim of an optimum counts with a bound that proves it."""
    assert difficulty(status, 1.0, runs, tangent=tangent) == grade


def test_programs_of_three_makers_agree_on_an_entry_and_those_like_it_and_prove_nothing(lib):
    for solver in ("A", "B", "C", "CBC", "Bonmin", "HiGHS"):
        add_record(lib, record_of(lib, solver))
    rebuild(lib)
    assert (document(lib, MILP)["status"], len(document(lib, MILP)["claimed"])) == ("claimed", 6)
    add_record(lib, record_of(lib, "Gurobi", BILINEAR))
    rebuild(lib)
    sidecar = document(lib, MILP)
    assert (sidecar["status"], "solved" in sidecar) == ("agreed", False)
    programs = {program["solver"]: program.get("via") for program in sidecar["claimed"]}
    assert programs == dict.fromkeys(("A", "B", "C", "CBC", "Bonmin", "HiGHS")) | {"Gurobi": BILINEAR}
    solu = (lib / "library.solu").read_text()
    assert f"=best= {BILINEAR} " in solu
    assert f"=bestdual= {BILINEAR} " in solu
    assert ",agreed," in re.search(rf"^{MILP},.*$", (lib / "entries.csv").read_text(), re.MULTILINE)[0]
    assert defects(lib) == {}


def test_bounds_beyond_the_point_and_of_another_problem_do_not_count_and_others_do(lib):
    """A bound a little above the point is cut; the best run of each solver is shown."""
    best, other = (document(lib, name)["best"]["objective"] for name in (MILP, OTHER))
    limit = {"status": "limit", "seconds": 3.0, "threads": 2, "time_limit": 60.0}
    for record in (
        record_of(lib, "Xpress", bound=best + 1e-2),
        replace(record_of(lib, "Any"), problem_sha256="0" * 64),
        record_of(lib, "HiGHS", bound=0.9 * best, **limit),
        record_of(lib, "HiGHS", bound=0.8 * best, **limit),
        record_of(lib, "S", OTHER, bound=other + 4e-7, status="limit"),
    ):
        add_record(lib, record)
    with pytest.raises(cf.InputError, match="bound is inf; give a finite number"):
        add_record(lib, record_of(lib, "S", bound=float("inf")))
    rebuild(lib)
    sidecar, cut = document(lib, MILP), document(lib, OTHER)
    assert (sidecar["status"], sidecar["bound"]) == ("best known", 0.9 * best)
    assert [bound["solver"] for bound in sidecar["bounds"]] == ["HiGHS"]
    shown = [(one["solver"], one.get("bound"), one.get("limit")) for one in sidecar["runs"]]
    assert shown == [("HiGHS", 0.9 * best, 60.0), ("Xpress", None, None)]
    assert cut["bound"] == other == max(bound["bound"] for bound in cut["bounds"])
    assert (cut["status"], cut["gap"]) == ("claimed", 0.0)
    assert cut["claimed"] == [{"solver": "S", "version": "1"}]
    assert solve_library(lib, solvers=["highs"], up_to="small") == []  # all entries are on the rung medium
    assert len(read_ledger(lib).records) == 5
    assert defects(lib) == {}


# Solving


def test_solving_claims_optima_and_equivalent_entries_share_their_bounds(copy):
    """A release, without hidden files, is solved too, unless its ledger was changed."""
    (copy / LIST).unlink()
    assert "=best= cf_a_n003_milp" in (copy / "library.solu").read_text()
    records = solve_library(copy, solvers=["highs"], time_limit=250.0)
    assert [(record["entry"], record["status"]) for record in records] == [
        ("cf_a_n003_milp", "optimal"),
        ("cf_a_n003_qp", "optimal"),
    ]
    milp, bilinear = document(copy, "cf_a_n003_milp"), document(copy, "cf_a_n003_bilin1")
    assert (milp["status"], bilinear["status"]) == ("claimed", "claimed")
    assert bilinear["claimed"] == [milp["claimed"][0] | {"via": "cf_a_n003_milp"}]
    assert (milp["bounds"][0]["via"], bilinear["bounds"][0]["via"]) == (None, "cf_a_n003_milp")
    solu = (copy / "library.solu").read_text().splitlines()
    tags = {"optimal": "=opt=", "claimed": "=best="}
    entries = [document(copy, name) for name in document(copy, "library")["entries"]]
    optima = [f"{tags[one['status']]} {one['name']} {one['best']['objective']!r}" for one in entries]
    assert [line for line in solu if not line.startswith("=bestdual=")] == optima
    assert defects(copy) == {}
    assert solve_library(copy, solvers=["highs"], time_limit=250.0) == []
    ledger = copy / "ledger.json"
    ledger.write_text(ledger.read_text().replace('"threads": 1', '"threads": 2'))
    with pytest.raises(cf.OutputError, match=r"ledger\.json: is not crossfield's, or has changed"):
        solve_library(copy, solvers=["highs"])


@pytest.mark.slow
def test_every_installed_program_solves_its_problems(tmp_path):
    entries = OPEN.replace('"bilin1", "miqp", "exact", "cubic", ', "").replace("[6, 7]", "[6]")
    lib = library_of(tmp_path, entries).folder
    names = [
        name for name in ("gurobi", "cplex", "xpress", "scip", "cbc", "glpk") if not SOLVERS[name].missing
    ]
    records = solve_library(lib, solvers=[*names, "highs"], time_limit=60.0, machine="a machine")
    best = document(lib, MILP)["best"]["objective"]
    mine = {facts["solver"]: facts for facts in records if facts["entry"] == MILP}
    assert set(mine) == {SOLVERS[name].title for name in [*names, "highs"]}
    for record in mine.values():
        assert record["primal"] == pytest.approx(best, abs=2e-6)
        assert record["bound"] is None or record["bound"] <= best + 1e-6
        assert record["machine"] == "a machine"
    if len({SOLVERS[name].maker for name in names}) > 3:
        assert document(lib, MILP)["status"] == "agreed"
    assert defects(lib) == {}
    assert solve_library(lib, solvers=names, time_limit=60.0) == []


def test_a_limit_that_leaves_no_time_to_start_a_solver_is_counted_and_the_others_run(copy, capfd):
    """Writing a model takes longer than a nanosecond, which the command line does not accept as a limit."""
    solve_command(copy, solver=["highs"], time_limit=1e-9)
    said = capfd.readouterr().out
    assert said == f"{copy / 'ledger.json'}: 2 new records, 2 from runs without a point\n"
    runs = {(record.entry, record.status, record.seconds) for record in read_ledger(copy).records}
    assert runs == {("cf_a_n003_milp", "no point", None), ("cf_a_n003_qp", "no point", None)}


@pytest.mark.parametrize(
    "lines", [pytest.param(["2 of 2 runs"], marks=pytest.mark.slow), ["2 of 2 runs", "index"]]
)
def test_ctrl_c_keeps_the_runs_before_it_and_the_next_solve_completes_the_rest(copy, lines):
    """A progress presses Ctrl-C at the first line that contains one of these texts, and forgets it."""
    left = list(lines)

    def progress(line):
        if left and left[0] in line:
            left.pop(0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solve_library(copy, solvers=["highs"], time_limit=250.0, progress=progress)
    (record,) = read_ledger(copy).records
    findings = defects(copy)
    assert ("ledger.json" in findings) == ("index" in lines)
    assert not [what for what in findings.values() if "; remove it" in what]
    if not findings:
        milp = document(copy, "cf_a_n003_milp")
        assert (milp["status"], milp["best"]["objective"]) == ("claimed", pytest.approx(record.primal))
    records = solve_library(copy, solvers=["highs"], time_limit=250.0)
    assert [record["entry"] for record in records] == ["cf_a_n003_qp"]
    assert defects(copy) == {}


ABSENT = "no_such_package"
REFUSED = {
    "no library": (["."], None, ".: is no library"),
    "an unknown solver": (["copy", "--solver", "magic"], None, "there is no solver 'magic'"),
    "two lines": (["copy", "--by", "A. Name\nand others"], None, "by: "),
    "an unknown rung": (["copy", "--up-to", "huge"], None, "there is no rung 'huge'"),
    "a package that is absent": (["copy", "--solver", "highs"], None, f"not installed; pip install {ABSENT}"),
    "a program that is absent": (
        ["copy", "--solver", "glpk"], None, "GLPK is not installed; apt install glpk-utils"
    ),
    "no JSON": (["copy"], "{", "ledger.json: is not valid JSON"),
    "another kind": (["copy"], '{"format": "x"}', "is not a file of this kind"),
    "an empty record": (
        ["copy"], '{"format": "crossfield-ledger", "version": 1, "records": [{}]}', "$.records[0]"
    ),
    "no checksums": (["copy", "--solver", "highs"], "", "SHA256SUMS: cannot be read"),
}  # fmt: skip
"""Arguments, what the ledger holds, and the words of the error."""


@pytest.mark.parametrize("fault", REFUSED)
def test_a_solve_is_refused_before_any_run(fault, copy, tmp_path, monkeypatch, hidden, capfd):
    arguments, ledger, words = REFUSED[fault]
    monkeypatch.chdir(tmp_path)
    if "absent" in fault:
        hidden("glpsol")
        monkeypatch.setitem(SOLVERS, "highs", replace(SOLVERS["highs"], package=ABSENT))
    if ledger:
        (copy / "ledger.json").write_text(ledger)
    if fault == "no checksums":
        (copy / "SHA256SUMS").unlink()
    before = content(copy)
    assert invoke(["library", "solve", *arguments]) == 1
    (line,) = complaints(capfd.readouterr().err).splitlines()
    assert words in line
    assert content(copy) == before
