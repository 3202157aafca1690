"""docs/architecture.md and its picture describe the present folders, and no import leads upwards."""

from __future__ import annotations

import ast
import re
from importlib import import_module
from pathlib import Path

import pytest

ROOT = next(path for path in Path(__file__).resolve().parents if (path / "pyproject.toml").exists())


@pytest.fixture(scope="module")
def rooms():
    """The program that draws the folders."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "docs")
        return import_module("rooms")


@pytest.fixture(scope="module")
def listed():
    """The rows of the page's table: folder -> (description, imports), lowest folder first."""
    page = (ROOT / "docs" / "architecture.md").read_text()
    rows = re.findall(r"^\| `([a-z/]+)/` \| (.+?) \| (.+) \|$", page, re.MULTILINE)
    return {folder: (text, re.findall(r"`([a-z/]+)`", used)) for folder, text, used in rows}


def test_the_page_lists_every_folder_and_every_arrow(rooms, listed):
    assert sorted(listed) == rooms.folders(ROOT)
    assert {folder: used for folder, (_, used) in listed.items()} == {
        folder: rooms.uses(ROOT, folder) for folder in listed
    }


def test_every_folder_says_what_lives_there(rooms, listed):
    assert {folder: text for folder, (text, _) in listed.items()} == {
        folder: rooms.first_line(ROOT, folder) for folder in listed
    }
    assert all(text.endswith((".", "?")) and len(text) < 60 for text, _ in listed.values())


def upwards(listed):
    """Arrows to a folder that comes later in the table, or is missing."""
    order = list(listed)
    return [
        (folder, other)
        for folder, (_, used) in listed.items()
        for other in used
        if other not in order[: order.index(folder)]
    ]


def test_no_arrow_leads_upwards_and_so_there_is_no_circle(listed):
    assert upwards(listed) == []
    absolute = re.compile(r"^\s*(from|import) crossfield\b", re.MULTILINE)  # these the table does not see
    paths = [path for part in ("models", "export", "templates") for path in (ROOT / part).rglob("*.py")]
    assert [path for path in paths if absolute.search(path.read_text(encoding="utf-8"))] == []


SOLVERS = {"casadi", "clarabel", "cplex", "gamspy_base", "gamspy_baron", "gurobipy", "highspy"}
SOLVERS |= {"pyomo", "pyqplib", "pyscipopt", "pytoulbar2", "xpress"}


def imports(path):
    """The packages that a module imports anywhere in its text, our own left out."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module.split(".")[0]


def test_two_modules_of_the_mathematics_call_a_solver_in_memory():
    users = {
        path.relative_to(ROOT).as_posix(): solvers
        for path in (ROOT / "models").rglob("*.py")
        if (solvers := SOLVERS & set(imports(path)))
    }
    assert users == {
        "models/formulations/arrays.py": {"highspy"},
        "models/search/absolute_fit.py": {"clarabel"},
    }


def test_the_picture_is_that_of_the_folders(rooms):
    assert (ROOT / "docs" / "architecture.svg").read_text() == rooms.picture(ROOT)
    assert set(rooms.PLACES) < set(rooms.ORDER)
    for begin, end, *_ in rooms.FLOW:
        assert begin in rooms.uses(ROOT, end) or end in rooms.uses(ROOT, begin), (begin, end)


def test_imports_of_all_kinds_are_seen(rooms, tmp_path):
    files = {
        "models/__init__.py": '"""The ground."""\n',
        "models/grid/__init__.py": '"""A grid.\n\nMore.\n"""\n',
        "models/grid/cells.py": "from ..field import angles\nfrom ..errors import E\nimport os\n",
        "models/field/__init__.py": '"""A field."""\n',
        "models/field/angles.py": "from . import other\nfrom ..grid.cells import at\n",
        "export/__init__.py": "",
        "export/cli/__init__.py": "",
        "export/cli/app.py": "def late():\n    from ...models import grid, field\n"
        "    from ...templates import x\n",
        "templates/__init__.py": "",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    found = rooms.folders(tmp_path)
    assert found == ["export", "export/cli", "models", "models/field", "models/grid", "templates"]
    listed = {folder: (rooms.first_line(tmp_path, folder), rooms.uses(tmp_path, folder)) for folder in found}
    assert listed["models/grid"] == ("A grid.", ["models/field"])
    assert listed["models/field"] == ("A field.", ["models/grid"])
    assert listed["export/cli"][1] == ["models/field", "models/grid", "templates"]
    assert ("models/field", "models/grid") in upwards(listed)  # one half of the circle
