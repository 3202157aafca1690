"""Points, fields and certificates of others in a build: better ones are kept, bad ones cost nothing."""

import re
import shutil
from dataclasses import replace

import crossfield as cf
import highspy
import pytest
from children import complaints
from crossfield.export.cli.app import invoke
from crossfield.export.library.building.build import rebuild
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.documents import check_point
from crossfield.export.library.documents.documents import problem_of, read_library, read_sidecar
from crossfield.export.library.ledger.ledger import (
    Record,
    add_record,
    merge_ledgers,
    read_ledger,
    write_ledger,
)
from crossfield.export.library.ledger.points import complete_point
from crossfield.models.errors import InputError
from crossfield.models.formulations.names import column_names, decode_names
from libraries import OPEN, content, improve, library_of
from places import DATA, SOLUTIONS

STEM, OTHER = "cf_rand_n004_s6", "cf_rand_n004_s7"
MILP, BILINEAR, QP, EXACT, CUBIC = (f"{STEM}_{short}" for short in ("milp", "bilin1", "qp", "exact", "cubic"))


@pytest.fixture(scope="module")
def proof(opened):
    """The optimum of an instance of the library in the 2-norm, with its proof."""
    return cf.prove(cf.read_instance(opened / f"{STEM}.instance.json"), jobs=1)


@pytest.fixture(scope="module")
def answer(opened, tmp_path_factory):
    """A solution of HiGHS of an entry of the library: more digits than its own options leave."""
    path = tmp_path_factory.mktemp("answer") / f"{MILP}.sol"
    highs = highspy.Highs()
    for option, value in (
        ("output_flag", False), ("threads", 1), ("mip_rel_gap", 0.0), ("mip_abs_gap", 0.0),
        ("mip_feasibility_tolerance", 1e-9), ("primal_feasibility_tolerance", 1e-9)
    ):  # fmt: skip
        highs.setOptionValue(option, value)
    highs.readModel(str(opened / f"{MILP}.mps"))
    highs.run()
    highs.writeSolution(str(path), 0)
    return path


@pytest.fixture
def sent(tmp_path):
    (tmp_path / "sent").mkdir()
    return tmp_path / "sent"


def entry_of(lib, name=MILP):
    return read_sidecar(lib / f"{name}.json")


# what is better


def test_the_command_keeps_what_is_better_and_reports_what_it_refuses(
    opened, proof, answer, sent, tmp_path, capsys
):
    """Good, worse, forged and foreign files in one folder, beside files of other kinds."""
    shutil.copytree(opened.parent / "points", tmp_path / "points")
    shutil.copy(opened.parent / "spec.toml", tmp_path)
    command = ["library", "build", str(tmp_path / "spec.toml"), "-o", str(tmp_path / "lib")]
    assert invoke(command) == 0
    before = content(tmp_path / "lib")
    assert before == content(opened)

    (sent / "deeper").mkdir()
    shutil.copy(answer, sent / "deeper")
    cf.write_certificate(proof, sent / "proof.npz")
    cf.write_field(cf.greedy_field(proof.field.instance), sent / "worse.npz")
    data = (sent / "proof.npz").read_bytes()
    half = len(data) // 2
    (sent / "forged.npz").write_bytes(data[:half] + bytes([data[half] ^ 1]) + data[half + 1 :])
    foreign = replace(proof.field.instance, name="another")
    cf.write_certificate(cf.prove(foreign, jobs=1), sent / "foreign.npz")
    cf.write_field(cf.greedy_field(cf.sample("mouse", 4)), sent / "foreign.json")
    (sent / f"{BILINEAR}.sol").write_text(re.sub("alpha_00_00 .*", "alpha_00_00 nan", answer.read_text()))
    (sent / "notes.txt").write_text("hello")
    for name in ("ledger.json", f"{MILP}.json", f"{STEM}.instance.json"):
        shutil.copy(opened / name, sent)
    (sent / "endless.sol").symlink_to("/dev/zero")
    capsys.readouterr()

    assert invoke([*command, "--points", str(sent)]) == 1
    shown = capsys.readouterr()
    assert "; 2 of 7 points and certificates improve it\n" in shown.out
    refused = {line.split(": ")[1].rpartition("/")[2] for line in complaints(shown.err).splitlines()}
    assert refused == {"forged.npz", "foreign.npz", "foreign.json", f"{BILINEAR}.sol"}
    lib = tmp_path / "lib"
    for name in (EXACT, CUBIC):
        entry = entry_of(lib, name)
        assert (entry["status"], entry["difficulty"], entry["solved"]["by"]) == (
            "optimal",
            "hard",
            "certificate",
        )
        assert (lib / entry["bounds"][0]["certificate"]).read_bytes() == data
    assert entry_of(lib)["status"] == "best known"
    assert entry_of(lib)["best"]["objective"] < entry_of(opened)["best"]["objective"]
    assert verify_library(lib) == []

    after = content(lib)
    assert invoke([*command, "--points", str(sent)]) == 1
    assert "; 0 of 7 points and certificates improve it\n" in capsys.readouterr().out
    assert content(lib) == after
    assert invoke(command) == 0
    assert content(lib) == after


