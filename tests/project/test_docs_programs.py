"""The programs in docs/: each can be imported."""

import pytest
from places import ROOT

NEEDS = dict.fromkeys(("command_pages", "conf", "csv_pages"), "sphinx")
NEEDS |= {"formulas": "latex2mathml", "studio_pictures": "selenium"}
"""Packages of the extra `docs` that a program needs."""


@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "docs").glob("*.py")))
def test_every_program_can_be_imported(docs_module, name):
    if name in NEEDS:
        pytest.importorskip(NEEDS[name])
    docs_module(name)
