"""Compiled functions are cached, and what an older version left in the cache does no harm."""

import subprocess
import sys

import pytest

OLDER = """from typing import NamedTuple
from crossfield.models.processes.compilation import compiled, is_all_compiled

class {name}(NamedTuple):
    a: float

@compiled
def twice(terms):
    return 2 * terms.a
"""
CALL = """
from older import twice, {name}
from crossfield.models.processes.compilation import is_all_compiled
print(is_all_compiled(), twice({name}(2.0)), is_all_compiled())
"""


@pytest.fixture
def call(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))

    def run(name):
        (tmp_path / "older.py").write_text(OLDER.format(name=name))
        code = CALL.format(name=name)
        run = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert run.returncode == 0, run.stderr
        return run.stdout.split()

    return run


def test_a_class_with_another_name_makes_functions_compile_again(call, tmp_path):
    assert call("Terms") == ["False", "4.0", "True"]
    assert call("Terms") == ["True", "4.0", "True"]
    assert call("Weights") == ["False", "4.0", "True"]
