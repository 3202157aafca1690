"""Submissions to a library: kinds of files, certificates, fields, points, and refusals."""

import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from functools import partial

import crossfield as cf
import highspy
import pytest
from children import complaints
from crossfield.export.cli.app import invoke
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.contributions import submit as submission
from crossfield.export.library.contributions.submit import submit
from crossfield.export.library.contributions.submitted_files import kind_of
from crossfield.export.library.documents import check_point
from crossfield.export.library.documents.documents import problem_of, read_sidecar
from crossfield.export.library.ledger.known_points import read_points
from crossfield.export.library.ledger.ledger import Record, add_record, read_ledger
from crossfield.export.library.ledger.points import complete_point
from crossfield.export.solutions.solution import read_solution
from crossfield.export.verify.comparison import name_list
from crossfield.models.errors import CrossfieldError, InputError, InstanceError, SolutionError
from crossfield.models.field.file import write_field
from crossfield.models.formulations.names import column_names
from crossfield.models.proof.certificate import write_certificate
from forging import change
from libraries import OPEN, content, library_of
from places import DATA, SOLUTIONS
from submitting import submit_one

STEM, OTHER = "cf_rand_n004_s6", "cf_rand_n004_s7"
MILP, BILINEAR, QP = (f"{STEM}_{short}" for short in ("milp", "bilin1", "qp"))


@pytest.fixture(scope="module")
def sent(opened, tmp_path_factory):
    """A folder of files to submit: certificates, better fields, and two solutions of HiGHS."""
    folder = tmp_path_factory.mktemp("sent")
    for stem in (STEM, OTHER):
        proof = cf.prove(cf.read_instance(opened / f"{stem}.instance.json"), jobs=1)
        assert write_certificate(proof, folder / f"{stem[-2:]}.npz").status == "optimal"
        for suffix in (".field.npz", ".json", ".rawfield"):
            write_field(proof.field, folder / f"{stem}_exact{suffix}")
        highs = highspy.Highs()
        for option, value in (
            ("output_flag", False), ("threads", 1), ("mip_rel_gap", 0.0), ("mip_abs_gap", 0.0),
            ("mip_feasibility_tolerance", 1e-9), ("primal_feasibility_tolerance", 1e-9)
        ):  # fmt: skip
            highs.setOptionValue(option, value)
        highs.readModel(str(opened / f"{stem}_milp.mps"))
        highs.run()
        highs.writeSolution(str(folder / f"{stem}_milp.sol"), 0)
    return folder


@pytest.fixture(scope="module")
def solved(opened, sent, tmp_path_factory):
    """The library after a solution of HiGHS was submitted, and the result; not to be changed."""
    lib = shutil.copytree(opened, tmp_path_factory.mktemp("solved") / "lib")
    facts = {"solver": "highs", "machine": "a machine", "by": "A. Name", "date": "2026-11-22"}
    return lib, submit_one(lib, sent / f"{MILP}.sol", **facts)


def entry_of(lib, name=MILP):
    return read_sidecar(lib / f"{name}.json")


# certificates and fields


def test_a_certificate_makes_every_entry_of_the_2_norm_optimal(lib, sent, tmp_path):
    before = {name: entry_of(lib, f"{STEM}_{name}") for name in ("exact", "cubic")}
    assert {(facts["status"], facts["difficulty"]) for facts in before.values()} == {("best known", "open")}
    result = submit_one(lib, sent / "s6.npz", by="A. Name")
    assert (result.kind, result.outcome, result.status) == ("certificate", "accepted", "optimal")
    assert set(result.entries) == {f"{STEM}_exact", f"{STEM}_cubic"}
    for name, old in before.items():
        entry = entry_of(lib, f"{STEM}_{name}")
        assert (entry["status"], entry["difficulty"]) == ("optimal", "hard")
        assert entry["solved"]["by"] == "certificate"
        (bound,) = entry["bounds"]
        assert (lib / bound["certificate"]).read_bytes() == (sent / "s6.npz").read_bytes()
        assert entry["best"]["objective"] < old["best"]["objective"]
        assert entry["best"]["by"] == "A. Name"
        assert f"=opt= {STEM}_{name} " in (lib / "library.solu").read_text()
    assert entry_of(lib)["status"] == "best known"
    assert verify_library(lib) == []
    assert submit_one(lib, sent / "s6.npz").outcome == "not better"

    again = library_of(tmp_path, 'points = "lib"\nledger = "lib/ledger.json"\n' + OPEN, "again")
    assert again.entry(f"{STEM}_exact")["status"] == "optimal"
    assert verify_library(again.folder) == []


