"""Sphinx extension: the directive `command-reference` lists all commands with their options."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import typer
from crossfield.export.cli.app import app as commands
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from docutils.nodes import Node
    from sphinx.application import Sphinx


class CommandReference(SphinxDirective):
    """One section per command, from the definitions that also give `--help`."""

    def run(self) -> list[Node]:
        """Return the sections, parsed from Markdown."""
        lines = _group("crossfield", typer.main.get_command(commands))
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def _group(prefix: str, group: Any) -> Iterator[str]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _group(f"{prefix} {name}", command)
        else:
            yield from _command(f"{prefix} {name}", command)


def _command(title: str, command: Any) -> Iterator[str]:
    context = command.make_context(title, [], resilient_parsing=True)
    yield from (f"## {title}", "", _text(command.help or ""), "")
    yield from ("```sh", command.epilog.removeprefix("Example: "), "```", "")
    for head, kind in (("Argument", "argument"), ("Option", "option")):
        records = [
            parameter.get_help_record(context)
            for parameter in command.params
            if parameter.param_type_name == kind
        ]
        if records:
            yield from (f"| {head} | Meaning |", "| --- | --- |")
            yield from (f"| `{_cell(name)}` | {_cell(_text(text))} |" for name, text in records)
            yield ""


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _text(text: str) -> str:
    """A help text, one line per paragraph."""
    paragraphs = text.split("\n\n")
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)


def setup(app: Sphinx) -> None:
    """Register the directive."""
    app.add_directive("command-reference", CommandReference)
