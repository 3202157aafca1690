"""The rows of the study are of one run each; its page is made from its rows."""

from __future__ import annotations

import os
import subprocess
import sys
from types import SimpleNamespace

import places
import pytest

DOCS = places.ROOT / "docs"
DATA = DOCS / "studying" / "data"


@pytest.fixture(scope="module")
def study(docs_module):
    """The modules of the study."""
    return SimpleNamespace(**{name: docs_module(f"studying.{name}") for name in ("page", "plan", "rows")})


def test_a_second_row_of_a_run_and_a_file_of_another_study_are_refused(study, tmp_path):
    run = study.rows.Run("practice", "skew", 6, "greedy")
    table = study.rows.Rows(tmp_path / "a.csv")
    table.append(run, {"status": "field", "note": 'a, "b"\nc', "seconds": 0.5})
    with pytest.raises(ValueError, match="has a row already"):
        study.rows.Rows(tmp_path / "a.csv").append(run, {})
    (row,) = study.rows.Rows(tmp_path / "a.csv").rows
    assert (row["note"], row["seconds"], row["bound"]) == ('a, "b" c', 0.5, None)
    (tmp_path / "b.csv").write_text("other,columns\n1,2\n")
    with pytest.raises(ValueError, match="other columns"):
        study.rows.Rows(tmp_path / "b.csv")


@pytest.mark.slow
def test_the_page_and_its_tables_are_made_from_the_rows(study, tmp_path):
    study.page.write_page(DATA, tmp_path, study.plan.FULL)
    names = ["evidence.md", *(f"evidence/{path.name}" for path in (DOCS / "evidence").iterdir())]
    assert len(list((tmp_path / "evidence").iterdir())) == len(names) - 1
    for name in names:
        assert (tmp_path / name).read_text() == (DOCS / name).read_text(), name
    short = study.page.short_summary(study.page.read(DATA), study.plan.FULL)
    assert f" -->\n{short}\n<!-- end of answers -->" in (DOCS / "index.md").read_text()


def test_no_run_has_two_rows(study):
    kept = study.page.read(DATA)
    for part in study.rows.PARTS:
        keys = [study.rows.key_of(row) for row in kept[part]]
        assert len(keys) == len(set(keys)) > 0


@pytest.mark.slow
def test_a_quick_study_makes_its_page(study, tmp_path):
    program = (
        f"import sys; sys.path.insert(0, {str(DOCS)!r})\n"
        "from dataclasses import replace\nfrom pathlib import Path\n"
        "from studying import page, plan, work\n"
        "small = replace(plan.QUICK, quality=(12,), quality_limit=0.5,\n"
        "                practice=(12,), practice_limit=0.5, quick_search=0.2)\n"
        "if __name__ == '__main__':\n"
        f"    work.carry_out(small, Path({str(tmp_path)!r}), jobs=2)\n"
        f"    page.write_page(Path({str(tmp_path)!r}), Path({str(tmp_path)!r}), small)\n"
    )
    script = tmp_path / "small.py"
    script.write_text(program)
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    subprocess.run([sys.executable, str(script)], check=True, env=environment)
    assert "still missing" not in (tmp_path / "evidence.md").read_text()
    for name in ("quality", "weights", "practice"):
        assert (tmp_path / "pictures" / f"evidence_{name}.svg").read_bytes().startswith(b"<?xml")
    assert not list(tmp_path.glob(".lock"))
