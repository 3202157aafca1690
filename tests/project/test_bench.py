"""The benchmark runs, at sizes where nothing can be measured, and says for each target whether it was met."""

from __future__ import annotations

import re
import subprocess
import sys

import places
import pytest

ROOT = places.ROOT


def targets(page: str) -> list[list[str]]:
    """Cells of the table of targets, without its head."""
    part = page.partition("## Targets\n\n")[2].partition("\n\n")[0]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in part.splitlines()[2:]]


@pytest.mark.slow
def test_smoke_run_writes_a_page(tmp_path):
    command = [
        sys.executable,
        str(ROOT / "tests" / "bench"),
        "--smoke",
        "--output",
        str(tmp_path / "page.md"),
    ]
    subprocess.run(command, check=True, capture_output=True)
    page = (tmp_path / "page.md").read_text()
    found = targets(page)
    assert {verdict for *_, verdict in found} <= {"met", "not met"}
    assert len(found) >= 10
    # The LP of 8 x 8 pixels has a fixed length, so that what is measured is known to be the file.
    assert re.search(r"\| 8 \| crossfield \| 0\.1\d* \|", page)
    assert "| Pyomo |" in page


def test_the_page_in_docs_measures_the_same_targets():
    page = (ROOT / "docs" / "performance.md").read_text()
    assert len(targets(page)) >= 10
    assert re.search(r"\| 512 \| crossfield \| \d{3}", page)
    assert not re.search(r"/work|/home|/root|/tmp", page)
