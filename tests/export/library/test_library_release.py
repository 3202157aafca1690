"""Releases: one archive with a checksum, the same bytes for the same library, and only of a sound one."""

import hashlib
import json
import os
import shutil
import subprocess
import tarfile
from pathlib import Path

import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.library.building.build import build
from crossfield.export.library.checking.check_library import verify_library
from crossfield.export.library.checking.release import release_library
from crossfield.export.library.plan.spec import read_spec
from crossfield.models.errors import InputError, OutputError

pytestmark = [pytest.mark.usefixtures("short_searches"), pytest.mark.slow]

SPEC = """format = "crossfield-library-spec"
version = 1
title = "Tests, and more"
formulations = ["qp"]
[rungs.tiny]
sizes = [3, 4]
formats = ["mps"]
prove = false
[[sketches]]
name = "mouse"
sample = "mouse"
"""
RELEASE = '[release]\nversion = "1.2 beta"\ndate = "2026-03-01"\nauthors = ["The testers"]\n'
TOP = "tests-and-more-1.2-beta"


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("release")
    (folder / "spec.toml").write_text(SPEC + RELEASE)
    return build(read_spec(folder / "spec.toml"), folder / "library").folder


def test_the_same_library_gives_the_same_archive_with_all_its_files(library, tmp_path, capfd):
    first = tmp_path / "first.tar.gz"
    assert invoke(["library", "release", str(library), "-o", str(first), "--json"]) == 0
    stated = json.loads(capfd.readouterr().out)
    copy = Path(shutil.copytree(library, tmp_path / "copy"))
    for path in copy.iterdir():
        os.utime(path, (1, 1))
        path.chmod(0o600)
    second = release_library(copy, tmp_path / "elsewhere" / "second.tar.gz", jobs=2)
    assert first.read_bytes() == second.file.read_bytes()
    assert stated["sha256"] == second.sha256 == hashlib.sha256(first.read_bytes()).hexdigest()
    with tarfile.open(first) as archive:
        assert {(each.uid, each.uname, each.mode) for each in archive} == {(0, "", 0o644)}
        held = {each.name: archive.extractfile(each).read() for each in archive}
    assert held == {f"{TOP}/{path.name}": path.read_bytes() for path in library.iterdir()}
    assert list(held) == sorted(held)
    shutil.unpack_archive(first, tmp_path / "unpacked")
    assert verify_library(tmp_path / "unpacked" / TOP) == []
    assert not (library / ".lock").exists()


def test_the_system_checks_its_checksum(library, tmp_path):
    if shutil.which("sha256sum") is None:
        pytest.skip("sha256sum is not installed")
    frozen = release_library(library, tmp_path / "it.tar.gz")
    command = ["sha256sum", "--check", "--quiet", f"{frozen.file.name}.sha256"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_library_without_version_or_with_defects_is_not_released(library, tmp_path, capfd):
    copy = Path(shutil.copytree(library, tmp_path / "copy"))
    (copy / "LICENSE").write_text("mine\n")
    (copy / "notes.txt").write_text("x")
    assert invoke(["library", "release", str(copy), "-o", str(tmp_path / "it.tar.gz")]) == 1
    shown = capfd.readouterr()
    assert shown.out == ""
    assert "does not verify, so it is not released: LICENSE: has another SHA-256" in shown.err
    (tmp_path / "spec.toml").write_text(SPEC)
    plain = build(read_spec(tmp_path / "spec.toml"), tmp_path / "plain").folder
    with pytest.raises(InputError, match=r"states no version and no day; write \[release\]"):
        release_library(plain, tmp_path / "it.tar.gz")
    with pytest.raises(InputError, match=r"it\.rar: is no name of a release; let it end in \.tar\.gz"):
        release_library(library, tmp_path / "it.rar")
    with pytest.raises(OutputError, match="lies inside the library"):
        release_library(library, library / "it.tar.gz")
    with pytest.raises(InputError, match="is no library"):
        release_library(tmp_path, tmp_path.with_name("it.tar.gz"))
    assert not list(tmp_path.glob("it.*"))
