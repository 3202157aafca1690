"""The README's blocks run as they stand, and its generated tables are up to date."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


@pytest.mark.solver
def test_python_block_runs(tmp_path):
    (block,) = blocks("python")
    subprocess.run([sys.executable, "-c", block], cwd=tmp_path, check=True, timeout=200)
    assert {path.name for path in tmp_path.iterdir()} >= {"bottle.mps", "bottle.png"}


@pytest.mark.solver
def test_tour_runs_line_by_line(tmp_path):
    (tour,) = (block for block in blocks("sh") if block.startswith("crossfield"))
    for line in tour.splitlines():
        command = [sys.executable, "-m", *shlex.split(line)]
        subprocess.run(command, cwd=tmp_path, check=True, timeout=200, stdout=subprocess.DEVNULL)
    assert (tmp_path / "field.png").stat().st_size > 10_000


def test_first_command_names_what_it_makes():
    first = blocks("sh")[0]
    assert re.search(r"crossfield run mouse -o out", first)
    assert "34 solver files" in README


def test_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / target).exists(), target


def test_generated_tables_are_up_to_date(tmp_path):
    copy = tmp_path / "project"
    (copy / "docs").mkdir(parents=True)
    (copy / "README.md").write_text(README)
    (copy / "docs" / "make.py").write_text((ROOT / "docs" / "make.py").read_text())
    subprocess.run(
        [sys.executable, "docs/make.py", "readme", "formulations"],
        cwd=copy,
        check=True,
        env=os.environ | {"PYTHONHASHSEED": "7"},
    )
    assert (copy / "README.md").read_text() == README
    assert (copy / "docs" / "formulations.md").read_text() == (ROOT / "docs" / "formulations.md").read_text()
