"""The benchmark of the writers runs, at sizes where nothing can be measured."""

import re
import shutil
import subprocess
import sys

import places
import pytest


@pytest.mark.slow
def test_smoke_run_replaces_the_tables_of_a_page(tmp_path):
    page = shutil.copy(places.ROOT / "docs" / "performance.md", tmp_path / "page.md")
    command = [
        sys.executable,
        str(places.ROOT / "tests" / "bench"),
        "writing",
        "--smoke",
        "--page",
        str(page),
    ]
    subprocess.run(command, check=True, capture_output=True)
    # The LP of 8 x 8 pixels has a fixed length, so that what is measured is known to be the file.
    assert re.search(r"\| 8 \| crossfield \| 0\.1\d* \|", page.read_text())
    assert "| Pyomo |" in page.read_text()
