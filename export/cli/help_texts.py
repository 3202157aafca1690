"""Help texts with names from the tables, which are imported when a help text that needs them is shown."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from importlib import import_module
from typing import Any, Final

from typer.core import TyperCommand, TyperGroup


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
    "methods": _names_in("..solving.methods", "METHODS"),
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


FACTS: Final = "Facts about the run"
"""Panel of the options that only describe a run, some of which set limits in other commands."""
PANELS: Final = {
    "Sketch": "size mask silhouette curvature view",
    "Mesh": "sharp directions weights",
    "Instance": "crosses gauge stroke-weight skew-weight",
    "Formulation": "formulation facet stroke-norm beta-norm relax limits norm tightened",
    "Method and solver": "method solver start program solve search",
    "Entries": "rung",
    "Files": "format nl-form gzip manifest solution check on underlay points",
    "Picture and surface": "kind side light flip hint port no-browser",
    "Limits and processes": "time-limit gap bound threads jobs tolerance up-to scheduler",
    FACTS: "",
    "Output": "output force quiet json help",
}
"""Panels of the help in their order, and their options."""
EXAMPLES: Final = {
    "run": "crossfield run mouse -o out --time-limit 5",
    "instance": "crossfield instance mouse --size 48 -o mouse.json",
    "export": "crossfield export skew --size 4 -f milp-mccormick -F mps -F lp -o files",
    "solve": "crossfield solve mouse --size 48 --method bend -o field",
    "prove": "crossfield prove skew --size 5 -o proof",
    "read": "crossfield read skew.sol --manifest files/skew.milp-mccormick.manifest.json -o skew.npz",
    "draw": "crossfield draw field/mouse.bend.field.npz --kind overview -o field.png",
    "shade": "crossfield shade field/mouse.bend.field.npz --underlay mouse -o surface",
    "studio": "crossfield studio mouse",
    "verify": "crossfield verify files --solve 2",
    "list": "crossfield list",
    "library build": "crossfield library build small.toml -o library",
    "library get": "crossfield library get cf_mouse_n004_exact -o models",
    "library solve": "crossfield library solve library --solver highs --time-limit 2",
    "library verify": "crossfield library verify library",
}
"""An example of every command; each uses files that earlier examples write."""
_PANEL_OF: Final = {f"--{name}": panel for panel, names in PANELS.items() for name in names.split()}


def _find_panel(option: Any) -> str:
    """The panel of an option; one without a name in the table belongs to the output."""
    return next((_PANEL_OF[name] for name in option.opts if name in _PANEL_OF), "Output")


def _hide_type_of_flag(option: Any) -> Any:
    """The option; without a type in its help if it takes no value."""
    if getattr(option, "is_flag", False):
        option.metavar = ""
    return option


class Group(TyperGroup):
    """Commands with common options."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.params = [_hide_type_of_flag(parameter) for parameter in self.params]

    def get_help_option(self, ctx: Any) -> Any:
        """The option --help."""
        return _hide_type_of_flag(super().get_help_option(ctx))


class Command(TyperCommand):
    """Command whose help is filled from the tables when it is shown; brackets are printed as they are."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        for option in (parameter for parameter in self.params if parameter.param_type_name == "option"):
            option.rich_help_panel = option.rich_help_panel or _find_panel(option)  # type: ignore[attr-defined]
            _hide_type_of_flag(option)
        order = ["", *PANELS]
        self.params.sort(key=lambda parameter: order.index(getattr(parameter, "rich_help_panel", None) or ""))

    def get_help_option(self, ctx: Any) -> Any:
        """The option --help, in its panel."""
        option = super().get_help_option(ctx)
        if option is not None:
            option.rich_help_panel = _find_panel(option)
        return _hide_type_of_flag(option)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Fill the help texts of the command and of its parameters, then show them."""
        # A line break in a docstring begins no paragraph.
        described = re.sub(r"(?<!\n)\n(?!\n)", " ", self._fill_and_escape(self.help or ""))
        example = EXAMPLES.get(ctx.command_path.partition(" ")[2])
        self.help = f"Example: {example}\n\n{described}" if example else described
        for parameter in self.params:
            if text := getattr(parameter, "help", None):
                parameter.help = self._fill_and_escape(text)  # type: ignore[attr-defined]
        super().format_help(ctx, formatter)

    def _fill_and_escape(self, text: str) -> str:
        """The text with names from the tables, its brackets escaped where they would be markup."""
        from rich.markup import escape

        return escape(fill_names(text)) if self.rich_markup_mode == "rich" else fill_names(text)
