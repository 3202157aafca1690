"""Compiled functions are cached for the user, outside the package, and never taken from another version."""

import os
import subprocess
import sys

import pytest

LATER = """from typing import NamedTuple
from crossfield.models.processes.compilation import compiled
from earlier import times

class {name}(NamedTuple):
    a: float

@compiled
def scaled(terms):
    return times(terms.a)
"""
EARLIER = """from crossfield.models.processes.compilation import compiled

@compiled
def times(value):
    return {factor} * value
"""
CALL = """
from later import scaled, {name}
from crossfield.models.processes.compilation import is_all_compiled
print(is_all_compiled(), scaled({name}(2.0)), is_all_compiled())
"""


@pytest.fixture
def call(tmp_path):
    modules = tmp_path / "modules"
    modules.mkdir()

    def run(name="Terms", factor=2.0, **variables):
        (modules / "later.py").write_text(LATER.format(name=name))
        (modules / "earlier.py").write_text(EARLIER.format(factor=factor))
        settings = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
        command, settings = [sys.executable, "-c", CALL.format(name=name)], settings | variables
        run = subprocess.run(command, cwd=modules, env=settings, capture_output=True, text=True, check=False)
        assert run.returncode == 0, run.stderr
        assert not [*modules.rglob("*.nb?")]
        return run.stdout.split()

    return run


@pytest.mark.slow
def test_code_is_cached_for_the_user_and_compiled_again_in_another_version(call, tmp_path):
    folder = {"XDG_CACHE_HOME": str(tmp_path / "mine")}
    assert call(**folder) == ["False", "4.0", "True"]
    assert call(**folder) == ["True", "4.0", "True"]
    assert len([*(tmp_path / "mine").rglob("*.nbi")]) == 2
    assert call(name="Weights", **folder) == ["False", "4.0", "True"]
    # Numba compares the file of the caller only.
    assert call(factor=3.0, **folder) == ["False", "6.0", "True"]


def test_the_folder_of_numba_is_taken(call, tmp_path):
    assert call(NUMBA_CACHE_DIR=str(tmp_path / "mine")) == ["False", "4.0", "True"]
    assert len([*(tmp_path / "mine").rglob("*.nbi")]) == 2


def test_functions_work_where_no_folder_is_writable(call, tmp_path):
    (tmp_path / "file").touch()
    assert call(XDG_CACHE_HOME=str(tmp_path / "file" / "cache")) == ["True", "4.0", "True"]
