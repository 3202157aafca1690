"""Submission of many files at once: recognition, certificates, one rebuild, refusals."""

import json
import shutil
from dataclasses import replace

import crossfield as cf
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.library.building.build import build
from crossfield.export.library.checking.check_library import verify_library
from crossfield.export.library.contributions import submit as submission
from crossfield.export.library.contributions.matching import kinds_of
from crossfield.export.library.contributions.submit import submit
from crossfield.export.library.documents.documents import read_library
from crossfield.export.library.plan.spec import read_spec
from crossfield.models.errors import InputError, InstanceError
from crossfield.models.field.file import write_field
from crossfield.models.proof.certificate import write_certificate
from forging import seal
from places import DATA, SOLUTIONS
from submitting import submit_one

pytestmark = pytest.mark.usefixtures("short_searches")

SPEC = """
format = "crossfield-library-spec"
version = 1
title = "A test"
formulations = ["miqp-exact", "minlp-cubic", "milp-mccormick"]

[rungs.tiny]
sizes = [4]
formats = ["mps"]
prove = false

[[sketches]]
name = "rand"
random = "full"
seeds = [6, 7]
"""
STEM, OTHER = "cf_rand_n004_s6", "cf_rand_n004_s7"
"""Instances whose greedy fields are not optimal."""
GUROBI = """Gurobi Optimizer version 13.0.3 build v13.0.3rc0 (linux64)
Read MPS format model from file {entry}.mps
Explored 1 nodes (0 simplex iterations) in 0.05 seconds (0.01 work units)
Optimal solution found (tolerance 1.00e-04)
Best objective 9.000000000000e+99, best bound 1.000000000000e-06, gap 0.0000%
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library without proofs whose points are greedy fields; not to be changed."""
    folder = tmp_path_factory.mktemp("open")
    (folder / "spec.toml").write_text(SPEC)
    points = folder / "points"
    shutil.copytree(build(read_spec(folder / "spec.toml"), folder / "searched").folder, points)
    for path in points.glob("*.about.json"):
        about = json.loads(path.read_text())
        about["fields"] = dict.fromkeys(about["fields"], about["fields"]["baseline"])
        path.write_text(json.dumps(about))
    (folder / "spec.toml").write_text('points = "points"\n' + SPEC)
    return build(read_spec(folder / "spec.toml"), folder / "lib").folder


@pytest.fixture(scope="module")
def sent(built, tmp_path_factory):
    """A folder of files to submit: certificates, better fields, and a log."""
    folder = tmp_path_factory.mktemp("sent")
    for stem in (STEM, OTHER):
        proof = cf.prove(cf.read_instance(built / f"{stem}.instance.json"), jobs=1)
        assert write_certificate(proof, folder / f"{stem[-2:]}.npz").status == "optimal"
        for suffix in (".field.npz", ".json", ".rawfield"):
            write_field(proof.field, folder / f"{stem}_exact{suffix}")
    (folder / "run.log").write_text(GUROBI.format(entry=f"{OTHER}_milp"))
    return folder


@pytest.fixture
def lib(built, tmp_path):
    return shutil.copytree(built, tmp_path / "lib")


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != ".lock"}


def test_a_certificate_makes_every_entry_of_the_2_norm_optimal(lib, sent):
    before = {name: read_library(lib).entry(f"{STEM}_{name}") for name in ("exact", "cubic")}
    assert {(each["status"], each["difficulty"]) for each in before.values()} == {("best known", "open")}
    result = submit_one(lib, sent / "s6.npz", by="A. Name")
    assert (result.kind, result.outcome, result.status) == ("certificate", "accepted", "optimal")
    assert set(result.entries) == {f"{STEM}_exact", f"{STEM}_cubic"}
    for name, old in before.items():
        entry = read_library(lib).entry(f"{STEM}_{name}")
        assert (entry["status"], entry["difficulty"], entry["solved"]["by"]) == (
            "optimal",
            "hard",
            "certificate",
        )
        (bound,) = entry["bounds"]
        assert (lib / bound["certificate"]).read_bytes() == (sent / "s6.npz").read_bytes()
        assert entry["best"]["objective"] < old["best"]["objective"]
        assert entry["best"]["by"] == "A. Name"
        assert f"=opt= {STEM}_{name} " in (lib / "library.solu").read_text()
    assert read_library(lib).entry(f"{STEM}_milp")["status"] == "best known"
    assert verify_library(lib) == []
    assert submit_one(lib, sent / "s6.npz").outcome == "not better"


