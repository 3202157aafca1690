"""Runs of installed solvers on a library, and the status of entries that follows from runs."""

import shutil
from dataclasses import replace
from itertools import combinations

import pytest
from children import complaints
from crossfield.export.cli.app import invoke
from crossfield.export.cli.library_command import solve_command
from crossfield.export.library.building.build import rebuild
from crossfield.export.library.building.table import read_table
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.contributions.solve import solve_library
from crossfield.export.library.documents.documents import read_library, read_sidecar
from crossfield.export.library.ledger.grades import (
    MAKERS,
    cut_bound,
    entry_status,
    is_proven,
    is_refuted,
    relative_gap,
)
from crossfield.export.library.ledger.ledger import Record, add_record, read_ledger
from crossfield.export.solvers_table import SOLVERS
from crossfield.models.errors import CrossfieldError, OutputError
from crossfield.models.written_files import LIST
from libraries import OPEN, library_of

MILP, BILINEAR = "cf_rand_n004_s6_milp", "cf_rand_n004_s6_bilin1"
SMALL = """formulations = ["bilin1", "milp", "qp"]
[rungs.tiny]
sizes = [3]
formats = ["mps"]
prove = false
[[sketches]]
name = "a"
sample = "mouse"
"""


@pytest.fixture(scope="module")
def small(short_searches, tmp_path_factory):
    """A library of one instance; not to be changed."""
    return library_of(tmp_path_factory.mktemp("small"), SMALL).folder


@pytest.fixture
def copy(small, tmp_path):
    return shutil.copytree(small, tmp_path / "copy")


def record_of(lib, solver, name=MILP, **changes):
    sidecar = read_sidecar(lib / f"{name}.json")
    facts = {"status": "optimal", "bound": sidecar["best"]["objective"]} | changes
    return Record(name, sidecar["problem_sha256"], solver, "1", **facts)


# bounds and status


def test_a_bound_a_little_above_a_point_is_cut_and_one_far_above_is_refuted():
    """A little above a feasible point a bound is cut to it; far above it is wrong."""
    assert cut_bound(8.4e-9, 1.3e-28) == 1.3e-28
    assert not is_refuted(8.4e-9, 1.3e-28)
    assert is_refuted(1e-3, 1.3e-28)
    assert cut_bound(0.4, 0.5) == 0.4
    assert is_proven(1.3e-28, cut_bound(8.4e-9, 1.3e-28))
    assert relative_gap(1.3e-28, 1.3e-28) == 0.0


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


def test_programs_of_three_makers_agree_on_an_entry_and_those_like_it_and_prove_nothing(lib):
    for solver in ("A", "B", "C", "CBC", "Bonmin", "HiGHS"):
        add_record(lib, record_of(lib, solver))
    rebuild(lib)
    sidecar = read_sidecar(lib / f"{MILP}.json")
    assert (sidecar["status"], len(sidecar["claimed"])) == ("claimed", 6)
    add_record(lib, record_of(lib, "Gurobi", BILINEAR))
    rebuild(lib)
    sidecar = read_sidecar(lib / f"{MILP}.json")
    assert (sidecar["status"], "solved" in sidecar) == ("agreed", False)
    programs = {program["solver"]: program for program in sidecar["claimed"]}
    assert set(programs) == {"A", "B", "C", "CBC", "Bonmin", "HiGHS", "Gurobi"}
    assert programs["Gurobi"]["via"] == BILINEAR
    solu = (lib / "library.solu").read_text()
    assert f"=best= {BILINEAR} " in solu
    assert f"=bestdual= {BILINEAR} " in solu
    (row,) = [row for row in read_table(lib / "entries.csv") if row["name"] == MILP]
    assert (row["status"], row["optimum"], row["solved"]) == ("agreed", None, None)
    assert verify_library(lib) == []


def test_a_bound_of_another_problem_is_never_taken(lib):
    other = replace(record_of(lib, "Any"), problem_sha256="0" * 64)
    for record in (other, record_of(lib, "Any", bound=0.001, status="limit")):
        add_record(lib, record)
    after = rebuild(lib).entry(MILP)
    assert [bound["bound"] for bound in after["bounds"]] == [0.001]
    assert after["status"] == "best known"
    assert len(read_ledger(lib).records) == 2