def test_the_folder_of_a_proof_is_taken_as_it_is(lib, sent, capsys):
    """Its other files are passed over."""
    instance = str(lib / f"{STEM}.instance.json")
    assert invoke(["prove", instance, "-o", str(sent), "--quiet"]) == 0
    improved, refused = improve(lib, sent)
    assert refused == {}
    assert {name for names in improved.values() for name in names} >= {EXACT, CUBIC}
    assert entry_of(lib, EXACT)["status"] == "optimal"
    assert verify_library(lib) == []


@pytest.mark.parametrize("suffix", ["npz", "json"])
def test_a_better_field_counts_for_every_entry_of_its_instance(lib, proof, sent, suffix):
    cf.write_field(proof.field, sent / f"it.{suffix}")
    improved, _ = improve(lib, sent)
    assert {EXACT, CUBIC} <= set(improved[f"it.{suffix}"])
    for name in improved[f"it.{suffix}"]:
        problem = problem_of(lib, entry_of(lib, name))
        best = entry_of(lib, name)["best"]["objective"]
        assert best == pytest.approx(problem.objective_value(complete_point(problem, proof.field)))
    assert verify_library(lib) == []
    assert improve(lib, sent) == ({f"it.{suffix}": []}, {})


def test_a_better_point_counts_for_the_entries_of_its_norm(lib, answer):
    before = entry_of(lib)["best"]["objective"]
    improved, _ = improve(lib, answer.parent)
    assert {MILP, BILINEAR} <= set(improved[answer.name])
    stated = float(re.search(r"^Objective (\S+)", answer.read_text(), re.MULTILINE)[1])
    for name in (MILP, BILINEAR):
        assert entry_of(lib, name)["best"]["objective"] == pytest.approx(stated, abs=1e-7)
    assert stated < before
    checked = check_point.check(str(lib / f"{MILP}.mps"), str(lib / f"{MILP}.sol"))
    assert float(checked.objective) == pytest.approx(stated, abs=1e-7)
    assert entry_of(lib, QP)["solved"]["by"] == "tangent"
    assert f"=best= {MILP} {entry_of(lib)['best']['objective']!r}" in (lib / "library.solu").read_text()
    assert verify_library(lib) == []


@pytest.mark.parametrize("norm, proven", [(1, {"milp", "bilin1"}), ("mixed", {"miqp"})])
def test_a_certificate_counts_for_the_entries_of_its_norm_alone(lib, proof, sent, norm, proven):
    cf.write_certificate(cf.prove(proof.field.instance, norm=norm, jobs=1), sent / "it.npz")
    improved, _ = improve(lib, sent)
    assert set(improved["it.npz"]) == {f"{STEM}_{name}" for name in proven}
    for name in proven:
        assert entry_of(lib, f"{STEM}_{name}")["status"] == "optimal"
    assert entry_of(lib, EXACT)["status"] == "best known"
    assert verify_library(lib) == []


def test_points_of_the_ledger_are_taken_over_by_another_build(lib, answer, tmp_path):
    improve(lib, answer.parent)
    again = library_of(tmp_path, 'points = "lib"\nledger = "lib/ledger.json"\n' + OPEN, "again").folder
    assert entry_of(again)["best"] == entry_of(lib)["best"]
    assert verify_library(again) == []


# what is refused


def point_of(lib):
    """The problem of an entry and its best known point."""
    sidecar = entry_of(lib)
    problem = problem_of(lib, sidecar)
    return problem, cf.read_solution(lib / sidecar["best"]["point"], problem).point.copy()


def write_point(problem, point, path):
    """Write the point as a list of names and values."""
    pairs = zip(decode_names(column_names(problem.instance, problem.blocks)), point.tolist(), strict=True)
    path.write_text("=obj= 0\n" + "".join(f"{name} {value!r}\n" for name, value in pairs))


def test_auxiliary_variables_are_computed_again(lib, sent):
    """A point whose residual in an auxiliary row is 1e-6 is as good as its angles and jumps."""
    problem, point = point_of(lib)
    for name in ("s", "t", "gamma", "psi"):
        point[problem.blocks[name].slice] -= 1e-6
    assert problem.violation(point).worst > 1e-7
    write_point(problem, point, sent / f"{MILP}.sol")
    assert improve(lib, sent) == ({f"{MILP}.sol": []}, {})


@pytest.mark.parametrize(
    "block, value", [("alpha", 9.5), ("beta", 0.7855), ("p1", 2.0), ("p2", 9.0), ("p1", 0.4)]
)
def test_angles_and_jumps_are_not_mended(block, value, lib, sent):
    problem, point = point_of(lib)
    point[problem.blocks[block].slice] = value
    write_point(problem, point, sent / f"{MILP}_mine.sol")
    before = content(lib)
    improved, refused = improve(lib, sent)
    assert improved == {}
    assert re.search(rf"violates {MILP} by .*, and 1e-08 is allowed", refused[f"{MILP}_mine.sol"])
    assert content(lib) == before


