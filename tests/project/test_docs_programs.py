"""The programs in docs/: each can be imported."""

import pytest
from places import ROOT

NEEDS = {"command_pages": "sphinx", "conf": "sphinx", "csv_pages": "sphinx", "studio_pictures": "selenium"}


@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "docs").glob("*.py")))
def test_every_program_can_be_imported(docs_module, name):
    pytest.importorskip(NEEDS.get(name, "latex2mathml" if name == "formulas" else "numpy"))
    docs_module(name)
