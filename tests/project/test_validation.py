"""The page of validation keeps the last results of programs whose licence has ended."""

from __future__ import annotations

import json
import re

import places
import pytest
from crossfield.export.solvers_table import PROGRAMS

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