@pytest.mark.parametrize("suffix", ["field.npz", "json", "rawfield"])
def test_a_better_field_counts_for_every_entry_of_its_instance(lib, sent, suffix):
    result = submit_one(lib, sent / f"{STEM}_exact.{suffix}", solver="Own", by="A. Name")
    assert {f"{STEM}_exact", f"{STEM}_cubic"} <= set(result.entries)
    for name in result.entries:
        assert entry_of(lib, name)["best"]["solver"] == "Own"
    assert result.objective < result.known
    assert verify_library(lib) == []
    assert submit_one(lib, sent / f"{STEM}_exact.{suffix}").outcome == "not better"


def test_the_command_states_by_how_much_a_point_must_be_better(lib, sent, capsys):
    submit_one(lib, sent / f"{STEM}_exact.json")
    assert invoke(["library", "submit", str(lib), str(sent / f"{STEM}_exact.field.npz")]) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert re.search(r"not better: objective (\S+), and \1 is known; .* lower by more than 1e-09 of it", said)


def test_an_entry_stands_for_a_manifest_when_its_answer_is_read(lib, sent, tmp_path):
    """The field of the answer, which only the sidecar and the instance next to it describe."""
    command = ["read", str(sent / f"{MILP}.sol"), "--manifest", str(lib / f"{MILP}.json")]
    assert invoke([*command, "-o", str(tmp_path / "f.npz"), "--quiet"]) == 0
    field = cf.read_field(tmp_path / "f.npz")
    problem = problem_of(lib, entry_of(lib))
    stated = re.search(r"^Objective (\S+)", (sent / f"{MILP}.sol").read_text(), re.MULTILINE)
    objective = problem.objective_value(complete_point(problem, field))
    assert objective == pytest.approx(float(stated[1]), rel=1e-6)
    assert invoke(["read", str(sent / f"{MILP}.sol"), "--manifest", str(lib / "LICENSE"), "-o", "f.npz"]) == 1


# many files


def test_files_of_all_kinds_in_one_call_are_one_rebuild_with_the_result_of_single_submissions(
    lib, sent, opened, tmp_path, monkeypatch
):
    names = ("s6.npz", f"{STEM}_exact.field.npz", f"{OTHER}_exact.json", f"{OTHER}_milp.sol", "s7.npz")
    files = [sent / name for name in names]
    single = shutil.copytree(opened, tmp_path / "single")
    expected = [submit_one(single, file) for file in files]
    rebuilds, rebuild = [], submission.rebuild_locked
    monkeypatch.setattr(submission, "rebuild_locked", lambda *a, **k: rebuilds.append(1) or rebuild(*a, **k))
    results = submit(lib, files)
    assert len(rebuilds) == 1
    assert [result.kind for result in results] == ["certificate", "field", "field", "solution", "certificate"]
    assert [(result.outcome, result.entries, result.objective) for result in results] == [
        (result.outcome, result.entries, result.objective) for result in expected
    ]
    assert [result.outcome for result in results] == [
        "accepted",
        "not better",
        "accepted",
        "accepted",
        "accepted",
    ]
    assert content(single) == content(lib)
    assert verify_library(lib) == []


