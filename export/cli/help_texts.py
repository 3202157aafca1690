"""Help that names what the tables have; a table is imported when a help that names it is shown."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Any, Final

from typer.core import TyperCommand


def _formulations() -> Iterable[str]:
    from ...models.formulations.catalogue import FORMULATIONS

    return FORMULATIONS


def _formats() -> Iterable[str]:
    from ..formats.registry import FORMATS

    return FORMATS


def _default_formats() -> Iterable[str]:
    from ..formats.registry import DEFAULTS

    return DEFAULTS


def _methods() -> Iterable[str]:
    from ..solving.methods import METHODS

    return METHODS


def _methods_of_a_run() -> Iterable[str]:
    from ..solving.methods import METHODS

    return (method.name for method in METHODS.values() if method.in_runs)


def _solvers() -> Iterable[str]:
    from ..solvers_table import DRIVEN

    return DRIVEN


def _programs() -> Iterable[str]:
    from ..solvers_table import PROGRAMS

    return PROGRAMS


def _answers() -> Iterable[str]:
    """The programs whose solution files are read: a description begins with the program."""
    from ..solutions.readers.registry import READERS

    return dict.fromkeys(re.split(r"[ ,]", reader.description)[0] for reader in READERS)


def _samples() -> Iterable[str]:
    from ...models.sketch.samples import SAMPLES

    return SAMPLES


def _size() -> Iterable[str]:
    from ...models.sketch.read import DEFAULT_SIZE

    return [str(DEFAULT_SIZE)]


def _pictures() -> Iterable[str]:
    from ..pictures.draw import KINDS

    return KINDS


def _rungs() -> Iterable[str]:
    from ..library.plan.spec import RUNGS

    return RUNGS


NAMES: Final[dict[str, Callable[[], Iterable[str]]]] = {
    "formulations": _formulations,
    "formats": _formats,
    "default formats": _default_formats,
    "methods": _methods,
    "methods of a run": _methods_of_a_run,
    "solvers": _solvers,
    "programs": _programs,
    "answers": _answers,
    "samples": _samples,
    "size": _size,
    "pictures": _pictures,
    "rungs": _rungs,
}
"""What stands in braces in a help, and where its names come from."""


def filled(text: str) -> str:
    """The text with the names of each table that stands in braces."""
    return re.sub(r"\{([a-z ]+)\}", lambda match: ", ".join(NAMES[match[1]]()), text)


class Command(TyperCommand):
    """A command whose help is filled from the tables when it is shown."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Fill the help of the command and of its parameters, then show it."""
        self.help = re.sub(
            r"(?<!\n)\n(?!\n)", " ", filled(self.help or "")
        )  # lines of a docstring are no paragraphs
        for parameter in self.params:
            if text := getattr(parameter, "help", None):
                parameter.help = filled(text)  # type: ignore[attr-defined]
        super().format_help(ctx, formatter)
