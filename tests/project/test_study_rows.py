"""The rows of the study are of one run each; its page is made from its rows."""

from __future__ import annotations

from types import SimpleNamespace

import places
import pytest

DOCS = places.ROOT / "docs"
DATA = DOCS / "studying" / "data"


@pytest.fixture(scope="module")
def study(docs_module):
    """The modules of the study."""
    return SimpleNamespace(**{name: docs_module(f"studying.{name}") for name in ("page", "rows")})


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
    study.page.write_page(tmp_path)
    names = ["evidence.md", *(f"evidence/{path.name}" for path in (DOCS / "evidence").iterdir())]
    assert len(list((tmp_path / "evidence").iterdir())) == len(names) - 1
    for name in names:
        assert (tmp_path / name).read_text() == (DOCS / name).read_text(), name


def test_no_run_has_two_rows(study):
    kept = study.page.read()
    for part in study.rows.PARTS:
        keys = [study.rows.key_of(row) for row in kept[part]]
        assert len(keys) == len(set(keys)) > 0
