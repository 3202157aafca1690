"""Every program reads the spellings of our writers alike;
docs/format-rules.md lists the others.
"""

from __future__ import annotations

import csv

import places
import pytest


@pytest.fixture(scope="module")
def traps(docs_module):
    """The program with the files and the programs."""
    return docs_module("traps")


def test_the_page_lists_every_trap(traps):
    with traps.RESULTS.open(newline="", encoding="utf-8") as file:
        heads, *rows = csv.reader(file)
    assert [row[:3] for row in rows] == [[t.rule, t.what, traps.meant_cell(t)] for t in traps.TRAPS]
    page = (places.ROOT / "docs" / "format-rules.md").read_text(encoding="utf-8")
    for counts in traps.summary(heads, *rows)[1]:
        assert f"\n| {' | '.join(counts)} |\n" in page


@pytest.mark.oracles
def test_what_our_writers_write_is_read_as_it_is_meant(traps):
    assert {"HiGHS"} <= set(traps.installed_programs())
    for trap in (trap for trap in traps.TRAPS if trap.good):
        quadratic = "^" in trap.text or "QUADOBJ" in trap.text
        for title in traps.installed_programs():
            if not (quadratic and title in {"GLPK", "CBC"}):  # they take linear models only
                assert traps.answer(title, trap) == pytest.approx(trap.meant, abs=1e-6), (trap.what, title)