def test_a_library_is_built_again_from_a_ledger_with_a_certificate(lib, sent, tmp_path):
    submit_one(lib, sent / "s6.npz")
    beside = tmp_path / "beside"
    beside.mkdir()
    for path in (lib / "ledger.json", *lib.glob("*.certificate.npz")):
        shutil.copy(path, beside)
    shutil.copytree(lib.parent / "lib", beside / "points")
    (beside / "spec.toml").write_text('points = "points"\nledger = "ledger.json"\n' + SPEC)
    again = build(read_spec(beside / "spec.toml"), tmp_path / "again")
    assert again.entry(f"{STEM}_exact")["status"] == "optimal"
    assert verify_library(again.folder) == []


def test_a_damaged_or_unused_certificate_of_the_ledger_is_found(lib, sent):
    submit_one(lib, sent / "s6.npz")
    document = json.loads((lib / "ledger.json").read_text())
    document["certificates"][0]["instance"] = "cf_gone_n003"
    (lib / "ledger.json").write_text(json.dumps(document))
    (path,) = lib.glob("*.certificate.npz")
    shutil.copy(sent / "s7.npz", path)
    seal(lib)
    found = " ".join(map(str, verify_library(lib)))
    assert "has a certificate of cf_gone_n003, which is not in the library" in found
    assert "is another file than the one its ledger names" in found
    assert f"is not a certificate of {STEM}" in found


def test_files_of_all_kinds_in_one_call_are_one_rebuild_with_the_result_of_single_submissions(
    lib, sent, built, tmp_path, monkeypatch
):
    names = ("s6.npz", f"{STEM}_exact.field.npz", f"{OTHER}_exact.json", "run.log", "s7.npz")
    files = [sent / name for name in names]
    single = shutil.copytree(built, tmp_path / "single")
    expected = [submit_one(single, file) for file in files]
    rebuilds = []
    rebuilt = submission.rebuilt
    monkeypatch.setattr(submission, "rebuilt", lambda *a, **k: rebuilds.append(1) or rebuilt(*a, **k))
    found = submit(lib, files)
    assert len(rebuilds) == 1
    assert [each.kind for each in found] == ["certificate", "field", "field", "log", "certificate"]
    assert [(each.outcome, each.entries, each.objective) for each in found] == [
        (each.outcome, each.entries, each.objective) for each in expected
    ]
    assert [each.outcome for each in found] == ["accepted", "not better", "accepted", "accepted", "accepted"]
    differing = [name for name, data in content(single).items() if content(lib)[name] != data]
    assert (differing, len(list(lib.iterdir()))) == ([], len(list(single.iterdir())))
    assert verify_library(lib) == []


def test_refused_files_do_not_stop_the_others(lib, sent, tmp_path, capsys):
    renamed = replace(cf.read_instance(lib / f"{STEM}.instance.json"), name="another")
    write_certificate(cf.prove(renamed, jobs=1), tmp_path / "elsewhere.npz")
    data = (sent / "s6.npz").read_bytes()
    half = len(data) // 2
    (tmp_path / "forged.npz").write_bytes(data[:half] + bytes([data[half] ^ 1]) + data[half + 1 :])
    (tmp_path / "notes.txt").write_text("hello")
    names = ("elsewhere.npz", "forged.npz", "notes.txt", "gone.sol")
    files = [str(tmp_path / name) for name in names]
    command = ["library", "submit", str(lib), *files, str(sent / "s7.npz")]
    assert invoke([*command, "--json"]) == 1
    shown = capsys.readouterr()
    errors = [line for line in shown.err.splitlines() if line.startswith("crossfield: ")]
    assert [line.split(": ")[1] for line in errors[-4:]] == files
    assert "of an instance that is not in the library" in errors[-4]
    outcomes = [each["outcome"] for each in json.loads(shown.out)]
    assert outcomes == ["refused"] * 4 + ["accepted"]
    assert invoke(command) == 1
    assert "not better" in capsys.readouterr().out
    assert read_library(lib).entry(f"{OTHER}_exact")["status"] == "optimal"
    assert verify_library(lib) == []


def test_a_certificate_needs_an_entry_of_its_norm(sent, tmp_path):
    (tmp_path / "spec.toml").write_text(
        SPEC.replace('"miqp-exact", "minlp-cubic", ', "").replace("[6, 7]", "[6]")
    )
    lib = build(read_spec(tmp_path / "spec.toml"), tmp_path / "lib").folder
    with pytest.raises(InputError, match=r"s6\.npz: proves a bound of the 2-norm, which no entry"):
        submit_one(lib, sent / "s6.npz")


def test_a_folder_is_submitted_without_the_files_of_other_kinds(lib, sent):
    found = submit(lib, [sent])
    outcomes = {path.name: each.outcome for each in found for path in each.files}
    assert "refused" not in outcomes.values()
    assert {name.split(".")[-1] for name, outcome in outcomes.items() if outcome == "skipped"} == {
        "obj",
        "sings",
    }
    assert read_library(lib).entry(f"{STEM}_exact")["status"] == "optimal"


