"""The words of the docs: each is once in the glossary, and the methods are those of the table."""

import re
from pathlib import Path

from crossfield.export.solving.methods import METHODS

ROOT = Path(__file__).resolve().parents[2]


def glossary():
    lines = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8").splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| ")]
    return rows[2:]


def listed(page, heading):
    """The words in code that begin the items under a heading."""
    section = (ROOT / page).read_text(encoding="utf-8").split(f"\n{heading}\n")[1].split("\n## ")[0]
    return set(re.findall(r"^- `([\w-]+)`", section, re.MULTILINE))


def test_every_page_that_lists_the_methods_has_those_of_the_table():
    (methods,) = (meaning for word, meaning in glossary() if word == "method")
    assert set(methods.partition(": ")[2].split(", ")) == set(METHODS)
    assert listed("docs/mathematics.md", "## 10. Methods") == set(METHODS)
