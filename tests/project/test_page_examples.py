"""The code of tutorials, guides and README runs as printed; the API reference has every public name."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path

import crossfield
import places
import pytest
import typer
from crossfield.export.cli.app import app
from crossfield.export.licences import package_folder
from crossfield.export.solvers_table import PROGRAMS

DOCS = places.ROOT / "docs"
PAGES = [places.ROOT / "README.md", *sorted(DOCS.glob("tutorials/*.md")), *sorted(DOCS.glob("guides/*.md"))]
FENCE = re.compile(r"(?:<!-- needs: (\S+) -->\n)?```(\w+)\n(.*?)```", re.DOTALL)
SAVED = re.compile(r"Save this as `([\w.]+)`")
ELSEWHERE = ("pip install", ".venv/bin/", "sphinx-build", "python3 -m venv", ". .venv", "python -m pytest")
"""Commands that change the environment, which other tests run."""


def programs() -> str:
    """The search path, with the folder of GAMS where it is installed for Python."""
    gams = package_folder("gamspy_base")
    return os.pathsep.join([*([] if gams is None else [str(gams)]), os.environ["PATH"]])


UNTESTED = {"text", "console", "ampl", "julia"}
"""Languages of blocks that nothing here runs: sessions, and programs that CI does not have."""


def is_there(program: str) -> bool:
    if program in PROGRAMS:
        return not PROGRAMS[program].missing
    return shutil.which(program, path=programs()) is not None or find_spec(program) is not None


def run_line(line: str) -> None:
    """Run a line of a shell; commands of crossfield in this process, which has imported it already."""
    for part in line.split(" && "):
        words = shlex.split(part, comments=True)
        if words and not part.startswith(ELSEWHERE):
            if words[0] == "crossfield":
                command = typer.main.get_command(app)
                assert not command(words[1:], prog_name="crossfield", standalone_mode=False), part
            else:
                subprocess.run(words, check=True, stdout=subprocess.DEVNULL)


def run_block(language: str, text: str) -> None:
    """Run a block in the current folder, or save it there."""
    if language == "sh":
        for line in text.splitlines():
            run_line(line)
    elif language == "python":
        exec(compile(text, "page", "exec"), {"__name__": "__main__"})
    elif saved := SAVED.search(text):
        Path(saved[1]).write_text(text)
    else:
        assert language in UNTESTED, f"nothing runs or saves a block of {language}"


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_block_of_a_page_runs_in_turn(page, tmp_path, monkeypatch):
    """A comment `needs: PROGRAM` holds from there to the end of its section."""
    missing = set()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", programs())
    for section in page.read_text(encoding="utf-8").split("\n## "):
        needed = ""
        for needs, language, text in FENCE.findall(section):
            needed = needs or needed
            if needed and language not in UNTESTED and not is_there(needed):
                missing.add(needed)
            else:
                run_block(language, text)
    if missing:
        pytest.skip(f"absent, so their blocks did not run: {', '.join(sorted(missing))}")


def commands(text: str) -> list[list[str]]:
    """The words of every command of crossfield in a page, in blocks and within lines."""
    inline = re.findall(r"`(crossfield [^`]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL))
    lines = [
        part
        for *_, block in FENCE.findall(text)
        for line in block.splitlines()
        for part in line.split(" && ")
    ]
    return [shlex.split(line, comments=True) for line in (*inline, *lines) if line.startswith("crossfield ")]


@pytest.mark.parametrize(
    "page", sorted([*PAGES, *DOCS.glob("*.md")]), ids=lambda page: page.relative_to(DOCS.parent).as_posix()
)
def test_every_command_and_option_of_a_page_exists(page):
    for _, *words in commands(page.read_text(encoding="utf-8")):
        command = typer.main.get_command(app)
        while hasattr(command, "commands") and words and not words[0].startswith("-"):
            assert words[0] in command.commands, words
            command = command.commands[words.pop(0)]
        options = {name for option in command.params for name in (*option.opts, *option.secondary_opts)}
        used = {word.partition("=")[0] for word in words if re.match(r"--?[a-zA-Z]", word)}
        assert used - options - {"--help", "-h"} == set(), words


def test_the_api_reference_has_every_public_name():
    page = (DOCS / "reference" / "api.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\.\. auto\w+:: crossfield\.(\w+)$", page, re.MULTILINE)
    assert sorted(listed) == crossfield.__all__
