"""Programs of a library as one file: a module together with what it imports from this package."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path


def standalone_program(path: Path) -> bytes:
    """The text of a module in which relative imports are replaced by the modules that they import."""
    return "".join(_lines(path, set())).encode()


def _lines(path: Path, included: set[Path]) -> Iterator[str]:
    """The lines of a module, with those of the modules that it imports, each of which is included once.

    An included module lacks its docstring and its import of annotations, which only a file's start may have.
    """
    included.add(path)
    inner, at = len(included) > 1, 0
    lines = path.read_text("utf-8").splitlines(keepends=True)
    for node in ast.parse("".join(lines)).body:
        module = _module_of(node, path)
        docstring = node.lineno == 1 and isinstance(node, ast.Expr)
        if module or (inner and (docstring or _is_future(node))):
            yield from lines[at : node.lineno - 1]
            at = node.end_lineno or node.lineno
        if module and module not in included:
            yield from _lines(module, included)
    yield from lines[at:]


def _module_of(node: ast.stmt, path: Path) -> Path | None:
    """The file of the module that a relative import names."""
    if not isinstance(node, ast.ImportFrom) or not node.level:
        return None
    return path.parents[node.level - 1].joinpath(*(node.module or "").split(".")).with_suffix(".py")


def _is_future(node: ast.stmt) -> bool:
    return isinstance(node, ast.ImportFrom) and node.module == "__future__"