def test_a_refusal_names_the_file_and_the_reason_and_changes_nothing(lib, answer, sent):
    text = answer.read_text()
    unnamed = re.sub(r"sha256_\w+|(?<=ONE)_\w+", "", text)
    (sent / "unnamed.sol").write_text(unnamed)
    (sent / f"{OTHER}_milp.sol").write_text(unnamed.replace("alpha_00_00", "alpha_09_09"))
    shutil.copy(SOLUTIONS / "highs-1.15.1_infeasible_style0.sol", sent / f"{MILP}-none.sol")
    (sent / "cut.npz").write_bytes(b"PK\3\4")
    before = content(lib)
    improved, refused = improve(lib, sent)
    assert improved == {}
    assert "states no entry; begin its name with the name of the entry" in refused["unnamed.sol"]
    assert set(refused) == {"unnamed.sol", f"{OTHER}_milp.sol", f"{MILP}-none.sol", "cut.npz"}
    for name, reason in refused.items():
        assert reason.startswith(str(sent / name))
        assert "\n" not in reason
    assert content(lib) == before


def test_every_layout_of_answers_is_recognised(lib, sent):
    """Answers of another problem are refused by name, none is passed over."""
    files = [path for path in SOLUTIONS.iterdir() if path.is_file() and path.suffix == ".sol"]
    for path in files:
        shutil.copy(path, sent)
    for path in (DATA / "logs").glob("*.log"):
        shutil.copy(path, sent)
    improved, refused = improve(lib, sent)
    assert improved == {}
    assert {path.name for path in files} <= set(refused)


def test_a_folder_that_is_none_is_refused_before_the_build(opened, tmp_path, capsys):
    command = ["library", "build", str(opened.parent / "spec.toml"), "-o", str(tmp_path / "lib")]
    assert invoke([*command, "--points", str(tmp_path / "gone")]) == 1
    assert "gone: there is no such folder" in capsys.readouterr().err
    assert not (tmp_path / "lib").exists()


# ledgers


def test_the_best_run_of_each_solver_is_shown(lib):
    sidecar = entry_of(lib)
    best, sha = sidecar["best"]["objective"], sidecar["problem_sha256"]
    facts = {"status": "limit", "seconds": 3.0, "threads": 2, "time_limit": 60.0}
    for solver, bound in (("SCIP", 0.7), ("SCIP", 0.6), ("Own", 0.1)):
        add_record(lib, Record(MILP, sha, solver, "1", bound=bound * best, **facts))
    rebuild(lib)
    runs = entry_of(lib)["runs"]
    assert [(run["solver"], run["bound"] / best) for run in runs] == [
        ("Own", pytest.approx(0.1)),
        ("SCIP", pytest.approx(0.7)),
    ]
    assert runs[0]["limit"] == 60.0
    assert len(read_ledger(lib).records) == 3
    assert verify_library(lib) == []


def test_a_worse_field_does_not_replace_a_better_one_that_came_meanwhile(lib):
    document = read_library(lib).entries[0]
    field = cf.read_field(lib / f"{document['name'].rpartition('_')[0]}.field.json")
    facts = (document["name"], document["problem_sha256"])
    for solver, primal in (("first", 2.0), ("second", 3.0), ("third", 1.0)):
        add_record(lib, Record(*facts, solver, "1", "feasible", primal=primal), field)
    assert {kept.solver: kept.point is not None for kept in read_ledger(lib).records} == {
        "first": False,
        "second": False,
        "third": True,
    }


def test_a_ledger_is_merged_before_it_is_written(lib, tmp_path):
    document = read_library(lib).entries[0]
    field = cf.read_field(lib / f"{document['name'].rpartition('_')[0]}.field.json")
    record = Record(document["name"], document["problem_sha256"], "S", "1", "feasible", primal=1.0)
    kept = add_record(lib, record, field)
    (tmp_path / "new").mkdir()
    ledger = merge_ledgers(tmp_path / "new", read_ledger(lib), [record.entry], [])
    assert list((tmp_path / "new").iterdir()) == []
    assert ledger.read_field(kept).instance.sha256 == field.instance.sha256
    write_ledger(ledger)
    assert read_ledger(tmp_path / "new").records == (kept,)
    assert (tmp_path / "new" / kept.point).read_bytes() == (lib / kept.point).read_bytes()


def test_an_archive_is_refused_with_the_remedy(opened, tmp_path):
    packed = shutil.make_archive(str(tmp_path / "a"), "gztar", opened.parent, opened.name)
    for refused in (verify_library, lambda path: improve(opened, path)):
        with pytest.raises(InputError, match=r"a\.tar\.gz: is a file; unpack it, as with `tar -xzf`"):
            refused(packed)
