"""Each room can be taken out: all other names stay, and without any room the core passes its tests."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from functools import cache
from importlib import import_module

import pytest
from places import ROOT

pytestmark = pytest.mark.slow

ALL_NAMES = """
import pathlib, sys
for place in sys.argv[1:]:  # packages that others need are loaded once
    sys.path[0] = place
    import crossfield
    assert pathlib.Path(crossfield.__file__).parent.parent == pathlib.Path(place), crossfield.__file__
    for name in crossfield.__all__:
        getattr(crossfield, name)
    print(*crossfield.__all__)
    for module in [each for each in sys.modules if each.split(".")[0] == "crossfield"]:
        del sys.modules[module]
"""

CORE_WORK = """
import numpy as np, crossfield as cf
instance = cf.Instance.on_pixels("two", np.ones((1, 2)), [[0, 0]], [0.3], [1.0])
problem = cf.formulate(instance, "milp-mccormick")
cf.write(problem, "files", formats=["nl", "gms", "mod", "lp", "mps"])
model = problem.to_highs()
model.run()
model.writeSolution("files/answer.sol", 0)
answers = cf.read_solution("files/answer.sol", problem), problem.solution(model), cf.solve(problem)
assert all(answer.objective < 1e-6 for answer in answers), answers
"""


@pytest.fixture(scope="module")
def rooms(docs_module):
    """The program that draws the rooms."""
    return docs_module("rooms")


def copy_without(rooms, gone, place):
    """Copy the package without some rooms, those that use them, and their public names."""
    for name, room in rooms.ROOMS.items():  # each after those that it uses
        gone |= {name} if gone & {*room.uses} else set()
    folders = [folder for name in gone for folder in rooms.ROOMS[name].folders]
    package = place / "crossfield"
    for part in rooms.PARTS:
        shutil.copytree(ROOT / part, package / part, ignore=shutil.ignore_patterns("__pycache__", "known"))
    for folder in folders:
        shutil.rmtree(package / folder, ignore_errors=True)  # one may be inside of another
    modules = "|".join(re.escape("." + folder.replace("/", ".")) for folder in folders)
    of_room = re.compile(rf"from ({modules})\.|\"({modules})\.")
    lines = (ROOT / "__init__.py").read_text(encoding="utf-8").splitlines(keepends=True)
    rest = [line for line in lines if not of_room.search(line)]
    (package / "__init__.py").write_text("".join(rest), encoding="utf-8")


def run_python(place, *arguments):
    """What a Python prints that finds the package in this place; it has to end well."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=place,
        env=os.environ | {"PYTHONPATH": str(place)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


def test_without_a_room_all_names_of_the_others_are_there(rooms, tmp_path):
    home = import_module("crossfield")._HOME
    places = [tmp_path / name for name in rooms.ROOMS if name != rooms.CORE]
    for place in places:
        copy_without(rooms, {place.name}, place)
    shown = run_python(tmp_path, "-c", ALL_NAMES, *map(str, places)).splitlines()
    for place, left in zip(places, map(str.split, shown), strict=True):
        assert left == [one for one in sorted(home) if (place / "crossfield" / file_of(home[one])).is_file()]
        assert "formulate" in left


def file_of(module):
    """The file of a module of the package."""
    return f"{module.lstrip('.').replace('.', '/')}.py"


@cache
def modules_of(path):
    """The modules of the package that a test uses, itself or by its helpers."""
    text, home = path.read_text(encoding="utf-8"), import_module("crossfield")._HOME
    found = set(re.findall(r"^\s*from crossfield\.([\w.]+) import", text, re.MULTILINE))
    found |= {home[name].lstrip(".") for name in re.findall(r"\bcf\.(\w+)", text) if name in home}
    for helper in re.findall(r"^\s*(?:from|import) (\w+)", text, re.MULTILINE):
        beside = ROOT / "tests" / "support" / f"{helper}.py"
        if beside.is_file() and beside != path:
            found |= modules_of(beside)
    return frozenset(found)


def test_the_core_passes_its_tests_without_any_room(rooms, tmp_path):
    copy_without(rooms, {*rooms.ROOMS} - {rooms.CORE}, tmp_path)
    tests = []
    for folder in rooms.ROOMS[rooms.CORE].folders:  # the smallest file of each
        able = [
            path
            for path in sorted((ROOT / "tests" / folder).glob("test_*.py"))
            if all((tmp_path / "crossfield" / file_of(module)).is_file() for module in modules_of(path))
        ]
        tests += sorted(able, key=lambda path: path.stat().st_size)[:1]
    assert {path.parent.name for path in tests} >= {"instance", "formulations", "processes", "solutions"}
    for path in (ROOT / "tests" / "conftest.py", ROOT / "pyproject.toml", *tests):
        copy = tmp_path / path.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, copy)
    for folder in ("support", "data"):
        shutil.copytree(ROOT / "tests" / folder, tmp_path / "tests" / folder)
    run_python(tmp_path, "-c", CORE_WORK)
    run_python(tmp_path, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider")
