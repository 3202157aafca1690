"""The README's blocks run as they are, and its generated tables are up to date."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys

import places
import pytest

ROOT = places.ROOT
README = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


@pytest.mark.slow
def test_python_block_runs(tmp_path):
    (block,) = blocks("python")
    subprocess.run([sys.executable, "-c", block], cwd=tmp_path, check=True)
    assert {path.name for path in tmp_path.iterdir()} >= {"bottle.mps", "bottle.png"}


def run_line_by_line(block, folder):
    for line in block.splitlines():
        words = shlex.split(line)
        command = [sys.executable, "-m", *words] if words[0] == "crossfield" else words
        subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)


@pytest.mark.slow
def test_tour_runs_line_by_line(tmp_path):
    run_line_by_line(blocks("sh")[2], tmp_path)
    assert (tmp_path / "field.png").stat().st_size > 10_000
    assert b'id="drawing"' in (tmp_path / "field.svg").read_bytes()


@pytest.mark.slow
def test_files_are_verified_and_an_answer_read_back(tmp_path):
    verify, glpk = blocks("sh")[3:5]
    run_line_by_line(verify, tmp_path)
    assert (tmp_path / "checked" / "verify.json").exists()
    if shutil.which("glpsol") is None:
        pytest.skip("glpsol is not installed: apt-get install glpk-utils")
    run_line_by_line(glpk, tmp_path)
    assert (tmp_path / "skew.npz").exists()


SPEC = """
format = "crossfield-library-spec"
version = 1
title = "A small one"
formulations = ["milp-mccormick", "qp-fixed"]

[rungs.tiny]
sizes = [4]
formats = ["mps", "nl"]

[[sketches]]
name = "mouse"
sample = "mouse"
"""


@pytest.mark.slow
def test_a_library_is_built_verified_and_shown(tmp_path):
    (block,) = blocks("sh")[5:]
    (tmp_path / "small.toml").write_text(SPEC)
    run_line_by_line(block.replace(" default ", " small.toml "), tmp_path)
    assert (tmp_path / "site" / "index.html").exists()


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
