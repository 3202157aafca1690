"""The prose of the pages: no long sentences, and plain words in place of others."""

from __future__ import annotations

import re
from collections.abc import Iterator

from places import ROOT

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
LONGEST = 40
"""Words of a sentence; a list item or a table cell counts as one."""
PLAIN = {
    r"shall": "should, must",
    r"(?:is|are|was) told": "is reported",
    r"came (?:to|by|with)": "returned, received",
    r"hasty|quickest|cleverly": "the term of the field",
    r"(?:field|fields|cross|crosses) of least energy": "minimum-energy field",
    r"kicks?": "perturbs",
    r"simply|obviously|of course|powerful|blazing": "(omit it)",
    r"utili[sz]e[sd]?": "use",
    r"in order to": "to",
    r"\+-": "±",
}
"""Patterns, and what to write instead."""
NOT_PROSE = re.compile(r"```.*?```|\$\$.*?\$\$|<!--.*?-->|^\|.*?$|^#.*?$", re.DOTALL | re.MULTILINE)


def sentences(page: str) -> Iterator[str]:
    """The sentences of a page, code and formulas as one word each."""
    page = re.sub(r"`[^`]*`|\$[^$]*\$|\]\([^)]*\)", "code", NOT_PROSE.sub("\n\n", page))
    for paragraph in re.split(r"\n\n|\n *(?=[-*] |\d+\. )", page):
        yield from re.split(r"(?<=[.:;?!])\s+", " ".join(paragraph.split()))


def test_sentences_are_short_and_words_are_plain():
    found = []
    for path in PAGES:
        for sentence in sentences(path.read_text(encoding="utf-8")):
            advice = [
                f"{m[0]!r}: {better}"
                for p, better in PLAIN.items()
                if (m := re.search(rf"(?<!\w)(?:{p})(?!\w)", sentence, re.IGNORECASE))
            ]
            advice += ["a shorter sentence"] * (len(sentence.split()) > LONGEST)
            found += [f"{path.relative_to(ROOT)}: {words} in: {sentence}" for words in advice]
    assert not found, "\n".join(found)
