"""Bytes on their way to a file: whole, hashed as written, compressed in pieces that any gzip reader takes."""

from __future__ import annotations

import gzip
import hashlib
import subprocess
import sys
import threading
import zlib

import numpy as np
import pytest
from cases import make_instance, make_problem
from crossfield.export.bundle.problem_files import write_all
from crossfield.export.formats.registry import write
from crossfield.export.writing import sink
from crossfield.export.writing.sink import gzip_chunks, join_chunks, save_file
from folders import contents
from hypothesis import given
from hypothesis import strategies as st
from loops import for_each
from oracles import by_highs, by_scip

TEXT = b"".join(b"c14_%03d: + 1 s_%03d >= 0\n" % (number, number * 7 % 1000) for number in range(1000))


def cut(data: bytes, length: int) -> list[bytes]:
    return [data[start : start + length] for start in range(0, len(data), length)]


@for_each("share", [1, 999, 1000, 1001, 1 << 20])
@for_each("length", [1, 1000, 1 << 20])
def test_count_and_hash_are_those_of_the_file(length, share, tmp_path, monkeypatch):
    monkeypatch.setattr(sink, "SHARE", share)
    for name in ("a.lp", "a.lp.gz"):
        facts = save_file(tmp_path / name, cut(TEXT, length))
        data = (tmp_path / name).read_bytes()
        assert facts == {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        assert (gzip.decompress(data) if name.endswith("gz") else data) == TEXT


@pytest.fixture
def begun():
    """How many threads run that did not when the test began: pools of other tests may still be there."""
    before = set(threading.enumerate())
    return lambda: len(set(threading.enumerate()) - before)


FULL = """
import resource, sys, threading
from pathlib import Path
from crossfield.export.writing.sink import SHARE, save_file
from crossfield.models.errors import OutputError
resource.setrlimit(resource.RLIMIT_FSIZE, (3 * SHARE, 3 * SHARE))
try:
    save_file(Path(sys.argv[1]), (bytes(SHARE) for _ in range(int(sys.argv[2]))))
except OutputError as error:
    print(error, threading.active_count())
"""


@pytest.mark.parametrize("shares", [4, 100])
def test_a_disk_that_takes_no_more_is_an_error_of_output_and_leaves_nothing(shares, tmp_path):
    """The thread that writes fails, at the end or long before: files are limited to three shares."""
    command = [sys.executable, "-c", FULL, str(tmp_path / "a.lp"), str(shares)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "a.lp: cannot be written: file too large; free some space" in done.stdout
    assert done.stdout.endswith(" 1\n")
    assert list(tmp_path.iterdir()) == []


@given(st.lists(st.binary(max_size=50), max_size=30), st.integers(1, 60))
def test_pieces_hold_the_chunks(chunks, least):
    pieces = list(join_chunks(chunks, least))
    assert b"".join(pieces) == b"".join(chunks)
    assert all(len(piece) >= least for piece in pieces[:-1])


@pytest.mark.parametrize("piece", [1, 999, 1000, 1001, 10_000])
def test_a_compressed_file_of_many_pieces_is_one_stream(piece, monkeypatch):
    """Strict: one gzip member and nothing after it, which readers by zlib's inflate alone need."""
    monkeypatch.setattr(sink, "PIECE", piece)
    packed = b"".join(gzip_chunks(cut(TEXT, 100)))
    reader = zlib.decompressobj(16 + zlib.MAX_WBITS)
    assert reader.decompress(packed) == TEXT
    assert reader.eof
    assert reader.unused_data == b""
    assert packed == b"".join(gzip_chunks(cut(TEXT, 100)))


def test_nothing_is_a_compressed_file_too():
    assert gzip.decompress(b"".join(gzip_chunks([]))) == b""


@pytest.mark.parametrize("suffix", ["lp", "mps"])
def test_solvers_read_files_of_many_pieces(suffix, tmp_path, monkeypatch):
    monkeypatch.setattr(sink, "PIECE", 200)
    problem = make_problem("milp-mccormick", make_instance())
    write(problem, tmp_path / f"packed.{suffix}.gz")
    write(problem, tmp_path / f"plain.{suffix}")
    for reader in (by_highs, by_scip):
        packed, plain = reader(tmp_path / f"packed.{suffix}.gz"), reader(tmp_path / f"plain.{suffix}")
        for name, value in vars(plain).items():
            np.testing.assert_array_equal(getattr(packed, name), value, err_msg=name)


def test_a_failure_leaves_no_file_and_no_thread(tmp_path, monkeypatch, begun):
    def chunks():
        yield TEXT
        raise RuntimeError("no more")

    for name in ("a.lp", "a.lp.gz"):
        for share in (1, sink.SHARE):
            monkeypatch.setattr(sink, "SHARE", share)
            with pytest.raises(RuntimeError, match="no more"):
                save_file(tmp_path / name, chunks())
    assert list(tmp_path.iterdir()) == []
    assert begun() == 0


def test_ctrl_c_begins_no_further_file(tmp_path, begun):
    def stop(name: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_all(make_instance(), tmp_path, progress=stop)
    assert contents(tmp_path) == {}
    assert begun() == 0
