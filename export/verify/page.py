"""The page of a verification: one HTML file with its matrix, without a network or a script."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from ...models.storage import write_bytes
from ...templates import ENVIRONMENT
from ..formats.registry import generator
from ..solvers_table import PROGRAMS, SOLVERS

if TYPE_CHECKING:
    from .checks import Check, Verification

PAGE: Final = "verify.html"
_MEANING: Final = {
    "agrees": "The program holds the same problem, or its answer is confirmed.",
    "differs": "The program holds another problem, or its answer contradicts another one.",
    "failed": "The program ended with an error.",
    "time limit": "The solver stopped at its limit; its point and bound contradict nothing.",
    "refused, as stated": "The program refuses the file, as the table of solvers states.",
    "not tried": "The check is impossible here; the reason is given below.",
}


def write_page(found: Verification) -> None:
    """Write verify.html into the folder of the files. Raises OutputError."""
    steps = [
        {"title": title, "lead": lead, "heads": heads, "rows": rows}
        for step, title, lead in (
            ("read", "Reading", "Each file, and each program that reads its format."),
            ("solve", "Solving", "Objectives are computed again at the solver's point."),
        )
        if any(check.step == step for check in found.checks)
        for heads, rows in [_matrix(found, step)]
    ]
    text = ENVIRONMENT.get_template("run/verify.html.j2").render(
        generator=generator(),
        name=found.folder.resolve().name,
        ok=found.ok,
        files=len({check.file for check in found.checks}),
        checks=len(found.checks),
        problems=list(dict.fromkeys(check.problem for check in found.checks)),
        bad=[_note(check) for check in found.bad],
        steps=steps,
        meaning={
            word: text for word, text in _MEANING.items() if any(c.verdict == word for c in found.checks)
        },
        notes=[_note(check) for check in found.checks if check.reason and check not in found.bad],
        versions=[(_title(name), version) for name, version in found.versions.items()],
        absent=[(_title(name), how) for name, how in found.absent.items()],
    )
    write_bytes(found.folder / PAGE, text.encode())


def _title(name: str) -> str:
    """The title of a solver or a program; a file that belongs to no manifest was given to neither."""
    return SOLVERS[name].title if name in SOLVERS else PROGRAMS[name].title if name else "manifest"


def _matrix(found: Verification, step: str) -> tuple[list[str], list[dict[str, Any]]]:
    """Titles of the programs, and for each file its name and one cell per program."""
    checks = {(each.file, each.program): each for each in found.checks if each.step == step}
    programs = [name for name in dict.fromkeys(name for _, name in checks) if name]
    files = dict.fromkeys(file for file, _ in checks)
    rows = [{"file": file, "cells": [_cell(checks.get((file, name))) for name in programs]} for file in files]
    return list(map(_title, programs)), rows


def _cell(check: Check | None) -> dict[str, str]:
    if check is None:
        return {"verdict": "", "number": "", "reason": ""}
    number = "" if check.objective is None else f"{check.objective:.7g}"
    return {"verdict": str(check.verdict), "number": number, "reason": check.reason}


def _note(check: Check) -> dict[str, str]:
    return {
        "file": check.file,
        "program": _title(check.program),
        "step": check.step,
        "verdict": str(check.verdict),
        "reason": check.reason,
    }
