"""Simultaneous work on a library: processes wait, no result is lost, and a crash leaves no lock."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.library.building.build import build
from crossfield.export.library.checking.check_library import verify_library
from crossfield.export.library.documents import lock
from crossfield.export.library.documents.lock import locked
from crossfield.export.library.ledger.ledger import Record, add_record, merged, read_ledger, write_ledger
from crossfield.export.library.plan.spec import read_spec
from crossfield.models.errors import InputError, OutputError
from crossfield.models.field.file import read_field
from submitting import better_point

pytestmark = [pytest.mark.usefixtures("short_searches"), pytest.mark.slow]

SPEC = """format = "crossfield-library-spec"
version = 1
title = "a library for tests"
formulations = ["miqp-mccormick"]
[rungs.tiny]
sizes = [{size}]
formats = ["mps"]
[[sketches]]
name = "a"
random = "ragged"
seeds = [1, 2]
"""


def write_spec(folder, size=4, more=""):
    (folder / "spec.toml").write_text(SPEC.format(size=size) + more)
    return read_spec(folder / "spec.toml")


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("built")
    return build(write_spec(folder), folder / "library")


@pytest.fixture
def copy(built, tmp_path):
    return Path(shutil.copytree(built.folder, tmp_path / "library"))


@pytest.mark.slow
def test_submissions_at_one_moment_are_all_kept(tmp_path):
    copy = tmp_path / "library"
    names = [each["name"] for each in build(write_spec(tmp_path, size=6), copy).entries]
    files = [tmp_path / f"{name}.sol" for name in names]
    for file in files:
        better_point(copy, file.stem, file)
    command = [sys.executable, "-m", "crossfield", "library", "submit", str(copy)]
    others = [subprocess.Popen([*command, str(file)], stdout=subprocess.PIPE, text=True) for file in files]
    said = [other.communicate()[0] for other in others]
    assert [other.returncode for other in others] == [0] * len(files)
    better = [file.stem for file, words in zip(files, said, strict=True) if "accepted" in words]
    assert len(better) == len(files)
    assert {record.entry for record in read_ledger(copy).records if record.point} == set(better)
    assert verify_library(copy) == []
    assert not (copy / lock.FILE).exists()


HOLDER = """
import sys
from pathlib import Path
from crossfield.export.library.documents.lock import locked
with locked(Path(sys.argv[1]), "a test of the lock"):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def holder(copy):
    """A process that holds the lock of the library."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, copy], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout.readline() == b"held\n"
        yield process
        process.kill()


def test_a_process_that_waits_too_long_names_the_holder(copy, holder, monkeypatch, capsys):
    monkeypatch.setattr(lock, "PATIENCE", 0.3)
    said = []
    with pytest.raises(OutputError) as caught, locked(copy, "this test", said.append):
        pass
    assert said[0].startswith(f"this test waits for a test of the lock, process {holder.pid} on ")
    assert f"is held by a test of the lock, process {holder.pid} on " in str(caught.value)
    assert "this test waited 0.3 s for it: run it again when that has ended" in str(caught.value)
    assert invoke(["library", "build", str(copy.parent / "none.toml"), "-o", str(copy)]) == 1
    assert "cannot be read" in capsys.readouterr().err  # what is wrong anyway waits for nobody


@pytest.mark.slow
def test_a_verification_waits_for_changes_and_changes_for_it(copy, holder, monkeypatch):
    """Without a lock it reads files that are being written."""
    monkeypatch.setattr(lock, "PATIENCE", 0.3)
    said = []
    with pytest.raises(
        OutputError, match=r"is held by a test of the lock, .* a verification .* waited 0.3 s"
    ):
        verify_library(copy, progress=said.append)
    assert said[0].startswith("a verification of the library waits for a test of the lock, process ")
    holder.communicate()

    def change(line):
        with (
            pytest.raises(OutputError, match=r"is held by a verification of the library"),
            locked(copy, line),
        ):
            pass

    assert verify_library(copy, progress=change) == []
    assert not (copy / lock.FILE).exists()


def test_a_folder_that_cannot_be_written_is_verified_without_a_lock(copy):
    copy.chmod(0o555)
    try:
        if os.access(copy, os.W_OK):
            pytest.skip("who runs the tests may write everywhere")
        assert verify_library(copy) == []
    finally:
        copy.chmod(0o755)


def test_a_process_that_was_killed_locks_nobody_out(copy, holder, monkeypatch):
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    assert (copy / lock.FILE).exists()
    assert verify_library(copy) == []
    monkeypatch.setattr(lock, "PATIENCE", 0.0)
    with locked(copy, "this test"):
        assert (copy / lock.FILE).exists()
    assert not (copy / lock.FILE).exists()


def test_a_worse_field_does_not_replace_a_better_one_that_came_meanwhile(built, copy):
    document = built.entries[0]
    field = read_field(copy / f"{document['name'].rpartition('_')[0]}.field.json")
    stated = {"problem_sha256": document["problem_sha256"], "version": "1", "status": "feasible"}
    for solver, primal in (("first", 2.0), ("second", 3.0), ("third", 1.0)):
        add_record(copy, Record(entry=document["name"], solver=solver, primal=primal, **stated), field)
    assert {record.solver: record.point is not None for record in read_ledger(copy).records} == {
        "first": False,
        "second": False,
        "third": True,
    }


def test_a_build_that_is_refused_leaves_nothing(tmp_path):
    """The error of a drawing without strokes comes when its instance is made."""
    (tmp_path / "bare.scap").write_text("#9 9\n")
    spec = write_spec(
        tmp_path, more='[[sketches]]\nname = "bare"\nfile = "bare.scap"\nsizes = { tiny = [4] }\n'
    )
    with pytest.raises(InputError, match="holds no stroke"):
        build(spec, tmp_path / "new")
    assert not (tmp_path / "new").exists()
    (tmp_path / "old").mkdir()
    with pytest.raises(InputError, match="holds no stroke"):
        build(spec, tmp_path / "old")
    assert list((tmp_path / "old").iterdir()) == []


def test_a_ledger_is_merged_before_it_is_written(built, copy, tmp_path):
    document = built.entries[0]
    field = read_field(copy / f"{document['name'].rpartition('_')[0]}.field.json")
    record = Record(document["name"], document["problem_sha256"], "S", "1", "feasible", primal=1.0)
    kept = add_record(copy, record, field)
    (tmp_path / "new").mkdir()
    found = merged(tmp_path / "new", read_ledger(copy), [document["name"]], [])
    assert list((tmp_path / "new").iterdir()) == []
    assert found.field(kept).instance.sha256 == field.instance.sha256
    write_ledger(found)
    assert read_ledger(tmp_path / "new").records == (kept,)
    assert (tmp_path / "new" / kept.point).read_bytes() == (copy / kept.point).read_bytes()
