"""Help texts with names from the tables, which are imported when a help text that needs them is shown."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from importlib import import_module
from typing import Any, Final

from typer.core import TyperCommand


def _names_in(
    module: str, table: str, chosen: Callable[[Any], Iterable[str]] = list
) -> Callable[[], Iterable[str]]:
    """Function that imports a module and returns the names in one of its tables, or a choice of them."""
    return lambda: chosen(getattr(import_module(module, __package__), table))


NAMES: Final = {
    "formulations": _names_in("...models.formulations.catalogue", "FORMULATIONS"),
    "short names": _names_in(
        "...models.formulations.catalogue", "short_names", lambda short_names: short_names()
    ),
    "formats": _names_in("..formats.registry", "FORMATS"),
    "default formats": _names_in("..formats.registry", "DEFAULTS"),
    "methods": _names_in("..runs.methods", "METHODS"),
    "bundled solvers": _names_in("..solvers_table", "BUNDLED"),
    "all solvers": _names_in("..solvers_table", "SOLVERS"),
    "programs": _names_in("..solvers_table", "PROGRAMS"),
    "answers": _names_in(  # a description begins with the name of the program
        "..solutions.readers.registry",
        "READERS",
        lambda readers: dict.fromkeys(re.split(r"[ ,]", reader.description)[0] for reader in readers),
    ),
    "samples": _names_in("...models.sketch.samples", "SAMPLES"),
    "mesh samples": _names_in("...models.mesh.shapes", "MESHES"),
    "meshes": _names_in("...models.mesh.formats", "MESH_READERS"),
    "size": _names_in("...models.sketch.read", "DEFAULT_SIZE", lambda size: [str(size)]),
    "most weight": _names_in("...models.instance.instance", "MOST_WEIGHT", lambda weight: [f"{weight:,.0f}"]),
    "stroke weight": _names_in(
        "...models.instance.instance", "STROKE_WEIGHT", lambda weight: [f"{weight:g}"]
    ),
    "skew weight": _names_in("...models.instance.instance", "SKEW_WEIGHT", lambda weight: [f"{weight:g}"]),
    "pictures": _names_in("..pictures.draw", "KINDS"),
    "picture side": _names_in("..shading.raster", "SIDE", lambda side: [str(side)]),
    "light": _names_in(
        "..shading.colours",
        "UPPER_LEFT",
        lambda light: [f"{math.degrees(light.azimuth):.0f},{math.degrees(light.elevation):.0f}"],
    ),
    "rungs": _names_in("..library.plan.spec", "RUNGS"),
}
"""Words in braces in help texts, and the function that returns the names for each."""


def fill_names(text: str) -> str:
    """The text with each word in braces replaced by the names of its table."""
    return re.sub(r"\{([a-z ]+)\}", lambda match: ", ".join(NAMES[match[1]]()), text)


class Command(TyperCommand):
    """Command whose help is filled from the tables when it is shown; brackets are printed as they are."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Fill the help texts of the command and of its parameters, then show them."""
        # A line break in a docstring begins no paragraph.
        self.help = re.sub(r"(?<!\n)\n(?!\n)", " ", self._fill_and_escape(self.help or ""))
        for parameter in self.params:
            if text := getattr(parameter, "help", None):
                parameter.help = self._fill_and_escape(text)  # type: ignore[attr-defined]
        super().format_help(ctx, formatter)

    def _fill_and_escape(self, text: str) -> str:
        """The text with names from the tables, its brackets escaped where they would be markup."""
        from rich.markup import escape

        return escape(fill_names(text)) if self.rich_markup_mode == "rich" else fill_names(text)
