"""The script and the table of the page on libraries return what the page says."""

from __future__ import annotations

import csv
import re
import subprocess
import sys

import places
import pytest
from crossfield.export.library.building.table import COLUMNS

PAGE = places.ROOT / "docs" / "library.md"


def test_the_page_describes_every_column_of_the_table():
    with (places.ROOT / "docs" / "library" / "columns.csv").open(newline="") as stream:
        assert [row["column"] for row in csv.DictReader(stream)] == list(COLUMNS)


@pytest.mark.slow
def test_an_entry_by_name_has_what_the_page_uses(tmp_path):
    page = PAGE.read_text(encoding="utf-8")
    (script,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    subprocess.run([sys.executable, "-c", f"{script}\nassert small"], cwd=tmp_path, check=True)
    assert (tmp_path / "skew.mps").exists()
