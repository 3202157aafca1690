"""The README is short and its figures hold; generated tables of pages are up to date."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import crossfield as cf
import places
import pytest

ROOT = places.ROOT
README = (ROOT / "README.md").read_text()


def test_it_fits_on_one_screen_and_a_half_and_begins_with_the_picture_and_two_commands():
    assert len(README.splitlines()) <= 75
    heading, picture, _, block, *_ = README.split("\n\n")
    assert heading == "# crossfield"
    assert picture.startswith("![")
    assert block.startswith("```sh\n")
    assert len(block.splitlines()) == 4


def test_the_number_of_solver_files_is_that_of_a_run(tmp_path):
    instance = cf.sample("mouse", 6)
    written = cf.write_all(instance, tmp_path)
    names = [file["name"] for manifest in written for file in manifest.document["files"]]
    models = [name for name in names if not name.endswith((".row", ".col"))]
    assert f"{len(models)} solver files" in README


GENERATED = {
    ("make.py", "formulations", "editions"): ("docs/formulations.md", "docs/guides/solvers.md"),
    ("shipped_library.py",): ("docs/library.md", "docs/guides/libraries.md"),
    ("surface.py",): ("docs/surface.md",),
}
"""Programs with their arguments, and the pages in which they replace tables and counts."""


@pytest.mark.slow
@pytest.mark.parametrize("command", GENERATED, ids=lambda command: command[0])
def test_generated_tables_and_counts_are_up_to_date(tmp_path, command):
    copy = tmp_path / "project"
    shutil.copytree(ROOT / "docs", copy / "docs", ignore=shutil.ignore_patterns("pictures", "data"))
    program, *pages = command
    environment = os.environ | {"PYTHONHASHSEED": "7"}
    subprocess.run([sys.executable, f"docs/{program}", *pages], cwd=copy, check=True, env=environment)
    for page in GENERATED[command]:
        assert (copy / page).read_text() == (ROOT / page).read_text(), page
