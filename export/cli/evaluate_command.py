"""The command `evaluate`: each curve of a drawing is hidden in turn, and the methods are asked for it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .inputs import choice_of, known, load
from .options import (
    Curvature,
    GaugeName,
    Json,
    Mask,
    Outline,
    Quiet,
    Size,
    SkewWeight,
    StrokeWeight,
    View,
    What,
)
from .output import complain, progress, say, say_json, show_table

if TYPE_CHECKING:
    from ..solving.evaluate import Evaluation


def evaluate_command(
    sketch: What,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Folder for NAME.evaluation.json; else none."),
    ] = None,
    *,
    method: Annotated[
        list[str] | None,
        typer.Option(
            "-m",
            "--method",
            metavar="NAME",
            help="{methods}; {default methods} by default, may be repeated.",
        ),
    ] = None,
    curves: Annotated[
        int,
        typer.Option("--curves", min=1, metavar="N", help="How many curves are hidden, the longest ones."),
    ] = 8,
    size: Size = None,
    mask: Mask = None,
    silhouette: Outline = "none",
    curvature: Curvature = None,
    view: View = None,
    gauge: GaugeName = None,
    stroke_weight: StrokeWeight = None,
    skew_weight: SkewWeight = None,
    time_limit: Annotated[
        float,
        typer.Option(
            "--time-limit",
            min=0.1,
            metavar="SECONDS",
            help="Seconds for each field of a method that searches: one for each hidden curve.",
        ),
    ] = 5.0,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Measure methods by curves that they were not shown: hide each curve of a drawing in turn.

    The measure is the mean angle between a hidden curve and the nearer line of the field that was made from
    the rest; crosses at random have 22.5 degrees. Ctrl-C keeps the curves done so far.
    """
    from ...models.processes.limits import Limits
    from ..solving.evaluate import DEFAULT_METHODS, evaluate
    from ..solving.methods import METHODS

    methods = known(method or list(DEFAULT_METHODS), METHODS, "method")
    with progress(quiet=quiet) as show:
        show("reading the sketch")
        choice = choice_of(silhouette, curvature, view)
        instance = load(
            sketch,
            size,
            mask,
            gauge,
            choice,
            stroke_weight=stroke_weight,
            skew_weight=skew_weight,
            quiet=quiet,
        )
        found = evaluate(
            instance,
            sketch=sketch,
            curvature=curvature or (),
            view=view,
            methods=methods,
            curves=curves,
            limits=Limits(time_limit),
            progress=lambda line: show(f"{line}; Ctrl-C keeps the curves done"),
        )
    target = None if output is None else _write(found, output)
    if as_json:
        say_json(found.document())
    elif not quiet:
        _show(found)
        if target is not None:
            say(f"report: {target}")
    if found.interrupted:
        complain("interrupted; the curves done so far were kept")


def _write(found: Evaluation, folder: Path) -> Path:
    """The file that the evaluation now is in."""
    from ...models.storage import make_folder, write_bytes

    target = make_folder(folder) / f"{found.instance.name}.evaluation.json"
    write_bytes(target, (json.dumps(found.document(), indent=1, allow_nan=False) + "\n").encode())
    return target


def _show(found: Evaluation) -> None:
    """Print the angles, a row for each hidden curve, and below their mean, median and standard error."""
    rows = [
        [str(each.curve), str(each.pixels), *(_degrees(each.degrees.get(name)) for name in found.methods)]
        for each in found.curves
    ]
    facts = found.document()["methods"]
    for fact in ("mean", "median", "standard_error"):
        of_all = (_degrees(facts[name] and facts[name][fact]) for name in found.methods)
        rows.append([fact.replace("_", " "), "", *of_all])
    columns = ("hidden curve", "pixels", *found.methods)
    show_table(found.instance.summary, columns, rows, numbers=columns[1:])
    if not found.drawn:
        say("nothing says what the curves are: they are chains of stroke pixels")
    say("degrees between a hidden curve and the nearer line of the field; 22.5 at random")
    for curve in found.curves:
        for name, reason in curve.failures.items():
            complain(f"curve {curve.curve}, {name}: {reason}")


def _degrees(angle: float | None) -> str:
    return "-" if angle is None else f"{angle:.1f}"
