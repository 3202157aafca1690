"""Help texts with names from the tables, which are imported when a help text that needs them is shown."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from importlib import import_module
from typing import Any, Final, get_args

from rich.markup import escape
from typer.core import TyperCommand


def _of(
    module: str, table: str, chosen: Callable[[Any], Iterable[str]] = list
) -> Callable[[], Iterable[str]]:
    """Function that imports a module and returns the names in one of its tables, or a choice of them."""
    return lambda: chosen(getattr(import_module(module, __package__), table))


NAMES: Final = {
    "formulations": _of("...models.formulations.catalogue", "FORMULATIONS"),
    "short names": _of("...models.formulations.catalogue", "short_names", lambda short_names: short_names()),
    "formats": _of("..formats.registry", "FORMATS"),
    "default formats": _of("..formats.registry", "DEFAULTS"),
    "methods": _of("..solving.methods", "METHODS"),
    "kept method": _of("..solving.run", "KEPT", lambda name: [name]),
    "default methods": _of("..solving.evaluate", "DEFAULT_METHODS"),
    "bundled solvers": _of("..solvers_table", "BUNDLED"),
    "all solvers": _of("..solvers_table", "SOLVERS"),
    "logs": _of(
        "..solutions.logs.registry", "LOG_READERS", lambda readers: sorted(each.title for each in readers)
    ),
    "run statuses": _of("..library.ledger.ledger", "RunStatus", get_args),
    "programs": _of("..solvers_table", "PROGRAMS"),
    "answers": _of(  # a description begins with the name of the program
        "..solutions.readers.registry",
        "READERS",
        lambda readers: dict.fromkeys(re.split(r"[ ,]", reader.description)[0] for reader in readers),
    ),
    "samples": _of("...models.sketch.samples", "SAMPLES"),
    "size": _of("...models.sketch.read", "DEFAULT_SIZE", lambda size: [str(size)]),
    "most weight": _of("...models.instance.instance", "MOST_WEIGHT", lambda weight: [f"{weight:,.0f}"]),
    "stroke weight": _of("...models.instance.instance", "STROKE_WEIGHT", lambda weight: [f"{weight:g}"]),
    "skew weight": _of("...models.instance.instance", "SKEW_WEIGHT", lambda weight: [f"{weight:g}"]),
    "pictures": _of("..pictures.draw", "KINDS"),
    "picture side": _of("..shading.raster", "SIDE", lambda side: [str(side)]),
    "light": _of(
        "..shading.colours",
        "UPPER_LEFT",
        lambda light: [f"{math.degrees(light.azimuth):.0f},{math.degrees(light.elevation):.0f}"],
    ),
    "rungs": _of("..library.plan.spec", "RUNGS"),
}
"""Words in braces in help texts, and the function that returns the names for each."""


def filled(text: str) -> str:
    """The text with each word in braces replaced by the names of its table."""
    return re.sub(r"\{([a-z ]+)\}", lambda match: ", ".join(NAMES[match[1]]()), text)


class Command(TyperCommand):
    """Command whose help is filled from the tables when it is shown; brackets are printed as they are."""

    def __init__(self, *args: Any, **given: Any) -> None:
        super().__init__(*args, **given)
        if self.rich_markup_mode != "rich":  # brackets are no markup then, and a backslash would be printed
            return
        self.help = escape(self.help or "")
        for parameter in self.params:
            if text := getattr(parameter, "help", None):
                parameter.help = escape(text)  # type: ignore[attr-defined]

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Fill the help texts of the command and of its parameters, then show them."""
        self.help = re.sub(
            r"(?<!\n)\n(?!\n)", " ", filled(self.help or "")
        )  # a line break in a docstring begins no paragraph
        for parameter in self.params:
            if text := getattr(parameter, "help", None):
                parameter.help = filled(text)  # type: ignore[attr-defined]
        super().format_help(ctx, formatter)