@pytest.mark.parametrize("suffix", ["field.npz", "json", "rawfield"])
def test_a_better_field_counts_for_every_entry_of_its_instance(lib, sent, suffix):
    result = submit_one(lib, sent / f"{STEM}_exact.{suffix}", solver="Own", by="A. Name")
    assert {f"{STEM}_exact", f"{STEM}_cubic"} <= set(result.entries)
    for name in result.entries:
        best = read_library(lib).entry(name)["best"]
        assert best["solver"] == "Own"
    assert result.objective < result.known
    assert verify_library(lib) == []
    assert submit_one(lib, sent / f"{STEM}_exact.{suffix}").outcome == "not better"


def test_a_field_of_another_instance_or_entry_is_refused(lib, sent, tmp_path):
    write_field(cf.greedy_field(cf.sample("mouse", 4)), tmp_path / "other.json")
    with pytest.raises(InputError, match=r"other\.json: is a field of an instance that is not in the"):
        submit_one(lib, tmp_path / "other.json")
    with pytest.raises(InstanceError, match=rf"{STEM}_exact\.json: "):
        submit_one(lib, sent / f"{STEM}_exact.json", entry=f"{OTHER}_exact")


def test_the_ledger_of_another_copy_is_submitted_with_its_files(lib, sent, built, tmp_path):
    other = shutil.copytree(built, tmp_path / "other")
    submit(other, [sent])
    found = submit(lib, [other / "ledger.json"])
    assert {each.outcome for each in found} == {"accepted", "not better"}
    for name in (f"{STEM}_exact", f"{OTHER}_milp"):
        mine, theirs = read_library(lib).entry(name), read_library(other).entry(name)
        assert mine["status"] == theirs["status"]
        assert mine["best"]["objective"] == pytest.approx(theirs["best"]["objective"], rel=1e-9)
    assert read_library(lib).entry(f"{OTHER}_milp")["runs"][0]["evidence"] == "log"
    assert verify_library(lib) == []


def test_a_certificate_that_its_ledger_does_not_name_is_refused(lib, sent, built, tmp_path):
    other = shutil.copytree(built, tmp_path / "other")
    submit(other, [sent / "s6.npz"])
    (certificate,) = other.glob("*.certificate.npz")
    shutil.copy(sent / "s7.npz", certificate)
    (found,) = submit(lib, [other / "ledger.json"])
    assert (found.outcome, found.files) == ("refused", (certificate,))
    assert "is another file than the one its ledger names" in str(found.error)


@pytest.mark.parametrize("stated", ["[]", "{}", "null", "7", '"crossfield"'])
def test_a_file_of_an_unknown_format_is_refused_and_the_others_are_kept(lib, sent, tmp_path, stated):
    (tmp_path / "odd.json").write_text(f'{{"format": {stated}}}')
    (tmp_path / "list.json").write_text(f"[{stated}]")
    found = submit(lib, [tmp_path / "odd.json", sent / "s6.npz", tmp_path / "list.json"])
    assert [each.outcome for each in found] == ["refused", "accepted", "refused"]


def test_kinds_are_recognised_by_content(sent, lib, tmp_path):
    files = [path for path in SOLUTIONS.iterdir() if path.is_file() and path.suffix == ".sol"]
    assert {frozenset(kinds_of(path)) for path in files} == {frozenset({"solution"})}
    logs = (DATA / "logs").glob("*.log")
    assert {frozenset(kinds_of(path)) for path in logs} == {frozenset({"log"})}
    for name, kind in (("s6.npz", "certificate"), (f"{STEM}_exact.field.npz", "field")):
        shutil.copy(sent / name, tmp_path / "anything")
        assert kinds_of(tmp_path / "anything") == {kind}
    assert kinds_of(lib / "ledger.json") == {"ledger"}
    assert kinds_of(lib / "library.json") == set()
    both = SOLUTIONS / "tiny" / "baron-26.5.27_pair_optimal_res.lst"
    assert kinds_of(both) == {"solution", "log"}


def test_a_submission_without_files_or_with_a_bound_for_several_is_refused(lib, sent):
    before = content(lib)
    for files, facts, words in (
        ([], {}, "there is nothing to submit"),
        ([sent / "run.log", sent / "s6.npz"], {"bound": 0.0}, "a bound or status belongs to one run"),
        ([sent / "s6.npz"], {"status": "optimal"}, "a bound or status belongs to one run"),
    ):
        with pytest.raises(InputError, match=words):
            submit(lib, files, facts=replace(submission.RunFacts(), **facts))
    assert content(lib) == before
