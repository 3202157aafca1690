"""Queries and scripts of the pages on libraries return what the pages say."""

from __future__ import annotations

import csv
import re
import sqlite3
import subprocess
import sys
from contextlib import closing

import crossfield as cf
import places
import pytest
from crossfield.export.library.building.table import COLUMNS
from libraries import OPEN, library_of

PAGE = places.ROOT / "docs" / "library.md"
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)


def test_the_query_of_the_page_finds_entries():
    page = PAGE.read_text(encoding="utf-8")
    ((table, query),) = re.findall(r'sqlite3 :memory: "\.import --csv (\S+) entries" "(.*)"', page)
    with closing(sqlite3.connect(":memory:")) as database, (places.ROOT / table).open(newline="") as stream:
        head, *rows = csv.reader(stream)
        database.execute(f"create table entries ({', '.join(head)})")
        database.executemany(f"insert into entries values ({', '.join('?' * len(head))})", rows)
        names = [name for (name,) in database.execute(query)]
    assert names == [
        entry.name
        for entry in cf.entries()
        if entry.facts["formulation"] == "miqp-exact" and entry.facts["pairs"] < 30
    ]


def test_the_page_describes_every_column_of_the_table():
    with (places.ROOT / "docs" / "library" / "columns.csv").open(newline="") as stream:
        assert [row["column"] for row in csv.DictReader(stream)] == list(COLUMNS)


def blocks(*words):
    """The blocks of Python in docs/library.md that have these words."""
    page = PAGE.read_text(encoding="utf-8")
    return [block for block in BLOCK.findall(page) if all(word in block for word in words)]


@pytest.mark.slow
@pytest.mark.usefixtures("short_searches")
def test_the_script_for_open_entries_lists_these_alone(tmp_path):
    (script,) = blocks("library.json", "print(")
    library = library_of(tmp_path, OPEN)
    shown = subprocess.run(
        [sys.executable, "-c", script], cwd=library.folder, check=True, capture_output=True, text=True
    ).stdout
    named = [line.split()[0] for line in shown.splitlines()]
    status = {name: library.entry(name)["status"] for name in library.document["entries"]}
    assert named == [name for name in status if status[name] == "best known"]
    assert 0 < len(named) < len(status)


@pytest.mark.slow
def test_an_entry_by_name_has_what_the_page_uses(tmp_path):
    (script,) = blocks("cf.entry(", "entry.write")
    subprocess.run([sys.executable, "-c", f"{script}\nassert small"], cwd=tmp_path, check=True)
    assert (tmp_path / "skew.mps").exists()
