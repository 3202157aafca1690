"""Simultaneous work on a library: processes wait, no result is lost, and a crash leaves no lock."""

import os
import signal
import subprocess
import sys
from dataclasses import replace

import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.library.building.build import build
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.documents import lock
from crossfield.export.library.documents.documents import read_library
from crossfield.export.library.documents.lock import library_lock
from crossfield.export.library.ledger.ledger import (
    Record,
    add_record,
    merge_ledgers,
    read_ledger,
    write_ledger,
)
from crossfield.models.errors import InputError, OutputError
from crossfield.models.field.file import read_field
from libraries import spec_of

pytestmark = pytest.mark.slow

HOLDER = """
import sys
from pathlib import Path
from crossfield.export.library.documents.lock import library_lock
with library_lock(Path(sys.argv[1]), "a test of the lock"):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def holder(lib):
    """A process that holds the lock of the library."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, lib], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout.readline() == b"held\n"
        yield process
        process.kill()


def test_a_process_that_waits_too_long_names_the_holder(lib, holder, monkeypatch, capsys):
    monkeypatch.setattr(lock, "PATIENCE", 0.3)
    said = []
    with pytest.raises(OutputError) as caught, library_lock(lib, "this test", said.append):
        pass
    assert said[0].startswith(f"this test waits for a test of the lock, process {holder.pid} on ")
    assert f"is held by a test of the lock, process {holder.pid} on " in str(caught.value)
    assert "this test waited 0.3 s for it: run it again when that has ended" in str(caught.value)
    assert invoke(["library", "build", str(lib.parent / "none.toml"), "-o", str(lib)]) == 1
    assert "cannot be read" in capsys.readouterr().err  # what is wrong anyway waits for nobody


@pytest.mark.slow
def test_a_verification_waits_for_changes_and_changes_for_it(lib, holder, monkeypatch):
    """Without a lock it reads files that are being written."""
    monkeypatch.setattr(lock, "PATIENCE", 0.3)
    said = []
    with pytest.raises(
        OutputError, match=r"is held by a test of the lock, .* a verification .* waited 0.3 s"
    ):
        verify_library(lib, progress=said.append)
    assert said[0].startswith("a verification of the library waits for a test of the lock, process ")
    holder.communicate()

    def change(line):
        with (
            pytest.raises(OutputError, match=r"is held by a verification of the library"),
            library_lock(lib, line),
        ):
            pass

    assert verify_library(lib, progress=change) == []
    assert not (lib / lock.LOCK).exists()


def test_a_folder_that_cannot_be_written_is_verified_without_a_lock(lib):
    lib.chmod(0o555)
    try:
        if os.access(lib, os.W_OK):
            pytest.skip("who runs the tests may write everywhere")
        assert verify_library(lib) == []
    finally:
        lib.chmod(0o755)


def test_a_process_that_was_killed_locks_nobody_out(lib, holder, monkeypatch):
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    assert (lib / lock.LOCK).exists()
    assert verify_library(lib) == []
    monkeypatch.setattr(lock, "PATIENCE", 0.0)
    with library_lock(lib, "this test"):
        assert (lib / lock.LOCK).exists()
    assert not (lib / lock.LOCK).exists()


@pytest.fixture
def record(opened):
    """A record of an entry of the library."""
    document = read_library(opened).entries[0]
    return Record(document["name"], document["problem_sha256"], "S", "1", "feasible", primal=1.0)


@pytest.fixture
def field(opened, record):
    return read_field(opened / f"{record.entry.rpartition('_')[0]}.field.json")


def test_a_worse_field_does_not_replace_a_better_one_that_came_meanwhile(lib, record, field):
    for solver, primal in (("first", 2.0), ("second", 3.0), ("third", 1.0)):
        add_record(lib, replace(record, solver=solver, primal=primal), field)
    assert {kept.solver: kept.point is not None for kept in read_ledger(lib).records} == {
        "first": False,
        "second": False,
        "third": True,
    }


def test_a_build_that_is_refused_leaves_nothing(tmp_path):
    """The error of a drawing without strokes comes when its instance is made."""
    (tmp_path / "bare.scap").write_text("#9 9\n")
    bare = '[[sketches]]\nname = "bare"\nfile = "bare.scap"\n'
    spec = spec_of(tmp_path, f'formulations = ["qp"]\n[rungs.tiny]\nsizes = [4]\n{bare}')
    with pytest.raises(InputError, match="holds no stroke"):
        build(spec, tmp_path / "new")
    assert not (tmp_path / "new").exists()
    (tmp_path / "old").mkdir()
    with pytest.raises(InputError, match="holds no stroke"):
        build(spec, tmp_path / "old")
    assert list((tmp_path / "old").iterdir()) == []


def test_a_ledger_is_merged_before_it_is_written(lib, record, field, tmp_path):
    kept = add_record(lib, record, field)
    (tmp_path / "new").mkdir()
    ledger = merge_ledgers(tmp_path / "new", read_ledger(lib), [record.entry], [])
    assert list((tmp_path / "new").iterdir()) == []
    assert ledger.read_field(kept).instance.sha256 == field.instance.sha256
    write_ledger(ledger)
    assert read_ledger(tmp_path / "new").records == (kept,)
    assert (tmp_path / "new" / kept.point).read_bytes() == (lib / kept.point).read_bytes()
