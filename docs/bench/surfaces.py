"""Errors of surfaces by their fields, for docs/surface.md: `python docs/bench surfaces [FOLDER]`.

FOLDER has drawings NAME.clean.svg and NAME.rough_axes.svg, and truth.json with places and unit normals.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import mean
from typing import Final

import crossfield as cf
import numpy as np
from crossfield.models.field.field import CrossField
from crossfield.models.instance.domain import Floats, Ints
from crossfield.models.instance.instance import Instance
from crossfield.models.sketch.samples import SAMPLES
from crossfield.models.smooth.bend import surface_field
from make import markdown, replace_between, write_rows
from surface_pictures import mean_angle

SIZES: Final = (24, 48, 96)
FIELDS: Final[dict[str, Callable[[Instance], CrossField]]] = {
    "bend": surface_field,
    "greedy": cf.greedy_field,
    "search": lambda instance: cf.search(instance, rounds=1, jobs=1).field,
}
SHARED: Final = Path(__file__).resolve().parents[3] / "shared" / "known_surfaces"


def known(folder: Path, size: int) -> Iterator[tuple[str, str, Instance, Ints, Floats]]:
    """Kind, name, instance, and the true normals at some of its pixels."""
    for name in (name for name, entry in SAMPLES.items() if entry.kind == "analytic"):
        true = cf.analytic(name, size)
        yield "computed", name, true.instance, np.arange(len(true.normals)), true.normals
    for name, truth in json.loads((folder / "truth.json").read_text()).items():
        samples = np.array(truth["normals"])
        for kind in ("clean", "rough_axes"):
            instance = cf.read_sketch(folder / f"{name}.{kind}.svg", size=size)
            column, row = ((samples[:, :2] - instance.origin) / instance.pixel_size).astype(int).T
            height, width = instance.mask.shape
            pixel = instance.grid.number[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
            yield kind.partition("_")[0], name, instance, pixel[pixel >= 0], samples[pixel >= 0, 2:]


def main(page: Path, arguments: Sequence[str]) -> None:
    """Compute all surfaces, and replace the table and its CSV file."""
    folder, rows = Path(*arguments) if arguments else SHARED, []
    for size in SIZES:
        for kind, name, instance, pixel, normals in known(folder, size):
            for method, find in FIELDS.items():
                found = cf.surface(find(instance)).normals[pixel]
                sides = [mean_angle(found * side, normals) for side in ([1, 1, 1], [-1, -1, 1])]
                row = {"kind": kind, "drawing": name, "size": str(size), "field": method}
                row |= {"mean error": f"{min(sides):.2f}", "inside out": str(int(sides[1] < sides[0]))}
                rows.append(row)
                print(*row.values(), flush=True)
    write_rows("surface/fields.csv", rows)
    replace_between(page.with_name("surface.md"), "fields", summary(rows))


def summary(rows: list[dict[str, str]]) -> str:
    """The table of mean errors, and on how many drawings the first field is better than the last."""
    errors: dict[tuple[str, ...], dict[str, float]] = defaultdict(dict)
    for row in rows:
        errors[row["kind"], row["field"], row["size"]][row["drawing"]] = float(row["mean error"])
    sizes = list(dict.fromkeys(size for _, _, size in errors))
    lines = [
        [kind, f"`{method}`", *(f"{mean(errors[kind, method, size].values()):.1f}" for size in sizes)]
        for kind, method in dict.fromkeys(key[:2] for key in errors)
    ]
    first, *_, last = FIELDS
    smaller = [
        f"{', '.join(str(sum(error < other[name] for name, error in of.items())) for of, other in pairs)} of "
        f"{len(pairs[0][0])} {kind}"
        for kind in ("clean", "rough")
        for pairs in [[(errors[kind, first, size], errors[kind, last, size]) for size in sizes]]
    ]
    table = markdown(("surfaces", "field", *(f"{size} pixels" for size in sizes)), lines)
    return (
        f"{table}\n\n`{first}` has a smaller error than `{last}` on {' and '.join(smaller)} drawings at "
        f"{', '.join(sizes)} pixels."
    )
