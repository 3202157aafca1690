"""The benchmarks run, at sizes where nothing can be measured."""

import re
import shutil
import subprocess
import sys

import places
import pytest


def run_benchmark(folder, *arguments):
    """The page after a benchmark."""
    page = shutil.copy(places.ROOT / "docs" / "performance.md", folder / "page.md")
    command = [sys.executable, str(places.ROOT / "tests" / "bench"), *arguments, "--page", str(page)]
    subprocess.run(command, check=True, capture_output=True)
    return page.read_text()


@pytest.mark.slow
def test_the_start_of_commands_is_measured(tmp_path):
    page = run_benchmark(tmp_path, "start", "--runs", "1")
    assert re.search(r"\| `crossfield --help` \| 0\.\d\d \|", page)


@pytest.mark.slow
def test_smoke_run_replaces_the_tables_of_a_page(tmp_path):
    page = run_benchmark(tmp_path, "writing", "--smoke")
    # The LP of 8 x 8 pixels has a fixed length, so that what is measured is known to be the file.
    assert re.search(
        r"^8,crossfield,0\.1\d*,", (tmp_path / "performance" / "lp.csv").read_text(), re.MULTILINE
    )
    assert "| Pyomo |" in page
