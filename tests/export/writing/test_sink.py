"""Bytes on their way to a file: whole, hashed as written, compressed as any gzip reader takes them."""

import gzip
import hashlib
import zlib

import crossfield as cf
import pytest
from crossfield.export.programs import highs, scip
from crossfield.export.writing.sink import save_file
from folders import contents
from instance_kinds import kind

TEXT = b"".join(b"c14_%03d: + 1 s_%03d >= 0\n" % (number, number * 7 % 1000) for number in range(1000))


def cut(data, length):
    return [data[start : start + length] for start in range(0, len(data), length)]


@pytest.mark.parametrize("chunks", [[], cut(TEXT, 1), cut(TEXT, 1000), [TEXT]], ids=len)
def test_count_and_hash_are_those_of_the_file(chunks, tmp_path):
    """A compressed file is one gzip member and nothing after it, which readers by zlib alone need."""
    for name in ("a.lp", "a.lp.gz", "b.lp.gz"):
        facts = save_file(tmp_path / name, chunks)
        data = (tmp_path / name).read_bytes()
        assert facts == {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        assert (gzip.decompress(data) if name.endswith("gz") else data) == b"".join(chunks)
    packed, other = ((tmp_path / name).read_bytes() for name in ("a.lp.gz", "b.lp.gz"))
    assert packed == other
    reader = zlib.decompressobj(16 + zlib.MAX_WBITS)
    reader.decompress(packed)
    assert (reader.eof, reader.unused_data) == (True, b"")


@pytest.mark.parametrize("suffix", ["lp", "mps"])
def test_solvers_read_compressed_files(suffix, tmp_path):
    problem = cf.formulate(kind("hole"), "milp-mccormick")
    for name in (f"packed.{suffix}.gz", f"plain.{suffix}"):
        cf.write(problem, tmp_path / name)
    for program in (highs, scip):
        packed, plain = (
            program.read(tmp_path / f"{name}") for name in (f"packed.{suffix}.gz", f"plain.{suffix}")
        )
        assert packed == plain


def test_ctrl_c_begins_no_further_file(tmp_path):
    def stop(name):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        cf.write_all(kind("hole"), tmp_path, progress=stop)
    assert contents(tmp_path) == {}
