"""The benchmark of the writers runs, at sizes where nothing can be measured."""

import re
import subprocess
import sys

import places
import pytest


@pytest.mark.slow
def test_smoke_run_writes_a_page(tmp_path):
    command = [sys.executable, str(places.ROOT / "docs" / "performance.py"), "--smoke"]
    subprocess.run([*command, "--output", str(tmp_path / "page.md")], check=True, capture_output=True)
    page = (tmp_path / "page.md").read_text()
    # The LP of 8 x 8 pixels has a fixed length, so that what is measured is known to be the file.
    assert re.search(r"\| 8 \| crossfield \| 0\.1\d* \|", page)
    assert "| Pyomo |" in page