def test_refused_files_do_not_stop_the_others(lib, sent, tmp_path, capsys):
    renamed = replace(cf.read_instance(lib / f"{STEM}.instance.json"), name="another")
    write_certificate(cf.prove(renamed, jobs=1), tmp_path / "elsewhere.npz")
    data = (sent / "s6.npz").read_bytes()
    half = len(data) // 2
    (tmp_path / "forged.npz").write_bytes(data[:half] + bytes([data[half] ^ 1]) + data[half + 1 :])
    (tmp_path / "notes.txt").write_text("hello")
    for number, stated in enumerate(("[]", "null", '"crossfield"')):
        (tmp_path / f"{number}.json").write_text(f'{{"format": {stated}}}')
    shutil.copy(lib / "ledger.json", tmp_path)
    names = ["elsewhere.npz", "forged.npz", "notes.txt", "gone.sol", *(f"{n}.json" for n in range(3))]
    files = [str(tmp_path / name) for name in (*names, "ledger.json")]
    command = ["library", "submit", str(lib), *files, str(sent / "s7.npz")]
    assert invoke([*command, "--json"]) == 1
    shown = capsys.readouterr()
    errors = complaints(shown.err).splitlines()
    assert [line.split(": ")[1] for line in errors] == files
    assert "of an instance that is not in the library" in errors[0]
    outcomes = [result["outcome"] for result in json.loads(shown.out)]
    assert outcomes == ["refused"] * len(files) + ["accepted"]
    assert invoke(command) == 1
    assert "not better" in capsys.readouterr().out
    assert entry_of(lib, f"{OTHER}_exact")["status"] == "optimal"
    assert verify_library(lib) == []


def test_a_folder_is_submitted_without_the_files_of_other_kinds(lib, sent):
    results = submit(lib, [sent])
    skipped = {result.file.suffix for result in results if result.outcome == "skipped"}
    assert "refused" not in {result.outcome for result in results}
    assert skipped == {".obj", ".sings"}
    assert entry_of(lib, f"{STEM}_exact")["status"] == "optimal"


def test_kinds_are_recognised_by_content(sent, lib, tmp_path):
    files = [path for path in SOLUTIONS.iterdir() if path.is_file() and path.suffix == ".sol"]
    assert {kind_of(path) for path in files} == {"solution"}
    assert {kind_of(path) for path in (DATA / "logs").glob("*.log")} <= {"", "solution"}
    for name, kind in (("s6.npz", "certificate"), (f"{STEM}_exact.field.npz", "field")):
        shutil.copy(sent / name, tmp_path / "anything")
        assert kind_of(tmp_path / "anything") == kind
    assert kind_of(lib / "library.json") == ""


# points


def test_a_better_point_is_kept_with_its_facts(sent, solved, opened, tmp_path, capsys):
    lib, happened = solved
    assert (happened.entries, happened.outcome, happened.status) == ((MILP,), "accepted", "best known")
    assert happened.better_point
    assert happened.known == entry_of(opened)["best"]["objective"] > happened.objective
    sidecar = entry_of(lib)
    (run,) = sidecar["runs"]
    stated = {"machine": "a machine", "by": "A. Name", "date": "2026-11-22"}
    assert run.items() >= stated.items()
    assert (run["solver"], run["status"]) == ("HiGHS", "feasible")
    assert run["objective"] == sidecar["best"]["objective"] == happened.objective
    assert (sidecar["best"]["solver"], sidecar["best"]["by"]) == ("HiGHS", "A. Name")
    assert entry_of(lib, BILINEAR)["best"]["objective"] == pytest.approx(happened.objective)
    assert entry_of(lib, BILINEAR)["runs"] == []
    assert entry_of(lib, QP)["solved"]["by"] == "tangent"
    solu = (lib / "library.solu").read_text().splitlines()
    assert f"=best= {MILP} {sidecar['best']['objective']!r}" in solu
    checked = check_point.check(str(lib / f"{MILP}.mps"), str(lib / f"{MILP}.sol"))
    assert float(checked.objective) == pytest.approx(happened.objective, rel=1e-9)
    assert checked.worst < 1e-12
    assert verify_library(lib) == []

    before = content(lib)
    shutil.copy(lib / f"{MILP}.sol", tmp_path / "any name.sol")
    for files in ([str(tmp_path / "any name.sol"), "--entry", MILP], [str(sent / f"{MILP}.sol")]):
        assert invoke(["library", "submit", str(lib), *files]) == 0
        assert "not better" in capsys.readouterr().out
    assert content(lib) == before


