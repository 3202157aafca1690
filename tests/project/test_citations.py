"""What pages and comments cite exists: links, headings, files, and rules of formats."""

from __future__ import annotations

import csv
import re
import subprocess
from functools import cache

from places import ROOT

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
TEXTS = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in PAGES}


def anchor(title: str) -> str:
    """The anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-")


def test_links_lead_to_files_and_headings():
    broken = []
    for path, text in zip(PAGES, TEXTS.values(), strict=True):
        for link in re.findall(r"\]\(([^)\s]+)\)", text):
            file, _, heading = link.partition("#")
            target = path.parent / file if file else path
            if "://" in link or link.startswith("mailto:"):
                continue
            titles = re.findall(r"^#+ (.+)$", target.read_text(), re.MULTILINE) if heading else []
            if not target.exists() or (heading and heading not in map(anchor, titles)):
                broken.append((path.name, link))
    assert broken == []


def test_files_that_pages_name_are_there():
    """Words like `models/search/`, NAME being any: now, or in a whole clone at a commit in their line."""
    path_like = re.compile(r"(?<![\w./])((?:models|export|templates|tests|docs|\.ci)/[\w./-]*[\w/])")
    texts = [*TEXTS.values(), *(path.read_text() for path in (ROOT / "docs" / "evidence").rglob("*.csv"))]
    missing = []
    for line in re.sub(r"Create\s`[^`]+`", "", "\n".join(texts)).splitlines():
        named = path_like.findall(line)
        there = {path for path in named if any(ROOT.glob(path.rstrip("/").replace("NAME", "*")))}
        if commit := re.search(r"commit ([0-9a-f]{8})", line):
            there |= files_of(commit[1]) if has_history() else {*named}
        missing += {*named} - there
    assert missing == []


@cache
def has_history() -> bool:
    return (ROOT / ".git").exists() and git("rev-parse", "--is-shallow-repository") == ["false"]


@cache
def files_of(commit: str) -> set[str]:
    return {*git("ls-tree", "-r", "--name-only", commit)}


def git(*arguments: str) -> list[str]:
    return subprocess.check_output(["git", *arguments], cwd=ROOT, text=True).splitlines()


def test_rules_of_formats_that_are_cited_are_in_a_table():
    listed = []
    for path in (ROOT / "docs" / "format-rules").glob("*.csv"):
        with path.open(newline="", encoding="utf-8") as file:
            listed += [row["rule"] for row in csv.DictReader(file) if "reason" in row]
    assert len(set(listed)) == len(listed) > 0
    pages = (re.sub(r"```.*?```", "", text, flags=re.DOTALL) for text in TEXTS.values())
    assert {rule for page in pages for rule in re.findall(r"\b[LMGNBOQW]\d{1,2}\b", page)} <= {*listed}
