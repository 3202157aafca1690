"""The command line in the process of the tests, and the names and examples that it shows."""

from __future__ import annotations

import io
import json
import re
import runpy
import signal
from collections.abc import Iterator, Sequence
from contextlib import redirect_stdout
from typing import Any
from unittest import mock


def invoke(arguments: Sequence[str]) -> int:
    """Run `python -m crossfield` with these arguments in this process and return its exit code."""
    ending = signal.getsignal(signal.SIGTERM)
    try:
        with mock.patch("sys.argv", ["crossfield", *arguments]):
            runpy.run_module("crossfield", run_name="__main__")
    except SystemExit as stop:
        return stop.code
    finally:
        signal.signal(signal.SIGTERM, ending)
    raise AssertionError("the program goes on after its end")


def printed_by(*arguments: str) -> str:
    """What a command prints on a terminal without an end to its right."""
    out = io.StringIO()
    with redirect_stdout(out), mock.patch.dict("os.environ", {"COLUMNS": "1000", "TERM": "dumb"}):
        assert invoke(arguments) == 0
    return out.getvalue()


def listed() -> dict[str, list[dict[str, Any]]]:
    """The tables of `crossfield list`."""
    return json.loads(printed_by("list", "--json"))


def examples(*group: str) -> Iterator[tuple[str, str]]:
    """Every command by name, with the example in its help."""
    shown = printed_by(*group, "--help")
    head, _, commands = shown.partition("─ Commands ─")
    if not commands:
        yield " ".join(group), re.search(r"^ Example: (.+?) *$", head, re.MULTILINE)[1]
    for name in re.findall(r"^│ ([a-z]\S*)", commands, re.MULTILINE):
        yield from examples(*group, name)
