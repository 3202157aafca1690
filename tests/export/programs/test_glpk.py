"""GLPK's dump of a model is read by its documentation: what it leaves out has a default."""

import pytest
from crossfield.export.programs import glpk, highs

LP = """minimize
 energy: x + 2 y + 3 z
subject to
 balance: x - y = 0
 least: x + y >= 0
 most: x - 2 y <= 0
 equal: x + z = 3
bounds
 x free
 y <= 4
 -1 <= z <= 1
"""
INTEGERS = {"none": "", "one binary": "binary\n z\n", "one integer": "general\n z\n"}


@pytest.mark.needs("glpk")
@pytest.mark.parametrize("integers", INTEGERS)
def test_glpk_reads_the_same_limits_as_highs(integers, tmp_path, monkeypatch):
    """GLPK writes no line for a row that equals 0, for a column from 0 on, and for a binary column."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "model.lp"
    path.write_text(f"{LP}{INTEGERS[integers]}end\n")
    assert glpk.read(path) == highs.read(path)
