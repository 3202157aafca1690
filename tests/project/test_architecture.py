"""docs/architecture.md shows the rooms as they are; no import leads up, into another room or in circles."""

import ast
import re
from graphlib import TopologicalSorter

import pytest
from places import ROOT

LINES = re.compile(r",\d+$|[\d,]+ lines", re.MULTILINE)  # they change every day


@pytest.fixture(scope="module")
def rooms(docs_module):
    """The program that draws the rooms."""
    return docs_module("rooms")


def test_the_table_and_the_picture_are_those_of_the_rooms(rooms, docs_module):
    made = docs_module("make").csv_text(rooms.table(ROOT)), rooms.picture(ROOT)
    for name, text in zip(("architecture/rooms.csv", "architecture.svg"), made, strict=True):
        assert LINES.sub("", (ROOT / "docs" / name).read_text(encoding="utf-8")) == LINES.sub("", text)


def test_every_folder_is_in_one_room(rooms):
    assert sorted(rooms.ORDER) == rooms.folders(ROOT)


def test_a_room_uses_the_core_and_its_rooms_alone_and_no_arrow_leads_upwards(rooms):
    for at, folder in enumerate(rooms.ORDER):
        used = [other for other in rooms.used_folders(ROOT, folder) if (folder, other) != rooms.DEFAULT_JUMPS]
        assert [other for other in used if other not in rooms.ORDER[:at]] == [], folder
        room = rooms.room_of(folder)
        assert {rooms.room_of(other) for other in used} <= {room, rooms.CORE, *rooms.ROOMS[room].uses}, folder
    absolute = re.compile(r"^\s*(from|import) crossfield\b", re.MULTILINE)  # these the table does not see
    paths = [path for part in ("models", "export", "templates") for path in (ROOT / part).rglob("*.py")]
    assert [path for path in paths if absolute.search(path.read_text(encoding="utf-8"))] == []


def test_no_import_inside_a_folder_leads_back(rooms):
    """Deferred and type-only imports count; between folders, the order of the table forbids circles."""
    for folder in rooms.ORDER:
        paths = {path.stem: path for path in (ROOT / folder).glob("*.py") if path.stem != "__init__"}
        beside = {name: set() for name in paths}
        for name, path in paths.items():
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ImportFrom) and node.level == 1:
                    names = [node.module] if node.module else [alias.name for alias in node.names]
                    beside[name] |= {each.partition(".")[0] for each in names} & {*paths}
        TopologicalSorter(beside).prepare()  # raises an error that names a circle
