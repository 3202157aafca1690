"""Points, fields and certificates of others in a build: better ones are kept, bad ones cost nothing."""

import json
import re
import shutil

import crossfield as cf
import pytest
from answers import by_highs
from children import complaints
from command_line import invoke
from crossfield.export.library.documents import check_point
from crossfield.export.library.ledger.ledger import Record, add_record, read_ledger
from forging import change
from instance_kinds import kind
from libraries import OPEN, build, content, defects, document, improve, library_of, problem, read_spec
from loops import for_each
from places import SOLUTIONS

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
    exactly = {"mip_feasibility_tolerance": 1e-9, "primal_feasibility_tolerance": 1e-9}
    return by_highs(opened / f"{MILP}.mps", path, mip_abs_gap=0.0, **exactly)


@pytest.fixture
def sent(tmp_path):
    (tmp_path / "sent").mkdir()
    return tmp_path / "sent"


def best(lib, name=MILP):
    """The objective of the best point of an entry."""
    return document(lib, name)["best"]["objective"]


# What is better


def test_the_command_keeps_what_is_better_and_reports_what_it_refuses(
    opened, lib, proof, answer, sent, tmp_path, capsys
):
    """Good, worse, forged and foreign files in one folder, and files of other kinds, as those of a proof."""
    shutil.copy(opened.parent / "spec.toml", tmp_path)
    command = ["library", "build", str(tmp_path / "spec.toml"), "-o", str(lib)]
    (sent / "deeper").mkdir()
    shutil.copy(answer, sent / "deeper")
    certificate = sent / "deeper" / "it.certificate.npz"
    cf.write_certificate(proof, certificate)
    data, half = certificate.read_bytes(), certificate.stat().st_size // 2
    (sent / "q_forged.npz").write_bytes(data[:half] + bytes([data[half] ^ 1]) + data[half + 1 :])
    cf.write_field(cf.greedy_field(proof.field.instance), sent / "worse.npz")
    cf.write_certificate(cf.prove(kind("full"), jobs=1), sent / "foreign.npz")
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
    assert refused == {"q_forged.npz", "foreign.npz", "foreign.json", f"{BILINEAR}.sol"}
    for name in (EXACT, CUBIC):
        entry = document(lib, name)
        facts = (entry["status"], entry["difficulty"], entry["solved"]["by"])
        assert facts == ("optimal", "hard", "certificate")
        assert (lib / entry["bounds"][0]["certificate"]).read_bytes() == data
    assert document(lib, MILP)["status"] == "best known"
    assert best(lib) < best(opened)
    assert defects(lib) == {}

    after = content(lib)
    assert invoke([*command, "--points", str(sent)]) == 1
    assert "; 0 of 7 points and certificates improve it\n" in capsys.readouterr().out
    assert content(lib) == after
    assert invoke(command) == 0
    assert content(lib) == after


def test_a_better_field_counts_for_every_entry_of_its_instance(lib, proof, sent):
    cf.write_field(proof.field, sent / "it.json")
    improved, _ = improve(lib, sent)
    assert {EXACT, CUBIC} <= set(improved["it.json"])
    for name in improved["it.json"]:
        entry = problem(lib, name)
        assert best(lib, name) == pytest.approx(entry.objective_value(entry.point(proof.field)))
    assert improve(lib, sent) == ({"it.json": []}, {})


def test_a_better_point_counts_for_the_entries_of_its_norm_and_in_another_build(lib, answer, tmp_path):
    before = best(lib)
    improved, _ = improve(lib, answer.parent)
    assert {MILP, BILINEAR} <= set(improved[answer.name])
    stated = float(re.search(r"^Objective (\S+)", answer.read_text(), re.MULTILINE)[1])
    assert stated < before
    for name in (MILP, BILINEAR):
        assert best(lib, name) == pytest.approx(stated, abs=1e-7)
    checked = check_point.check(str(lib / f"{MILP}.mps"), str(lib / f"{MILP}.sol"))
    assert float(checked.objective) == pytest.approx(stated, abs=1e-7)
    assert document(lib, QP)["solved"]["by"] == "tangent"
    assert f"=best= {MILP} {best(lib)!r}" in (lib / "library.solu").read_text()
    again = library_of(tmp_path, 'points = "lib"\nledger = "lib/ledger.json"\n' + OPEN, "again").folder
    assert document(again, MILP)["best"] == document(lib, MILP)["best"]


@pytest.mark.parametrize("norm, proven", [(1, {"milp", "bilin1"}), ("mixed", {"miqp"})])
def test_a_certificate_counts_for_the_entries_of_its_norm_alone(lib, proof, sent, norm, proven):
    cf.write_certificate(cf.prove(proof.field.instance, norm=norm, jobs=1), sent / "it.npz")
    improved, _ = improve(lib, sent)
    assert set(improved["it.npz"]) == {f"{STEM}_{name}" for name in proven}
    for name in proven:
        assert document(lib, f"{STEM}_{name}")["status"] == "optimal"
    assert document(lib, EXACT)["status"] == "best known"


