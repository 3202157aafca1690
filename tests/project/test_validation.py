"""The page of validation is that of the stored rows, whose proven optima agree."""

from __future__ import annotations

import json

import places
import pytest
from crossfield.export.solvers_table import PROGRAMS


@pytest.fixture(scope="module")
def validate(docs_module):
    """The program that makes the page."""
    return docs_module("validate")


def test_the_page_and_its_tables_of_solvers_are_those_of_the_rows(validate):
    assert (places.ROOT / "docs" / "validation.md").read_text(encoding="utf-8") == validate.page()
    assert validate.read_rows("solvers") == validate.capability_rows()
    assert validate.read_rows("refusals") == validate.refusal_rows()


def test_proven_optima_agree_and_each_licensed_program_has_a_last_run(validate):
    best = validate.optima(validate.read_rows("routes"))
    assert max(float(row["proofs differ by"]) for row in best if row["proofs differ by"]) < 1e-6
    record = json.loads(validate.RECORD.read_text())
    assert record.keys() == {name for name, program in PROGRAMS.items() if program.free}
