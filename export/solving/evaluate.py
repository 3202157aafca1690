"""Evaluation of methods on data that they do not see: each curve of a drawing is hidden in turn."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from ...models.arguments import checked_arguments
from ...models.errors import CrossfieldError, InputError
from ...models.evaluation.hidden import SHORTEST, HiddenCurve, Summary, hidden_curves, summary
from ...models.instance.instance import Instance
from ...models.processes.deadline import Over, Progress, Stop, silent, stop_function
from ...models.processes.groups import interruptible
from ...models.processes.limits import Limits
from ...models.sketch.choice import Choice
from ...models.sketch.tracing import curves_of, has_curves
from ..formats.registry import generator
from .methods import METHODS, Request, instance_facts

DEFAULT_METHODS: Final = ("greedy", "search")
CURVES: Final = 8
"""Number of curves of a drawing that are hidden, the longest ones."""
SECONDS: Final = 5.0
"""Time limit of one field: there are as many fields as curves times methods."""


@dataclass(frozen=True)
class CurveDeviation:
    """Deviations of the methods from a hidden curve.

    curve: its number; pixels: its stroke pixels; degrees: by method, the mean angle in [0, 90] degrees
    between the curve and the nearer line of the field; failures: by method, the reason why there is no field.
    """

    curve: int
    pixels: int
    degrees: dict[str, float]
    failures: dict[str, str]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Mean angles between hidden curves of an instance and the fields of methods, the longest curve first.

    Parameters
    ----------
    instance
        The instance.
    methods
        Names of the methods.
    limits
        Limits of each field.
    curves
        Angles in degrees by method for each hidden curve.
    drawn
        Whether the curves come from the sketch; otherwise they are chains of stroke pixels.
    interrupted
        Whether the evaluation was interrupted; it then has the curves that were done before.

    """

    instance: Instance
    methods: tuple[str, ...]
    limits: Limits
    curves: tuple[CurveDeviation, ...]
    drawn: bool = False
    interrupted: bool = False

    def summary(self, method: str) -> Summary | None:
        """Mean, median and standard error in degrees over the curves; None if the method always failed."""
        return summary(np.array([each.degrees[method] for each in self.curves if method in each.degrees]))

    def document(self) -> dict[str, Any]:
        """The evaluation as JSON. It depends on the clock only through the methods' use of their time."""
        return {
            "format": "crossfield-evaluation",
            "version": 1,
            "generator": generator(),
            "instance": instance_facts(self.instance),
            "seconds_per_field": self.limits.time_limit,
            "curves_of": "sketch" if self.drawn else "chains",
            "methods": {method: _facts(self.summary(method)) for method in self.methods},
            "curves": [asdict(each) for each in self.curves],
            "interrupted": self.interrupted,
        }


@checked_arguments
def evaluate(
    instance: Instance,
    *,
    sketch: str | Path | None = None,
    methods: Iterable[str] = DEFAULT_METHODS,
    curves: int = CURVES,
    limits: Limits | None = None,
    progress: Progress = silent,
    stop: Stop | None = None,
    curvature: Iterable[str] = (),
    view: str | None = None,
) -> Evaluation:
    """Measure how far the fields of methods are from curves that the methods do not see.

    Each of the `curves` longest curves is hidden in turn. Its stroke pixels are removed, as far as no other
    curve runs through them; the mask and the other strokes stay. The measure is the mean angle between the
    curve and the nearer line of the crosses on it; random crosses have 22.5 degrees. Ctrl-C ends it with the
    curves done so far; before there is one, it raises KeyboardInterrupt.

    Parameters
    ----------
    instance
        The instance.
    sketch
        The file from which the instance was read, or the name of its sample: it defines the curves. None:
        chains of stroke pixels count as curves (`curves_of`).
    methods
        Names in the table of methods.
    curves
        Number of curves to hide.
    limits
        Limits of each field; 5 seconds by default.
    progress
        Receives lines of text.
    stop
        A function that returns whether to stop, or an event, as Ctrl-C does.
    curvature, view
        The options with which the sketch was read.

    Returns
    -------
    Evaluation
        The angles, by curve and method.

    Raises
    ------
    InputError
        For unknown methods, and when no curve can be hidden.

    """
    methods, limits = tuple(dict.fromkeys(methods)), Limits.bounded(limits or Limits(SECONDS))
    for name in methods:
        if name not in METHODS:
            raise InputError(f"there is no method {name!r}; choose one of {', '.join(METHODS)}")
    choice = Choice(curvature=tuple(curvature), view=view)
    hidden = hidden_curves(instance, curves_of(instance, sketch, choice), curves)
    if not hidden:
        raise InputError(
            f"{instance.name} has no curve of {SHORTEST} pixels or more besides others that could be hidden; "
            "choose a larger size, or a drawing of more curves"
        )
    done, interrupted = _in_turn(hidden, methods, limits, progress, stop_function(stop))
    return Evaluation(instance, methods, limits, tuple(done), has_curves(sketch, choice), interrupted)


def _in_turn(
    hidden: list[HiddenCurve], methods: tuple[str, ...], limits: Limits, progress: Progress, stop: Over
) -> tuple[list[CurveDeviation], bool]:
    """Deviations of the methods for each curve in turn, and whether Ctrl-C or the caller ended them."""
    done: list[CurveDeviation] = []
    try:
        with interruptible() as pressed, TemporaryDirectory(prefix="crossfield-") as folder:

            def over() -> bool:
                return pressed() or stop()

            for number, curve in enumerate(hidden, start=1):

                def report(line: str, at: int = number) -> None:
                    progress(f"curve {at} of {len(hidden)}: {line}")

                request = Request(curve.rest, Path(folder), limits, progress=report, stop=over)
                done.append(_measured(curve, methods, request))
    except KeyboardInterrupt:
        if not done and not stop():
            raise
        return done, True
    return done, False


def _measured(curve: HiddenCurve, methods: tuple[str, ...], request: Request) -> CurveDeviation:
    """The methods' angles to a curve. Raises KeyboardInterrupt after Ctrl-C: half a curve has no use."""
    found = CurveDeviation(curve.number, len(curve.stroke), {}, {})
    for method in methods:
        try:
            *_, answer = METHODS[method].find(request)
            found.degrees[method] = float(np.degrees(curve.deviation(answer.field)))
            stopped = answer.interrupted
        except CrossfieldError as error:
            found.failures[method], stopped = str(error), False
        if stopped or request.stop():
            raise KeyboardInterrupt
    return found


def _facts(found: Summary | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "curves": found.count,
        "mean": found.mean,
        "median": found.median,
        "standard_error": found.error,
    }
