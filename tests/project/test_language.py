"""The prose of pages and public docstrings: no long sentences, and plain words in place of others."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator

import crossfield as cf
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
    r"tells?|said": "states, reports",
    r"very|really|quite": "(omit it)",
    r"the one (?:that|of|with)": "(repeat the noun)",
    r"by far": "(state the number)",
    r"e\.g\.|i\.e\.|etc\.": "for example, that is, and others",
    r"(?:do|does|is|are|can|wo)n't|can't|it's": "(write it out)",
    r"and/or|via": "and, or, by",
    r"\+-": "±",
}
"""Patterns, and what to write instead."""
NOT_PROSE = re.compile(r"```.*?```|\$\$.*?\$\$|<!--.*?-->|^\|.*?$|^#.*?$", re.DOTALL | re.MULTILINE)


def sentences(page: str) -> Iterator[str]:
    """The sentences of a page, code and formulas as one word each."""
    page = re.sub(r"`[^`]*`|\$[^$]*\$|\]\([^)]*\)", "code", NOT_PROSE.sub("\n\n", page))
    for paragraph in re.split(r"\n\n|\n *(?=[-*] |\d+\. )", page):
        yield from re.split(r"(?<=[.:;?!])\s+", " ".join(paragraph.split()))


def texts() -> Iterator[tuple[str, str]]:
    """Pages, and docstrings of public names, which the site prints, with their places."""
    for path in PAGES:
        yield path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")
    for name in cf.__all__:
        public = getattr(cf, name)
        members = vars(public).items() if isinstance(public, type) else ()
        for member in [public, *(value for key, value in members if not key.startswith("_"))]:
            headings = r"\n-+\n|\n(?=\w[\w, ]*\n {4})"
            yield name, re.sub(headings, "\n\n", inspect.getdoc(member) or "")


def test_sentences_are_short_and_words_are_plain():
    found = []
    for place, text in texts():
        for sentence in sentences(text):
            advice = [
                f"{m[0]!r}: {better}"
                for p, better in PLAIN.items()
                if (m := re.search(rf"(?<!\w)(?:{p})(?!\w)", sentence, re.IGNORECASE))
            ]
            advice += ["a shorter sentence"] * (len(sentence.split()) > LONGEST)
            found += [f"{place}: {words} in: {sentence}" for words in advice]
    assert not found, "\n".join(found)