def test_a_bound_a_little_above_the_point_is_cut(lib):
    best = read_sidecar(lib / f"{MILP}.json")["best"]["objective"]
    add_record(lib, record_of(lib, "S", bound=best + 4e-7, status="limit"))
    again = rebuild(lib).entry(MILP)
    assert again["bound"] == best == max(bound["bound"] for bound in again["bounds"])
    assert (again["status"], again["gap"]) == ("claimed", 0.0)
    assert again["claimed"] == [{"solver": "S", "version": "1"}]
    assert verify_library(lib) == []


def test_a_bound_far_above_the_point_does_not_count_and_others_do(lib):
    """The library can still be built after a solver has exceeded its tolerances."""
    best = read_sidecar(lib / f"{MILP}.json")["best"]["objective"]
    add_record(lib, record_of(lib, "Xpress", bound=best + 1e-2))
    add_record(lib, record_of(lib, "HiGHS", bound=0.9 * best))
    again = rebuild(lib).entry(MILP)
    assert (again["status"], again["bound"]) == ("best known", 0.9 * best)
    assert [bound["solver"] for bound in again["bounds"]] == ["HiGHS"]
    assert [run.get("bound") for run in again["runs"]] == [0.9 * best, None]
    assert verify_library(lib) == []


# solving


@pytest.mark.slow
def test_solving_proves_optima_and_equivalent_entries_share_their_bounds(copy):
    assert "=opt= cf_a_n003_milp" not in (copy / "library.solu").read_text()
    records = solve_library(copy, solvers=["highs"], time_limit=250.0)
    assert [(record["entry"], record["status"]) for record in records] == [
        ("cf_a_n003_milp", "optimal"),
        ("cf_a_n003_qp", "optimal"),
    ]
    library = read_library(copy)
    milp, bilinear = library.entry("cf_a_n003_milp"), library.entry("cf_a_n003_bilin1")
    assert (milp["status"], bilinear["status"]) == ("claimed", "claimed")
    assert bilinear["claimed"] == [milp["claimed"][0] | {"via": "cf_a_n003_milp"}]
    assert milp["bounds"][0]["via"] is None
    assert bilinear["bounds"][0]["via"] == "cf_a_n003_milp"
    solu = (copy / "library.solu").read_text().splitlines()
    tags = {"optimal": "=opt=", "claimed": "=best="}
    optima = [
        f"{tags[entry['status']]} {entry['name']} {entry['best']['objective']!r}" for entry in library.entries
    ]
    assert [line for line in solu if not line.startswith("=bestdual=")] == optima
    assert solve_library(copy, solvers=["highs"], time_limit=250.0) == []


@pytest.mark.slow
def test_every_installed_program_solves_its_problems(opened, tmp_path):
    entries = OPEN.replace('"bilin1", "miqp", "exact", "cubic", ', "").replace("[6, 7]", "[6]")
    lib = library_of(tmp_path, f'points = "{opened}"\n{entries}').folder
    names = [
        name for name in ("gurobi", "cplex", "xpress", "scip", "cbc", "glpk") if not SOLVERS[name].missing
    ]
    records = solve_library(lib, solvers=[*names, "highs"], time_limit=60.0, machine="a machine")
    best = read_sidecar(lib / f"{MILP}.json")["best"]["objective"]
    mine = {facts["solver"]: facts for facts in records if facts["entry"] == MILP}
    assert set(mine) == {SOLVERS[name].title for name in [*names, "highs"]}
    for record in mine.values():
        assert record["primal"] == pytest.approx(best, abs=2e-6)
        assert record["bound"] is None or record["bound"] <= best + 1e-6
        assert record["machine"] == "a machine"
    if len({SOLVERS[name].maker for name in names}) > 3:
        assert read_sidecar(lib / f"{MILP}.json")["status"] == "agreed"
    assert verify_library(lib) == []
    assert solve_library(lib, solvers=names, time_limit=60.0) == []


