"""The tutorials of docs/extend.md work as printed, in a copy of the repository."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import textwrap
from contextlib import suppress
from pathlib import Path

import pytest
from places import ROOT

FENCE = re.compile(r"(.*?)^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
CREATE = re.compile(r"Create\s`([^`]+)`:\s*\Z")
ADD = re.compile(r"Add to\s`([^`]+)`,\sabove\s`([^`]+)`:\s*\Z")
COMMANDS = """import sys
from crossfield.export.cli.app import invoke
sys.exit(any(invoke(line.removeprefix("crossfield ").split()) for line in sys.argv[1:]))"""


def apply(before: str, code: str, folder: Path) -> bool:
    """Create a file, or add lines above one that is named; whether the text asks for either."""
    if create := CREATE.search(before):
        (folder / create[1]).write_text(code, encoding="utf-8")
    elif add := ADD.search(before):
        path = folder / add[1]
        text = path.read_text(encoding="utf-8")
        place = re.search(rf"^( *){re.escape(add[2])}", text, re.MULTILINE)
        assert place, add[0]
        with suppress(SyntaxError):
            ast.parse(code, mode="eval")
            code = f"{code.rstrip()},\n"  # an entry of a table
        lines = textwrap.indent(code, place[1])
        path.write_text(text[: place.start()] + lines + text[place.start() :], encoding="utf-8")
    return bool(create or add)


@pytest.mark.slow
def test_the_four_tutorials_work_as_printed(tmp_path):
    copy = tmp_path / "crossfield"
    for part in ("export", "models", "templates"):
        shutil.copytree(ROOT / part, copy / part)
    for part in ("__init__.py", "__main__.py", "pyproject.toml"):
        shutil.copy(ROOT / part, copy)
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}

    def run(*words: str) -> None:
        subprocess.run([sys.executable, *words], cwd=copy, env=environment, check=True)

    page = (ROOT / "docs" / "extend.md").read_text(encoding="utf-8")
    for before, language, code in FENCE.findall(page):
        if apply(before, code, copy):
            continue
        if language == "python":
            run("-c", code)
        else:
            run("-c", COMMANDS, *code.splitlines())
