"""docs/architecture.md and its picture describe the present folders, and no import leads upwards."""

from __future__ import annotations

import ast
import csv
import re

import pytest
from places import ROOT


@pytest.fixture(scope="module")
def rooms(docs_module):
    """The program that draws the folders."""
    return docs_module("rooms")


@pytest.fixture(scope="module")
def listed():
    """The rows of the table beside the page: folder -> (description, imports), lowest folder first."""
    with (ROOT / "docs" / "architecture" / "folders.csv").open(newline="", encoding="utf-8") as file:
        return {row["folder"]: (row["content"], row["imports"].split()) for row in csv.DictReader(file)}


def test_the_table_lists_every_folder_and_every_arrow(rooms, listed):
    assert sorted(listed) == rooms.folders(ROOT)
    assert listed == {
        folder: (rooms.first_line(ROOT, folder), rooms.used_folders(ROOT, folder)) for folder in listed
    }


def test_no_arrow_leads_upwards_and_so_there_is_no_circle(listed):
    order = list(listed)
    upwards = [
        (folder, target)
        for folder, (_, used) in listed.items()
        for target in used
        if target not in order[: order.index(folder)]
    ]
    assert upwards == []
    absolute = re.compile(r"^\s*(from|import) crossfield\b", re.MULTILINE)  # these the table does not see
    paths = [path for part in ("models", "export", "templates") for path in (ROOT / part).rglob("*.py")]
    assert [path for path in paths if absolute.search(path.read_text(encoding="utf-8"))] == []


SOLVERS_AND_LAYOUT = {"casadi", "clarabel", "cplex", "gamspy_base", "gamspy_baron", "gurobipy", "highspy"}
SOLVERS_AND_LAYOUT |= {"pyomo", "pyqplib", "pyscipopt", "pytoulbar2", "xpress"}
SOLVERS_AND_LAYOUT |= {"jinja2", "matplotlib", "rich", "typer"}


def imports(path):
    """The packages that a module imports anywhere in its text, our own left out."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module.split(".")[0]


def test_two_modules_of_the_mathematics_call_a_solver_in_memory_and_none_knows_a_layout():
    users = {
        path.relative_to(ROOT).as_posix(): packages
        for path in (ROOT / "models").rglob("*.py")
        if (packages := SOLVERS_AND_LAYOUT & set(imports(path)))
    }
    assert users == {
        "models/formulations/arrays.py": {"highspy"},
        "models/search/angle_program.py": {"clarabel"},
    }


def test_the_picture_is_that_of_the_folders(rooms):
    assert (ROOT / "docs" / "architecture.svg").read_text() == rooms.picture(ROOT)
