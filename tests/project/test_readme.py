"""The README is short, its figures hold, and its generated table is up to date."""

from __future__ import annotations

import os
import subprocess
import sys

import crossfield as cf
import places

ROOT = places.ROOT
README = (ROOT / "README.md").read_text()


def test_the_number_of_solver_files_is_that_of_a_run(tmp_path):
    instance = cf.sample("mouse", 6)
    written = cf.write_all(instance, tmp_path)
    names = [file["name"] for manifest in written for file in manifest.document["files"]]
    models = [name for name in names if not name.endswith((".row", ".col"))]
    assert f"{len(models)} solver files" in README


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