def test_a_worse_field_does_not_replace_a_better_one_that_came_meanwhile(lib):
    field, sha256 = cf.read_field(lib / f"{STEM}.field.json"), document(lib, MILP)["problem_sha256"]
    for solver, primal in (("first", 2.0), ("second", 1.0), ("third", 3.0)):
        add_record(lib, Record(MILP, sha256, solver, "1", "feasible", primal=primal), field)
    assert [record.solver for record in read_ledger(lib).records if record.point] == ["second"]


# What is refused


def write_point(lib, path, changes):
    """Write the best point of an entry, changed in some blocks, as a list of names and values."""
    entry = problem(lib, MILP)
    point = cf.read_solution(lib / document(lib, MILP)["best"]["point"], entry).point.copy()
    for block, change_it in changes.items():
        part = entry.blocks[block].slice
        point[part] = change_it(point[part])
    pairs = zip(entry.to_arrays().column_names.tolist(), point.tolist(), strict=True)
    path.write_text("=obj= 0\n" + "".join(f"{name} {value!r}\n" for name, value in pairs))
    return entry.violation(point).worst


def test_auxiliary_variables_are_computed_again(lib, sent):
    """A point whose residual in an auxiliary row is 1e-6 is as good as its angles and jumps."""
    less = dict.fromkeys(("s", "t", "gamma", "psi"), lambda values: values - 1e-6)
    assert write_point(lib, sent / f"{MILP}.sol", less) > 1e-7
    assert improve(lib, sent) == ({f"{MILP}.sol": []}, {})


def test_angles_and_jumps_are_not_mended(lib, sent):
    for block, value in (("alpha", 9.5), ("beta", 0.7855), ("p1", 2.0), ("p2", 9.0), ("p1", 0.4)):
        write_point(lib, sent / f"{MILP}_{block}_{value}.sol", {block: lambda _, value=value: value})
    before = content(lib)
    improved, refused = improve(lib, sent)
    assert (improved, len(refused)) == ({}, 5)
    for reason in refused.values():
        assert re.search(rf"violates {MILP} by .*, and 1e-08 is allowed", reason)
    assert content(lib) == before


def test_a_refusal_names_the_file_and_the_reason_and_changes_nothing(lib, answer, sent):
    unnamed = re.sub(r"sha256_\w+|(?<=ONE)_\w+", "", answer.read_text())
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


@for_each("name, reason", [("gone", "there is no such folder"), ("a.tar.gz", "is a file; unpack it")])
def test_what_is_no_folder_is_refused_before_the_build(name, reason, opened, tmp_path, capsys):
    (tmp_path / "a.tar.gz").write_bytes(b"\x1f\x8b")
    command = ["library", "build", str(opened.parent / "spec.toml"), "-o", str(tmp_path / "lib")]
    assert invoke([*command, "--points", str(tmp_path / name)]) == 1
    assert f"{name}: {reason}" in complaints(capsys.readouterr().err)
    assert not (tmp_path / "lib").exists()


def test_a_ledger_with_a_damaged_or_missing_field_is_refused(lib, answer, tmp_path):
    improve(lib, answer.parent)
    field = max(record.point for record in read_ledger(lib).records if record.point)
    for data in (b"{}", None):
        (lib / field).write_bytes(data) if data else (lib / field).unlink()
        with pytest.raises((cf.InputError, cf.InstanceError), match=re.escape(field)):
            library_of(tmp_path, 'ledger = "lib/ledger.json"\n' + OPEN, "again")
        assert list((tmp_path / "again").iterdir()) == []
    change(lib / "ledger.json", records=[{}])
    with pytest.raises(cf.InstanceError, match=r"ledger\.json: \$\.records\[0\]"):
        library_of(tmp_path, 'ledger = "lib/ledger.json"\n' + OPEN, "again")


@pytest.mark.slow
def test_a_build_that_is_forced_does_without_files_that_its_ledger_has_lost(opened, lib, answer, proof, sent):
    """The entries are built again without them, and the same points can be sent again."""
    shutil.copy(answer, sent)
    cf.write_certificate(proof, sent / "proof.npz")
    improve(lib, sent)
    improved, ledger, spec = content(lib), read_ledger(lib), read_spec(opened.parent / "spec.toml")
    lost = [name for name in ledger.files if name in improved]
    assert len(lost) > 2
    for name in lost:
        (lib / name).unlink()
    with pytest.raises(cf.InputError, match=r"cannot be read"):
        build(spec, lib)
    build(spec, lib, force=True)
    assert len(read_ledger(lib).records) == len(ledger.records)
    assert not read_ledger(lib).files
    assert [best(lib, name) for name in (MILP, EXACT)] == [best(opened, name) for name in (MILP, EXACT)]
    assert defects(lib) == {}
    assert improve(lib, sent)[1] == {}
    assert [best(lib, name) for name in (MILP, EXACT)] == [
        json.loads(improved[f"{name}.json"])["best"]["objective"] for name in (MILP, EXACT)
    ]
