"""Measure fields on drawings and on known surfaces; the rows go to docs/studying/data/fields.csv.

    python docs/fields.py MEASURE ... [--sketches FOLDER] [--seconds S] [--jobs N] [--methods METHOD ...]

MEASURE is one of

    hidden    angle in degrees between a hidden curve and the nearer line of the crosses on it
    missed    share of the stroke pixels that a field misses by more than 10 degrees
    surface   mean cross error in degrees on a surface with a known answer, also with noise on the strokes

each for every method under the default weights and for greedy fields under other weights of the strokes.
FOLDER has line drawings by others; the samples are measured without it. `python docs/study.py --page` then
writes docs/evidence.md.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import crossfield as cf
import numpy as np
from crossfield.export.runs.methods import METHODS, Request
from crossfield.models.errors import CrossfieldError
from crossfield.models.field.field import CrossField
from crossfield.models.instance.instance import STROKE_WEIGHT, Instance
from studying.fields import MOST_CURVES
from studying.instances import curves, drawing, drawings, noisy_instance, surfaces
from studying.rows import DATA

KEPT: Final = DATA / "fields.csv"
COLUMNS: Final = ("measure", "name", "size", "noise", "weight", "method", "curve", "value")
SIZES: Final = (24, 32, 48)
SURFACE_SIZES: Final = (24, 48)
WEIGHTS: Final = (1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0)
NOISE: Final = (0.0, 3.0, 8.0)
"""Standard deviation in degrees of an independent error of each stroke pixel."""
SEEDS: Final = 3
MISSED: Final = 10.0
"""Degrees from which a stroke pixel counts as missed."""
FOR_ENERGY: Final = {"prove", "two-stage"}
"""Methods whose only aim is a lower energy, measured at one size."""
MIDDLE: Final = 32
Found = Iterator[tuple[float, str, str, float]]
"""Weight, method, number of the curve, value."""


@dataclass(frozen=True)
class Task:
    """A drawing or a surface at a size. folder: of drawings by others. seconds: of methods that search."""

    measure: str
    name: str
    size: int
    noise: float
    folder: Path | None
    seconds: float
    methods: tuple[str, ...]

    def tried(self, weight: float) -> list[str]:
        """The methods under a weight of the strokes: all under the default, else the greedy one."""
        usual = METHODS if weight == STROKE_WEIGHT else ["greedy"]
        return [name for name in usual if not self.methods or name in self.methods]

    def rows(self) -> list[list[str]]:
        """The rows of the task."""
        facts = (self.measure, self.name, self.size, f"{self.noise:g}")
        values = MEASURES[self.measure](self)
        return [[*map(str, facts), f"{w:g}", name, curve, f"{v:.6g}"] for w, name, curve, v in values]


def hidden(task: Task) -> Found:
    """Angles to the hidden curves of a drawing; none if no curve can be hidden."""
    limits = cf.Limits(task.seconds, threads=1)
    for weight in WEIGHTS:
        names = [name for name in task.tried(weight) if name not in FOR_ENERGY or task.size == MIDDLE]
        longest = curves(task.name, task.size, MOST_CURVES, task.folder) if names else []
        for number, curve in enumerate(longest):
            rest = curve.rest.with_weights(stroke_weight=weight)
            for name in names:
                with suppress(CrossfieldError):  # the method has no field without this curve
                    field = answer(name, rest, limits)
                    yield weight, name, str(number), float(np.degrees(curve.deviation(field)))


def answer(method: str, instance: Instance, limits: cf.Limits) -> CrossField:
    """The last field of a method."""
    with tempfile.TemporaryDirectory() as folder:
        *_, last = METHODS[method].find(Request(instance, Path(folder), limits))
    return last.field


def fields(task: Task, instance: Instance) -> Iterator[tuple[float, str, CrossField]]:
    """Fields of the methods without a time limit, with weight and method."""
    for weight in WEIGHTS:
        weighted = instance.with_weights(stroke_weight=weight)
        for name in task.tried(weight):
            if not METHODS[name].timed:
                yield weight, name, answer(name, weighted, cf.Limits(600.0, threads=1))


def missed(task: Task) -> Found:
    """The share of the stroke pixels of a drawing that fields miss."""
    for weight, name, field in fields(task, drawing(task.name, task.size, task.folder)):
        yield weight, name, "", float((np.degrees(field.stroke_deviation) > MISSED).mean())


def surface(task: Task) -> Found:
    """Mean cross errors on a surface, each the mean over the draws of the noise."""
    truth = cf.analytic(task.name, task.size)
    errors: dict[tuple[float, str], list[float]] = {}
    for seed in range(SEEDS if task.noise else 1):
        for weight, name, field in fields(task, noisy_instance(truth.instance, task.noise, seed)):
            error = np.degrees(field.cross_error(truth.u_angle, truth.v_angle)).mean()
            errors.setdefault((weight, name), []).append(float(error))
    yield from ((weight, name, "", float(np.mean(draws))) for (weight, name), draws in errors.items())


MEASURES: Final[dict[str, Callable[[Task], Found]]] = {
    "hidden": hidden,
    "missed": missed,
    "surface": surface,
}


def tasks(measure: str, folder: Path | None, seconds: float, methods: tuple[str, ...]) -> list[Task]:
    """The tasks of a measure, in order."""
    if measure == "surface":
        cases = [(name, size, noise) for size in SURFACE_SIZES for noise in NOISE for name in surfaces()]
    else:
        cases = [(name, size, 0.0) for size in SIZES for name in drawings(folder)]
    return [Task(measure, *case, folder, seconds, methods) for case in cases]


def main() -> None:
    """Measure, and replace the rows of the same cases."""
    parser = argparse.ArgumentParser(description="Measure fields on drawings and on known surfaces.")
    parser.add_argument("measures", nargs="+", choices=MEASURES, metavar="MEASURE")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=[], help="only these methods")
    parser.add_argument("--sketches", type=Path, help="folder of line drawings by others")
    parser.add_argument("--seconds", type=float, default=5.0, help="limit of methods that search")
    parser.add_argument("--jobs", type=int, default=2, help="processes at once")
    options = parser.parse_args()
    with KEPT.open(newline="") as file:
        _, *lines = csv.reader(file)
    rows = {tuple(line[:-1]): line for line in lines}
    for measure in options.measures:
        with ProcessPoolExecutor(options.jobs) as processes:
            chosen = tasks(measure, options.sketches, options.seconds, tuple(options.methods))
            for lines_of_task in processes.map(Task.rows, chosen):
                rows |= {tuple(line[:-1]): line for line in lines_of_task}
        with KEPT.open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows.values()])


if __name__ == "__main__":
    main()
