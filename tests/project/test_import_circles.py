"""No module imports another one that leads back to it, at any level: deferred and type-only imports count."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import places

PARTS = ("models", "export", "templates")


def modules(root: Path) -> dict[str, Path]:
    """The modules below the parts of a package by name, packages by the name of their folder."""
    paths = {}
    for path in (path for part in PARTS for path in (root / part).rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        paths[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return paths


def imported(name: str, path: Path, known: dict[str, Path]) -> set[str]:
    """The known modules that a module imports by relative imports, wherever in its text they stand."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = [*package[: len(package) - node.level + 1], *filter(None, [node.module])]
            for alias in node.names:
                target = ".".join([*base, alias.name])
                names.add(target if target in known else ".".join(base))
    return names & set(known)


def circle(root: Path) -> list[str]:
    """A circle of imports, empty where there is none."""
    known = modules(root)
    try:
        TopologicalSorter({name: imported(name, path, known) for name, path in known.items()}).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_there_is_no_circle_of_imports():
    assert circle(places.ROOT) == []
