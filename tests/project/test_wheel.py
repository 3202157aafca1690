"""The wheel: every needed file of the tree, no other file, and one top-level name."""

import os
import shutil
import subprocess
import sys
import zipfile

import places
import pytest

ROOT = places.ROOT
PARTS = ("models", "export", "templates")
DATA = (".svg", ".csv", ".json", ".toml", ".npz", ".j2", ".css", ".js", ".typed")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Names of the files in a wheel that was built from a copy of the tree."""
    pytest.importorskip("setuptools")
    if not (ROOT / "pyproject.toml").exists():
        pytest.skip("the tests do not lie in a source tree")
    tree = tmp_path_factory.mktemp("build") / "crossfield"
    left_out = shutil.ignore_patterns(".*", "build", "dist", "*.egg-info", "__pycache__")
    shutil.copytree(ROOT, tree, ignore=left_out)
    command = [sys.executable, "-c", "from setuptools import build_meta; build_meta.build_wheel('dist')"]
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    (built,) = (tree / "dist").glob("*.whl")
    with zipfile.ZipFile(built) as archive:
        return {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}


def in_tree():
    """Files that belong in the wheel: every module and every data file of the package's parts."""
    files = [*ROOT.glob("*.py"), ROOT / "py.typed"]
    for part in PARTS:
        files += [path for path in (ROOT / part).rglob("*") if path.suffix in {".py", *DATA}]
    return {f"crossfield/{path.relative_to(ROOT).as_posix()}": path.read_bytes() for path in files}


@pytest.mark.slow
def test_the_wheel_holds_the_tree_byte_by_byte(wheel):
    expected = in_tree()
    packed = {name: content for name, content in wheel.items() if ".dist-info/" not in name}
    assert sorted(expected) == sorted(packed)
    assert all(packed[name] == content for name, content in expected.items())
