"""Generated tables, sentences and counts of pages are up to date."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest
from places import ROOT

GENERATED = ("formulations", "programs", "claims", "library", "studies")


@pytest.mark.slow
def test_generated_tables_sentences_and_counts_are_up_to_date(tmp_path):
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("pictures", "*.pyc"))
    shutil.copytree(ROOT / "export", tmp_path / "export", ignore=shutil.ignore_patterns("library"))
    environment = os.environ | {"PYTHONHASHSEED": "7"}
    command = [sys.executable, str(tmp_path / "docs" / "make.py"), *GENERATED]
    subprocess.run(command, check=True, env=environment)
    for path in [*(tmp_path / "docs").rglob("*.md"), *(tmp_path / "docs").rglob("*.csv")]:
        assert path.read_bytes() == (ROOT / path.relative_to(tmp_path)).read_bytes(), path
