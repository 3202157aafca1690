"""The page of validation keeps the last results of programs whose licence has ended."""

from __future__ import annotations

import json
import re
import shutil

import places
import pytest
from crossfield.export.solvers_table import PROGRAMS
from crossfield.export.verify.checks import Check, Verdict, Verification

DOCS = places.ROOT / "docs"


@pytest.fixture(scope="module")
def validate(docs_module):
    """The program that makes the page."""
    return docs_module("validate")


def test_each_program_with_a_licence_has_a_last_run_on_the_page(validate):
    record = json.loads(validate.RECORD.read_text())
    assert record.keys() == {name for name, program in PROGRAMS.items() if program.free}
    page = (DOCS / "validation.md").read_text()
    for name, last in record.items():
        assert re.search(
            rf"^\| {PROGRAMS[name].title}\b.*\| {last['version'].split()[0]}", page, re.MULTILINE
        )
        assert f"| {last['date']} | {' | '.join(map(str, last['files']))} |" in page


def test_a_run_without_a_program_keeps_its_last_results(validate, tmp_path, monkeypatch):
    monkeypatch.setattr(validate, "RECORD", tmp_path / "licensed.json")
    shutil.copy(DOCS / "licensed.json", tmp_path)
    before = json.loads(validate.RECORD.read_text())
    read = Check("small qp-fixed", "a.lp", "gurobi", "read", Verdict.AGREES)
    solve = Check("small qp-fixed", "a.lp", "gurobi", "solve", Verdict.AGREES, objective=0.5, seconds=1.0)
    run = validate.Run("strokes", "hull", Verification(tmp_path, [read, solve], {"gurobi": "99.1"}))
    record = validate.update_record([run])
    assert record == json.loads(validate.RECORD.read_text())
    assert record["gurobi"]["version"] == "99.1"
    assert record["gurobi"]["files"] == [1, 0, 0]
    assert record["gurobi"]["routes"] == [["`qp-fixed`", "Gurobi", "lp", "0.500000000", "", "1.0", "optimal"]]
    assert {**record, "gurobi": before["gurobi"]} == before
    table, *results = validate.licences(record, run.result.versions)[1:]
    assert f"| {before['gams']['date']} |" in table
    assert "BARON | gms" in results[1]
    assert "| Gurobi | lp" not in results[1]