def test_a_build_takes_the_points_of_its_ledger_over(solved, opened, tmp_path):
    lib, _ = solved
    shutil.copytree(opened.parent / "points", tmp_path / "points")
    for path in (lib / "ledger.json", lib / f"{MILP}.field.json"):
        shutil.copy(path, tmp_path)
    again = library_of(tmp_path, 'ledger = "ledger.json"\npoints = "points"\n' + OPEN).folder
    assert content(again) == content(lib)
    assert content(again) != content(opened)


def states(before, after):
    """Files that a stopped submission has written: one by one, checksums last."""
    changed = [name for name in after if after[name] != before.get(name)]
    first = [name for name in changed if name == f"{MILP}.field.json"]
    rest = sorted(set(changed) - {*first, "ledger.json", "SHA256SUMS"})
    assert "SHA256SUMS" in changed
    for number in (0, len(rest) // 2, len(rest)):
        yield [*first, "ledger.json", *rest[:number]]
    yield first


@pytest.mark.slow
def test_the_next_submission_completes_one_that_was_stopped(opened, solved, sent, tmp_path):
    done, _ = solved
    before, after = content(opened), content(done)
    facts = {"solver": "highs", "machine": "a machine", "by": "A. Name", "date": "2026-11-22"}
    for number, written in enumerate(states(before, after)):
        lib = shutil.copytree(opened, tmp_path / str(number))
        for name in written:
            (lib / name).write_bytes(after[name])
        assert verify_library(lib)
        submit_one(lib, sent / f"{MILP}.sol", **facts)
        assert content(lib) == after


def test_auxiliary_variables_are_computed_again(solved, tmp_path):
    """A point whose residual in an auxiliary row is 1e-6 is as good as its angles and jumps."""
    lib = shutil.copytree(solved[0], tmp_path / "lib")
    problem, point = point_of(lib)
    for name in ("s", "t", "gamma", "psi"):
        point[problem.blocks[name].slice] -= 1e-6
    assert problem.violation(point).worst > 1e-7
    result = submit_one(lib, written(problem, point, tmp_path), entry=MILP)
    assert result.objective == pytest.approx(result.known, abs=1e-8)
    assert result.outcome == "not better"


@pytest.mark.parametrize(
    "block, value, words",
    [
        ("alpha", 9.5, "not a feasible point"),
        ("beta", 0.7855, "not a feasible point"),
        ("p1", 2.0, "not a feasible point"),
        ("p2", 9.0, "not a feasible point"),
        ("p1", 0.4, r"integrality 0\.4"),
    ],
)
def test_angles_and_jumps_are_not_mended(block, value, words, solved, tmp_path):
    """Angles and jumps of a solution have to be feasible without corrections."""
    problem, point = point_of(solved[0])
    point[problem.blocks[block].slice] = value
    with pytest.raises(SolutionError, match=words):
        submit_one(solved[0], written(problem, point, tmp_path), entry=MILP)


def point_of(lib):
    """The problem of an entry and its best known point."""
    sidecar = entry_of(lib)
    problem = problem_of(lib, sidecar)
    return problem, cf.read_solution(lib / sidecar["best"]["point"], problem).point.copy()


def written(problem, point, folder):
    """The point as a list of names and values."""
    pairs = zip(name_list(column_names(problem.instance, problem.blocks)), point.tolist(), strict=True)
    path = folder / "mine.sol"
    path.write_text("=obj= 0\n" + "".join(f"{name} {value!r}\n" for name, value in pairs))
    return path


# refusals


def test_an_invalid_submission_is_refused_in_one_line_and_changes_nothing(lib, sent, tmp_path):
    sol = (sent / f"{MILP}.sol").read_text()
    write_field(cf.greedy_field(cf.sample("mouse", 4)), tmp_path / "other.json")
    texts = {
        "none.txt": "no answer",
        "unnamed.sol": re.sub(r"sha256_\w+|(?<=ONE)_\w+", "", sol),
        "foreign.sol": sol.replace("alpha_00_00", "alpha_09_09"),
        "nan.sol": re.sub("alpha_00_00 .*", "alpha_00_00 nan", sol),
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    before = content(lib)
    for file, facts, words in (
        (tmp_path / "none.txt", {"entry": MILP}, "is no solution, field or certificate"),
        (tmp_path / "unnamed.sol", {}, "does not show its entry; name the entry"),
        (tmp_path / "foreign.sol", {"entry": MILP}, "are unknown"),
        (tmp_path / "nan.sol", {"entry": MILP}, "line"),
        (sent / f"{MILP}.sol", {"entry": f"{OTHER}_milp"}, "are unknown|another"),
        (sent / f"{MILP}.sol", {"entry": "cf_none_milp"}, "has no entry"),
        (sent / f"{MILP}.sol", {"entry": "../x"}, "has no entry"),
        (sent / f"{MILP}.sol", {"machine": "a\nb"}, "machine: .*; write one line"),
        (sent / f"{MILP}.sol", {"solver": "x" * 300}, "at most 200"),
        (sent / f"{MILP}.sol", {"date": "22.11.2026"}, "date: '22.11.2026' is no day"),
        (sent / f"{MILP}.sol", {"by": "\u202ereversed"}, "by: .*; write one line"),
        (sent / f"{MILP}.sol", {"version": "<script>"}, "version: '<script>' .*; write at most 60"),
        (tmp_path / "other.json", {}, r"other\.json: is a field of an instance that is not in the"),
        (sent / f"{STEM}_exact.json", {"entry": f"{OTHER}_exact"}, rf"{STEM}_exact\.json: "),
        (SOLUTIONS / "highs-1.15.1_infeasible_style0.sol", {"entry": MILP}, "holds no point"),
    ):
        with pytest.raises(CrossfieldError, match=words) as refused:
            submit_one(lib, file, **facts)
        assert "\n" not in str(refused.value)
        assert isinstance(refused.value, InputError | SolutionError | InstanceError)
    with pytest.raises(InputError, match="there is nothing to submit"):
        submit(lib, [])
    assert content(lib) == before


def test_a_certificate_needs_an_entry_of_its_norm(opened, sent, tmp_path):
    spec = OPEN.replace('"milp", "bilin1", "miqp", "exact", "cubic", "qp"', '"qp"')
    lib = library_of(tmp_path, f'points = "{opened}"\n' + spec.replace("[6, 7]", "[6]")).folder
    with pytest.raises(InputError, match=r"s6\.npz: proves a bound in the norm 2, which no entry"):
        submit_one(lib, sent / "s6.npz")


@pytest.mark.parametrize("norm, proven", [(1, {"milp", "bilin1"}), ("mixed", {"miqp"})])
def test_a_certificate_counts_for_the_entries_of_its_norm_alone(lib, sent, tmp_path, norm, proven):
    instance = cf.read_certificate(sent / "s6.npz").field.instance
    certificate = write_certificate(cf.prove(instance, norm=norm, jobs=1), tmp_path / "it.npz")
    assert certificate.status == "optimal"
    submit_one(lib, sent / "s6.npz")
    result = submit_one(lib, tmp_path / "it.npz")
    assert (result.outcome, set(result.entries)) == ("accepted", {f"{STEM}_{name}" for name in proven})
    for name in proven:
        entry = entry_of(lib, f"{STEM}_{name}")
        assert (entry["status"], entry["solved"]["by"]) == ("optimal", "certificate")
        assert entry["best"]["objective"] == pytest.approx(certificate.energy, abs=1e-9)
    for name in ("exact", "cubic"):
        (bound,) = entry_of(lib, f"{STEM}_{name}")["bounds"]
        assert (lib / bound["certificate"]).read_bytes() == (sent / "s6.npz").read_bytes()
    assert verify_library(lib) == []
    assert submit_one(lib, tmp_path / "it.npz").outcome == "not better"


def test_a_library_of_another_version_takes_no_points(lib, sent):
    change(lib / "library.json", generator="crossfield 0.0.1")
    with pytest.raises(InputError, match="was built by crossfield"):
        submit_one(lib, sent / f"{MILP}.sol")


def test_an_archive_is_refused_with_the_remedy(opened, sent, tmp_path):
    packed = shutil.make_archive(str(tmp_path / "a"), "gztar", opened.parent, opened.name)
    for refused in (partial(submit, files=[sent]), verify_library, read_points):
        with pytest.raises(InputError, match=r"a\.tar\.gz: is a file; unpack it, as with `tar -xzf`"):
            refused(packed)


# the best runs, and forged ones


def test_the_best_run_of_each_solver_is_shown(lib):
    sidecar = entry_of(lib)
    best, sha = sidecar["best"]["objective"], sidecar["problem_sha256"]
    facts = {"status": "limit", "seconds": 3.0, "threads": 2, "time_limit": 60.0}
    for solver, bound in (("SCIP", 0.7), ("SCIP", 0.6), ("Own", 0.1)):
        add_record(lib, Record(MILP, sha, solver, "1", bound=bound * best, **facts))
    submission.rebuild_locked(lib)
    runs = entry_of(lib)["runs"]
    assert [(run["solver"], run["bound"] / best) for run in runs] == [
        ("Own", pytest.approx(0.1)),
        ("SCIP", pytest.approx(0.7)),
    ]
    assert runs[0]["limit"] == 60.0
    assert len(read_ledger(lib).records) == 3
    assert verify_library(lib) == []


@pytest.mark.slow
def test_submissions_at_one_moment_are_all_kept(lib, sent):
    command = [sys.executable, "-m", "crossfield", "library", "submit", str(lib), "--quiet"]
    names = (f"{MILP}.sol", f"{OTHER}_milp.sol", "s6.npz", "s7.npz")
    others = [subprocess.Popen([*command, str(sent / name)]) for name in names]
    assert [other.wait() for other in others] == [0] * len(names)
    ledger = read_ledger(lib)
    assert sorted(record.entry for record in ledger.records if record.point) == [MILP, f"{OTHER}_milp"]
    assert sorted(certificate.instance for certificate in ledger.certificates) == [STEM, OTHER]
    assert verify_library(lib) == []
    assert not (lib / ".lock").exists()


def test_a_stamp_names_the_entry_without_reading_other_instances(lib, tmp_path):
    """The sidecars have the stamps; the damage of another instance is none of this entry's business."""
    sidecar = read_sidecar(lib / f"{MILP}.json")
    problem = problem_of(lib, sidecar)
    point = read_solution(lib / sidecar["best"]["point"], problem).point
    names = problem.to_arrays().column_names
    lines = [f"{name} {value!r}\n" for name, value in zip(names, point.tolist(), strict=True)]
    answer = tmp_path / "mine.sol"
    answer.write_text(f"# Solution for model obj_{problem.stamp}\n{''.join(lines)}")
    (lib / f"{OTHER}.instance.json").unlink()
    result = submit_one(lib, answer)
    assert (result.outcome, result.entries) == ("not better", (MILP,))
