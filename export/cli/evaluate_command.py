"""The command `evaluate`: the error of methods on curves of a drawing that are hidden from them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from . import options
from .inputs import known
from .output import print_line, print_notice, progress, show_table
from .sketch_options import SketchOptions

if TYPE_CHECKING:
    from ..solving.evaluate import Evaluation


def evaluate_command(
    source: options.Input,
    output: options.ReportFolder = None,
    *,
    method: options.MethodNames = None,
    curves: options.Curves = 8,
    sketch: SketchOptions,
    time_limit: options.SecondsPerField = 5.0,
    printing: options.PrintOptions,
) -> None:
    """Measure methods on hidden curves: each curve of a drawing is hidden in turn.

    The measure is the mean angle between the hidden curve and the nearer line of the field computed from
    the other curves. Random crosses have 22.5 degrees. Ctrl-C keeps the curves done so far.
    """
    from ...models.processes.limits import Limits
    from ..solving.evaluate import DEFAULT_METHODS, evaluate
    from ..solving.methods import METHODS

    methods = known(method or list(DEFAULT_METHODS), METHODS, "method")
    with progress(quiet=printing.quiet) as show:
        show("reading the sketch")
        found = evaluate(
            sketch.instance(source, quiet=printing.quiet),
            sketch=source,
            curvature=sketch.curvature or (),
            view=sketch.view,
            methods=methods,
            curves=curves,
            limits=Limits(time_limit),
            progress=lambda line: show(f"{line}; Ctrl-C keeps the curves done"),
        )
    target = None if output is None else _write(found, output)
    printing.show(found.document(), lambda: _show(found, target))
    if found.interrupted:
        print_notice("interrupted; the curves done so far were kept")


def _write(found: Evaluation, folder: Path) -> Path:
    """Write the evaluation to the folder; return the file."""
    from ...models.storage import make_folder, write_bytes

    target = make_folder(folder) / f"{found.instance.name}.evaluation.json"
    write_bytes(target, (json.dumps(found.document(), indent=1, allow_nan=False) + "\n").encode())
    return target


def _show(found: Evaluation, target: Path | None) -> None:
    """Print the angles, one row per hidden curve, with mean, median and standard error below."""
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
        print_line("the input has no curves: chains of stroke pixels are hidden instead")
    print_line("degrees between a hidden curve and the nearer line of the field; 22.5 at random")
    for curve in found.curves:
        for name, reason in curve.failures.items():
            print_notice(f"curve {curve.curve}, {name}: {reason}")
    if target is not None:
        print_line(f"report: {target}")


def _degrees(angle: float | None) -> str:
    return "-" if angle is None else f"{angle:.1f}"
