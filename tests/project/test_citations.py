"""Citations in comments, docstrings and pages exist: rules, sections, tests, files and links."""

from __future__ import annotations

import ast
import csv
import io
import re
import tokenize
from functools import cache
from pathlib import Path

from places import ROOT

PARTS = ("models", "export", "templates", "docs", "tests")
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


@cache
def modules() -> list[Path]:
    """Every module of the repository, and the layouts that stand for text."""
    paths = [path for part in PARTS for path in (ROOT / part).rglob("*") if path.suffix in {".py", ".j2"}]
    return sorted([*ROOT.glob("*.py"), *paths])


@cache
def text_of(path: Path) -> str:
    """Comments and docstrings of a module; the whole text of a page or layout."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return text
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    comments = [
        token.string for token in tokens if token.type == tokenize.COMMENT and "noqa" not in token.string
    ]
    tree = ast.parse(text)
    strings = [
        node.value.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    ]
    return "\n".join([*comments, *strings])


def place(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def without_code(page: str) -> str:
    """A page without its blocks of code, in which an SVG path has words like a rule's number."""
    return re.sub(r"```.*?```", "", page, flags=re.DOTALL)


def rules(text: str) -> list[str]:
    """The numbers of rules that a text cites, ranges as in M1-M3 written out."""
    numbers: list[str] = []
    for letter, first, last in re.findall(r"\b([LMGNBOQWR])(\d{1,2})(?:-\1?(\d{1,2}))?\b", text):
        numbers += [f"{letter}{number}" for number in range(int(first), int(last or first) + 1)]
    return numbers


def listed_rules() -> list[dict[str, str]]:
    """The rows of the tables of rules, beside their page."""
    rows = []
    for path in sorted((ROOT / "docs" / "format-rules").glob("*.csv")):
        with path.open(newline="", encoding="utf-8") as file:
            rows += [row for row in csv.DictReader(file) if "reason" in row]
    return rows


def test_every_rule_that_the_code_cites_is_in_a_table_of_rules():
    listed = [row["rule"] for row in listed_rules()]
    assert len(set(listed)) == len(listed)
    cited = {
        (place(path), rule)
        for path in modules()
        if path.is_relative_to(ROOT / "export") or path.is_relative_to(ROOT / "templates")
        for rule in rules(text_of(path))
    }
    assert {(where, rule) for where, rule in cited if rule not in listed} == set()
    pages = {
        (place(path), rule)
        for path in PAGES
        for rule in re.findall(r"\b[LMGNBOQW]\d{1,2}\b", without_code(path.read_text()))
    }
    assert {(where, rule) for where, rule in pages if rule not in listed} == set()


def test_cited_pages_and_their_sections_are_there():
    sections = re.findall(r"^## (\d+)\.", (ROOT / "docs" / "mathematics.md").read_text(), re.MULTILINE)
    assert sections == [str(number) for number in range(1, len(sections) + 1)]
    for path in modules():
        text = " ".join(text_of(path).split())
        for page in re.findall(r"\bdocs/[\w-]+\.md\b", text):
            assert (ROOT / page).exists(), (place(path), page)
        for numbers in re.findall(r"docs/mathematics\.md, (\d+(?:(?:,| and| to) \d+)*)", text):
            assert set(re.findall(r"\d+", numbers)) <= set(sections), (place(path), numbers)


def test_tests_that_pages_name_are_there():
    named = {(place(path), test) for path in PAGES for test in re.findall(r"`(test_\w+)`", path.read_text())}
    named |= {(row["rule"], test) for row in listed_rules() for test in re.findall(r"test_\w+", row["test"])}
    tests = {
        name
        for path in (ROOT / "tests").rglob("test_*.py")
        for name in re.findall(r"def (test_\w+)", path.read_text())
    }
    assert {(page, test) for page, test in named if test not in tests} == set()


def anchor(title: str) -> str:
    """The anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-")


def test_links_lead_to_files_and_headings():
    for path in PAGES:
        for link in re.findall(r"\]\(([^)\s]+)\)", path.read_text()):
            if link.startswith(("https:", "http:", "mailto:")):
                continue
            file, _, heading = link.partition("#")
            target = (path.parent / file).resolve() if file else path
            assert target.exists(), (place(path), link)
            if heading:
                titles = re.findall(r"^#+ (.+)$", target.read_text(), re.MULTILINE)
                assert heading in map(anchor, titles), (place(path), link)


def test_paths_that_pages_and_comments_name_are_there():
    """Words like `export/formats/lp.py` or `models/search/`, with NAME for any name,
    and modules by their dotted name.
    """
    path_like = re.compile(r"(?<![\w./])((?:models|export|templates|tests|docs|\.ci)/[\w./-]*[\w/])")
    missing = []
    for path in [*PAGES, *modules()]:
        for named in path_like.findall(re.sub(r"Create\s`[^`]+`", "", text_of(path))):
            if path.suffix == ".j2" or (path.suffix == ".py" and "." not in named.rpartition("/")[2]):
                # layouts name each other from their own folder, and in code words with a / may be anything
                continue
            if not any(ROOT.glob(named.rstrip("/").replace("NAME", "*"))):
                missing.append((place(path), named))
        for dotted in re.findall(
            r"\bcrossfield\.((?:models|export|templates)[a-z_0-9.]*[a-z_0-9])", text_of(path)
        ):
            target = ROOT.joinpath(*dotted.split("."))
            if not (target.is_dir() or target.with_suffix(".py").exists()):
                missing.append((place(path), dotted))
    assert missing == []
