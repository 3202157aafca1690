"""Make docs/fields.md and docs/weights.md, the quality of fields, from docs/fields.json.

    python docs/fields.py [--measure PART ...] [--sketches FOLDER] [--seconds S] [--jobs N]

With --measure, parts are measured first, and their rows in docs/fields.json replaced: `methods` (hidden
curves, each method), `weights` (hidden curves, each weight of the strokes), `strokes` (deviation of fields
from the strokes that they were shown) and `surfaces` (fields of surfaces with a known answer, with and
without noise on the strokes), each weight, `shown` and `known` (both of these, each method). FOLDER has line
drawings by others; the samples are there without it.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import crossfield as cf
import numpy as np
from crossfield.export.solving.methods import METHODS, Request
from crossfield.models.errors import InputError
from crossfield.models.evaluation.hidden import summary
from crossfield.models.field.field import CrossField
from crossfield.models.instance.instance import STROKE_WEIGHT, Instance
from crossfield.models.sketch.samples import SAMPLES
from energies import SKETCHES
from fields_text import FIELDS, WEIGHTS
from make import generated, markdown

DOCS: Final = Path(__file__).resolve().parent
KEPT: Final = DOCS / "fields.json"
SIZES: Final = (24, 32, 48)
TRIED: Final = (1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0)
"""Weights of the strokes, on every grid."""
NOISE: Final = (0.0, 3.0, 8.0)
"""Standard deviation of the noise on each stroke pixel, in degrees."""
SEEDS: Final = 3
OFF: Final = 10.0
"""Degrees from which a stroke pixel counts as missing its stroke."""
MIDDLE: Final = 32
OF_ENERGIES: Final = {"prove", "two-stage"}
"""Methods whose only aim is a lower energy."""
Rows = list[dict[str, Any]]


@dataclass(frozen=True)
class Task:
    """A drawing or a surface at a size, and the seconds of a field that is searched."""

    name: str
    what: str
    size: int
    seconds: float
    noise: float = 0.0
    only: tuple[str, ...] = ()

    @property
    def instance(self) -> Instance:
        """Its instance, under the default weights."""
        if self.what in SAMPLES:
            return cf.sample(self.what, self.size)
        return cf.read_sketch(self.what, size=self.size)


def angles(task: Task, instance: Instance, tried: Iterable[str]) -> Rows:
    """A row for each method with its angles in degrees to the hidden curves; none without hidden curves."""
    limits = cf.Limits(task.seconds, threads=1)
    try:
        found = cf.evaluate(instance, sketch=task.what, methods=tried, limits=limits)
    except InputError:
        return []
    return [
        {
            "drawing": task.name,
            "size": task.size,
            "method": method,
            "degrees": [round(each.degrees[method], 3) for each in found.curves if method in each.degrees],
        }
        for method in found.methods
    ]


def methods(task: Task) -> Rows:
    """Hidden curves of a drawing, by method; methods for low energy at one size only."""
    tried = (n for n in task.only or METHODS if n not in OF_ENERGIES or task.size == MIDDLE)
    return angles(task, task.instance, tried)


def weights(task: Task) -> Rows:
    """Hidden curves of a drawing in greedy fields, by weight of the strokes."""
    found = [(w, angles(task, task.instance.with_weights(stroke_weight=w), ["greedy"])) for w in TRIED]
    return [row | {"weight": w} for w, rows in found for row in rows]


def strokes(task: Task) -> Rows:
    """The share of the stroke pixels of a drawing that greedy fields miss by more than OFF, by weight."""
    fields = [cf.greedy_field(task.instance.with_weights(stroke_weight=w)) for w in TRIED]
    return [
        {"drawing": task.name, "size": task.size, "weight": w, "off": round(missing(field), 5)}
        for w, field in zip(TRIED, fields, strict=True)
    ]


def surfaces(task: Task) -> Rows:
    """Mean cross error of fields of a surface, by weight of the strokes; noise on each stroke pixel."""
    truth = cf.analytic(task.name, task.size)
    rows: Rows = []
    for w in TRIED:
        errors = []
        for seed in range(SEEDS if task.noise else 1):
            field = cf.greedy_field(noisy(truth.instance, task.noise, seed).with_weights(stroke_weight=w))
            errors.append(np.degrees(field.cross_error(truth.u_angle, truth.v_angle)).mean())
        facts = {"surface": task.name, "size": task.size, "noise": task.noise, "weight": w}
        rows.append(facts | {"error": round(float(np.mean(errors)), 3)})
    return rows


def answers(instance: Instance) -> Iterator[tuple[str, CrossField]]:
    """The fields of the methods that need no time limit, by name."""
    with tempfile.TemporaryDirectory() as folder:
        request = Request(instance, Path(folder), cf.Limits(600.0, threads=1))
        for name, method in METHODS.items():
            if not method.timed:
                *_, answer = method.find(request)
                yield name, answer.field


def shown(task: Task) -> Rows:
    """The share of the stroke pixels of a drawing that methods miss by more than OFF, default weights."""
    return [
        {"drawing": task.name, "size": task.size, "method": name, "off": round(missing(field), 5)}
        for name, field in answers(task.instance)
    ]


def missing(field: CrossField) -> float:
    """The share of the stroke pixels that a field misses by more than OFF."""
    return float((np.degrees(field.stroke_deviation) > OFF).mean())


def known(task: Task) -> Rows:
    """Mean cross errors of methods on a surface, default weights; noise on each stroke pixel."""
    truth = cf.analytic(task.name, task.size)
    errors: dict[str, list[float]] = {}
    for seed in range(SEEDS if task.noise else 1):
        for name, field in answers(noisy(truth.instance, task.noise, seed)):
            error = np.degrees(field.cross_error(truth.u_angle, truth.v_angle)).mean()
            errors.setdefault(name, []).append(float(error))
    facts = {"surface": task.name, "size": task.size, "noise": task.noise}
    return [
        facts | {"method": name, "error": round(float(np.mean(found)), 3)} for name, found in errors.items()
    ]


def noisy(instance: Instance, degrees: float, seed: int) -> Instance:
    """The instance with an independent error of that standard deviation on each stroke pixel."""
    noise = np.random.default_rng(seed).standard_normal(len(instance.theta))
    return replace(instance, theta=instance.theta + np.radians(degrees) * noise)


MEASURES: Final[dict[str, Callable[[Task], Rows]]] = {
    "methods": methods, "shown": shown, "known": known, "weights": weights, "strokes": strokes,
    "surfaces": surfaces,
}  # fmt: skip


def tasks(part: str, folder: Path | None, seconds: float) -> list[Task]:
    """The tasks that measure a part, in order."""
    if part in {"surfaces", "known"}:
        names = [name for name, entry in SAMPLES.items() if entry.kind == "analytic"]
        return [
            Task(name, name, size, seconds, noise) for size in (24, 48) for noise in NOISE for name in names
        ]
    own = [(name, name) for name, entry in SAMPLES.items() if entry.kind == "sketch"]
    files = (path for path in sorted(folder.iterdir()) if path.suffix in SKETCHES) if folder else ()
    others = [(path.name, str(path)) for path in files if not path.stem.endswith("_mask")]
    return [Task(name, what, size, seconds) for size in SIZES for name, what in [*own, *others]]


def measured(part: str, folder: Path | None, seconds: float, jobs: int, only: Iterable[str] = ()) -> Rows:
    """The rows of a part; of `methods` only the named methods, if any."""
    given = [replace(task, only=tuple(only)) for task in tasks(part, folder, seconds)]
    with ProcessPoolExecutor(jobs) as processes:
        return [row for rows in processes.map(MEASURES[part], given) for row in rows]


def renewed(rows: Rows, found: Rows) -> Rows:
    """The rows with remeasured ones in their places. Raises KeyError for a missing place."""
    places = {(row["drawing"], row["size"], row["method"]): k for k, row in enumerate(rows)}
    anew = dict(enumerate(rows)) | {places[row["drawing"], row["size"], row["method"]]: row for row in found}
    return list(anew.values())


# The pages


def mean_and_median(rows: Rows) -> str:
    """Mean and median over all curves of the rows; then the mean over drawings with its standard error."""
    curves = summary(np.array([angle for row in rows for angle in row["degrees"]]))
    drawings = summary(np.array([np.mean(row["degrees"]) for row in rows if row["degrees"]]))
    if curves is None or drawings is None:
        return "-"
    between = "" if drawings.error is None else f" ({drawings.mean:.1f} +- {drawings.error:.1f})"
    return f"{curves.mean:.2f} / {curves.median:.2f}{between}"


def picked(rows: Rows, **facts: Any) -> Rows:
    """The rows with these facts."""
    return [row for row in rows if all(row[name] == value for name, value in facts.items())]


def by_method(rows: Rows) -> str:
    """Hidden curves: a row for each method, a column for each size."""
    names = dict.fromkeys(row["method"] for row in rows)
    table = [
        [f"`{name}`", *(mean_and_median(picked(rows, method=name, size=size)) for size in SIZES)]
        for name in names
    ]
    return markdown(("method", *(f"{size} pixels" for size in SIZES)), table)


def by_drawing(rows: Rows, size: int) -> str:
    """Hidden curves: a row for each drawing at a size, a column for each method."""
    names = list(dict.fromkeys(row["method"] for row in rows))
    table = []
    for drawing in dict.fromkeys(row["drawing"] for row in rows):
        found = [picked(rows, drawing=drawing, size=size, method=name) for name in names]
        if any(each and each[0]["degrees"] for each in found):
            count = str(max(len(each[0]["degrees"]) for each in found if each))
            cells = [
                f"{np.mean(each[0]['degrees']):.1f}" if each and each[0]["degrees"] else "-" for each in found
            ]
            table.append([drawing, count, *cells])
    return markdown(("drawing", "curves", *(f"`{name}`" for name in names)), table)


def by_weight(rows: Rows) -> str:
    """Hidden curves: a row for each weight, a column for each size."""
    table = [
        [f"{w:g}", *(mean_and_median(picked(rows, weight=w, size=size)) for size in SIZES)] for w in TRIED
    ]
    return markdown(("weight", *(f"{size} pixels" for size in SIZES)), table)


def missed(rows: Rows, by: str) -> str:
    """Share of missed stroke pixels, by a fact and size: mean over drawings and the worst one."""
    table = []
    for value in dict.fromkeys(row[by] for row in rows):
        shares = [[row["off"] for row in picked(rows, **{by: value}, size=size)] for size in SIZES]
        cells = [f"{np.mean(share):.1%} / {max(share):.1%}" for share in shares]
        table.append([f"{value:g}" if by == "weight" else f"`{value}`", *cells])
    return markdown((by, *(f"{size} pixels" for size in SIZES)), table)


def by_surface(rows: Rows, by: str) -> str:
    """Mean cross errors: a row for each surface, size and noise, a column for each value of a fact."""
    cases = dict.fromkeys((row["surface"], row["size"], row["noise"]) for row in rows)
    table = [
        [
            surface, str(size), f"{noise:g}",
            *(f"{row['error']:.2f}" for row in picked(rows, surface=surface, size=size, noise=noise)),
        ]
        for surface, size, noise in cases
    ]  # fmt: skip
    values = dict.fromkeys(row[by] for row in rows)
    heads = (f"{value:g}" if by == "weight" else f"`{value}`" for value in values)
    return markdown(("surface", "size", "noise", *heads), table)


def in_short(rows: Rows) -> str:
    """Numbers of curves and drawings, and the method with the smallest error at each size."""
    names = dict.fromkeys(row["method"] for row in rows)
    found = []
    for size in SIZES:
        of = {name: picked(rows, method=name, size=size) for name in names}
        means = {
            name: np.mean([angle for row in each for angle in row["degrees"]])
            for name, each in of.items()
            if any(row["degrees"] for row in each)
        }
        best = min(means, key=lambda name: means[name])
        curves = max(sum(len(row["degrees"]) for row in each) for each in of.values())
        drawings = max(sum(bool(row["degrees"]) for row in each) for each in of.values())
        found.append(
            f"{size} pixels, {curves} curves of {drawings} drawings: `{best}`, {means[best]:.1f} degrees"
        )
    return "Nearest to hidden curves on average: at " + "; at ".join(found) + "."


def write_pages(kept: dict[str, Any]) -> None:
    """Write both pages."""
    command = generated("python docs/fields.py")
    rows = kept["rows"]
    page = FIELDS.format(
        said=command, short=in_short(rows["methods"]), methods=by_method(rows["methods"]),
        drawings=by_drawing(rows["methods"], MIDDLE), seconds=kept["seconds"], off=f"{OFF:g}", seeds=SEEDS,
        shown=missed(rows["shown"], "method"), known=by_surface(rows["known"], "method"),
    )  # fmt: skip
    (DOCS / "fields.md").write_text(page)
    page = WEIGHTS.format(
        said=command, default=f"{STROKE_WEIGHT:g}", hidden=by_weight(rows["weights"]),
        missed=missed(rows["strokes"], "weight"), surfaces=by_surface(rows["surfaces"], "weight"),
        off=f"{OFF:g}", seeds=SEEDS,
    )  # fmt: skip
    (DOCS / "weights.md").write_text(page)


def main() -> None:
    """Measure the requested parts, and write the pages."""
    parser = argparse.ArgumentParser(
        description="Measure fields, and write docs/fields.md and docs/weights.md."
    )
    parser.add_argument(
        "--measure", nargs="+", choices=MEASURES, default=[], help="parts to be measured anew"
    )
    parser.add_argument(
        "--methods", nargs="+", choices=METHODS, default=[], help="of the part `methods` only these, anew"
    )
    parser.add_argument("--sketches", type=Path, help="folder of line drawings by others")
    parser.add_argument("--seconds", type=float, default=5.0, help="for each field that is searched")
    parser.add_argument("--jobs", type=int, default=2, help="processes at once")
    given = parser.parse_args()
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {"seconds": given.seconds, "rows": {}}
    for part in given.measure:
        only = given.methods if part == "methods" else ()
        found = measured(part, given.sketches, given.seconds, given.jobs, only)
        kept["rows"][part] = renewed(kept["rows"][part], found) if only else found
        if part == "methods" and not only:
            kept["seconds"] = given.seconds
        KEPT.write_text(json.dumps(kept, indent=0, sort_keys=True) + "\n")
    write_pages(kept)


if __name__ == "__main__":
    main()