def test_a_limit_that_leaves_no_time_to_start_a_solver_is_counted_and_the_others_run(copy, capfd):
    """Writing a model takes longer than a nanosecond, which the command line does not accept as a limit."""
    solve_command(copy, solver=["highs"], time_limit=1e-9)
    said = capfd.readouterr().out
    assert said == f"{copy / 'ledger.json'}: 2 new records, 2 from runs without a point\n"
    records = read_ledger(copy).records
    assert {record.entry for record in records} == {"cf_a_n003_milp", "cf_a_n003_qp"}
    assert {(record.status, record.seconds) for record in records} == {("no point", None)}


def test_a_release_without_hidden_files_is_solved_unless_its_ledger_was_changed(copy):
    (copy / LIST).unlink()
    records = solve_library(copy, solvers=["highs"], time_limit=250.0)
    assert [record["status"] for record in records] == ["optimal", "optimal"]
    assert verify_library(copy) == []
    ledger = copy / "ledger.json"
    ledger.write_text(ledger.read_text().replace('"threads": 1', '"threads": 2'))
    with pytest.raises(OutputError, match=r"ledger\.json: is not crossfield's, or has changed"):
        solve_library(copy, solvers=["highs"])


def interrupting(lines):
    """A progress that presses Ctrl-C at the first line that contains one of these texts, and forgets it."""
    left = list(lines)

    def progress(line):
        if left and left[0] in line:
            left.pop(0)
            raise KeyboardInterrupt

    return progress


def test_ctrl_c_keeps_the_runs_before_it_and_the_library_is_whole(copy):
    with pytest.raises(KeyboardInterrupt):
        solve_library(copy, solvers=["highs"], time_limit=250.0, progress=interrupting(["2 of 2 runs"]))
    (record,) = read_ledger(copy).records
    milp = read_sidecar(copy / "cf_a_n003_milp.json")
    assert (milp["status"], milp["best"]["objective"]) == ("claimed", pytest.approx(record.primal))
    assert verify_library(copy) == []


def test_an_interrupted_rebuild_is_completed_by_the_next_solve(copy):
    lines = interrupting(["2 of 2 runs", "index"])
    with pytest.raises(KeyboardInterrupt):
        solve_library(copy, solvers=["highs"], time_limit=250.0, progress=lines)
    findings = verify_library(copy)
    assert {"ledger.json"} <= {finding.file for finding in findings}
    assert not [finding for finding in findings if finding.remedy.startswith("remove")]
    assert [record["entry"] for record in solve_library(copy, solvers=["highs"], time_limit=250.0)] == [
        "cf_a_n003_qp"
    ]
    assert verify_library(copy) == []


def test_a_solver_that_is_not_installed_is_one_line(copy, monkeypatch, hidden):
    hidden("glpsol")
    with pytest.raises(CrossfieldError, match=r"^GLPK is not installed; apt install glpk-utils$"):
        solve_library(copy, solvers=["glpk"])
    monkeypatch.setitem(SOLVERS, "highs", replace(SOLVERS["highs"], package="no_such_package"))
    with pytest.raises(CrossfieldError, match=r"^HiGHS is not installed; pip install no_such_package$"):
        solve_library(copy, solvers=["highs"])
    assert read_ledger(copy).records == ()


def test_unknown_names_damaged_ledgers_and_folders_without_a_library_are_one_line(copy, tmp_path, capfd):
    for arguments, words in (
        (["solve", tmp_path], "is no library"),
        (["solve", copy, "--solver", "magic"], "there is no solver 'magic'"),
        (["solve", copy, "--up-to", "huge"], "there is no rung 'huge'"),
        (["build", tmp_path / "gone.toml", "-o", tmp_path / "x"], "gone.toml: cannot be read"),
        ("{", "ledger.json: is not valid JSON"),
        ('{"format": "x"}', "is not a file of this kind"),
        ('{"format": "crossfield-ledger", "version": 1, "records": [{}]}', "$.records[0]"),
    ):
        if isinstance(arguments, str):
            (copy / "ledger.json").write_text(arguments)
        command = ["solve", copy, "--quiet"] if isinstance(arguments, str) else arguments
        assert invoke(["library", *map(str, command)]) == 1
        shown = complaints(capfd.readouterr().err)
        assert len(shown.splitlines()) == 1
        assert words in shown
