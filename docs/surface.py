"""Write summary, plot and tables of docs/surface.md, errors of surfaces against known ones.

    python docs/surface.py [--measure PART ...] [--sketches FOLDER] [--jobs N]

They come from docs/surface.json. With --measure, parts are measured first, and their rows there replaced:
`known` (surfaces with a known answer, from exact crosses and from the field of each method), `noise` (bend
fields of noisy strokes), `sides` (surfaces that bend both ways), `trust` (doubts about samples and drawings)
and `times`. FOLDER has line drawings by others.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import crossfield as cf
import numpy as np
from crossfield.export.runs.methods import METHODS, Request
from crossfield.models.field.field import CrossField
from crossfield.models.instance.instance import Instance
from crossfield.models.sketch.samples import SAMPLES
from crossfield.models.sketch.surfaces import CurvaturePatch, analytic_instance, rotation_by
from crossfield.models.surface.trust import OFF, right_angle_deviation
from drawings import SUFFIXES, subject_of
from make import csv_text, replace_between
from studying.plots import open_panels, styles

DOCS: Final = Path(__file__).resolve().parent
KEPT: Final = DOCS / "surface.json"
SIZES: Final = (32, 48)
WAYS: Final = ("bend", "greedy", "polyvector", "power")
NOISE: Final = (3.0, 8.0)
"""Standard deviation of the noise on each stroke pixel, in degrees."""
SEEDS: Final = 3
SURFACES: Final = [name for name, entry in SAMPLES.items() if entry.kind == "analytic"]
TIMED: Final = (("tilted_cylinder", 54), ("spheroid", 50), ("mouse", 56), ("tilted_cylinder", 180))
VIEWS: Final = [(tilt, side) for tilt in (-30, -20, -10, 10, 20, 30) for side in (1, -1)]
"""Tilts away from the viewer in degrees, and sides that are seen, of surfaces that bend both ways."""
Rows = list[dict[str, Any]]


def field_by(method: str, instance: Instance) -> CrossField:
    """The answer of a method."""
    with tempfile.TemporaryDirectory() as folder:
        request = Request(instance, Path(folder), cf.Limits(600.0, threads=1))
        first, *_ = METHODS[method].find(request)
    return first.field


def angles(first: Any, second: Any) -> Any:
    """Angles in degrees between unit normals, (n,)."""
    return np.degrees(np.arccos(np.clip((first * second).sum(axis=1), -1, 1)))


def normal_error(surface: cf.Surface, normals: Any) -> Any:
    """Angles to the true normals in degrees, on the side nearer to the truth."""
    both = [angles(side.normals, normals) for side in (surface, surface.flipped())]
    return min(both, key=np.mean)


def middle_hint(true: Any) -> cf.Hint:
    """The true normal at the pixel nearest to the middle of the mask."""
    pixels = np.argwhere(true.instance.mask)
    at = int(np.argmin(((pixels - pixels.mean(axis=0)) ** 2).sum(axis=1)))
    x, y, z = true.normals[at]
    row, column = (int(place) for place in pixels[at])
    return cf.Hint(row, column, float(np.arccos(z)), float(np.arctan2(y, x)))


def known(name: str, size: int) -> Rows:
    """Errors of the normals of a surface from exact crosses and from each method, and with a hint."""
    true = cf.analytic(name, size)
    exact = cf.CrossField.from_lines(true.instance, true.u_angle, true.v_angle)
    fields = {"exact": exact} | {method: field_by(method, true.instance) for method in WAYS}
    flat = angles(true.normals, np.array([0.0, 0.0, 1.0]))
    rows = []
    for way, field in fields.items():
        estimate, hinted = cf.surface(field), cf.surface(field, [middle_hint(true)])
        error, hinted_error = normal_error(estimate, true.normals), angles(hinted.normals, true.normals)
        numbers = {
            "flat": flat.mean(), "cross": np.degrees(field.cross_error(true.u_angle, true.v_angle)).mean(),
            "mean": error.mean(), "most": np.percentile(error, 95), "hinted": hinted_error.mean(),
            "side": float(angles(estimate.normals, true.normals).mean() <= error.mean() + 1e-9),
            "alike": rank_correlation(1 - estimate.confidence, error),
        }  # fmt: skip
        facts = {"surface": name, "size": size, "way": way, "doubts": len(estimate.doubts)}
        rows.append(facts | {key: round(float(value), 4) for key, value in numbers.items()})
    return rows


def rank_correlation(first: Any, second: Any) -> float:
    """Spearman's coefficient."""
    from scipy.stats import spearmanr

    return float(spearmanr(first, second).statistic)


def noise(name: str, size: int) -> Rows:
    """Mean errors of the normals from bend fields of noisy strokes, over seeds."""
    true = cf.analytic(name, size)
    rows = []
    for degrees in NOISE:
        errors = []
        for seed in range(SEEDS):
            shake = np.radians(degrees) * np.random.default_rng(seed).standard_normal(
                len(true.instance.theta)
            )
            field = field_by("bend", replace(true.instance, theta=true.instance.theta + shake))
            errors.append(normal_error(cf.surface(field), true.normals).mean())
        rows.append(
            {"surface": name, "size": size, "noise": degrees, "mean": round(float(np.mean(errors)), 3)}
        )
    return rows


def catenoid(s: Any, t: Any) -> Any:
    """Points of a catenoid, by its curvature lines."""
    return np.stack(np.broadcast_arrays(np.cosh(t) * np.cos(s), t, np.cosh(t) * np.sin(s)), axis=-1)


def saddle_sheet(s: Any, t: Any) -> Any:
    """Points of Enneper's surface, by its curvature lines."""
    return np.stack([s - s**3 / 3 + s * t**2, -t + t**3 / 3 - t * s**2, s**2 - t**2], axis=-1)


PATCHES: Final[dict[str, tuple[Callable[[Any, Any], Any], Any, Any]]] = {
    "catenoid": (catenoid, (0.9, np.pi - 0.9), (-0.6, 0.6)),
    "saddle sheet": (saddle_sheet, (-0.3, 0.3), (-0.3, 0.3)),
}
"""Surfaces that bend both ways, whose sides neither border nor crosses tell apart."""


def sides(name: str, size: int) -> Rows:
    """Errors of the normals of a surface that bends both ways, in each view, from exact crosses."""
    position, s_range, t_range = PATCHES[name]
    step = 1e-6
    rows = []
    for tilt, side in VIEWS:
        rotation = rotation_by(tilt, 15) @ np.diag([1, 1, side])
        patch = CurvaturePatch(
            position,
            lambda s, t: (position(s + step, t) - position(s - step, t)) / (2 * step),
            lambda s, t: (position(s, t + step) - position(s, t - step)) / (2 * step),
            s_range, t_range, rotation, share=0.2,
        )  # fmt: skip
        true = analytic_instance(patch, "patch", size)
        estimate = cf.surface(cf.CrossField.from_lines(true.instance, true.u_angle, true.v_angle))
        error = normal_error(estimate, true.normals).mean()
        right = angles(estimate.normals, true.normals).mean() <= error + 1e-9
        facts = {"surface": name, "size": size, "tilt": tilt, "seen": side, "side": float(right)}
        rows.append(facts | {"mean": round(float(error), 4)})
    return rows


def trust(name: str, drawing: str, size: int) -> Rows:
    """Doubts about the surface over the bend field of a sample or drawing."""
    instance = cf.sample(drawing, size) if drawing in SAMPLES else cf.read_sketch(drawing, size=size)
    field = field_by("bend", instance)
    estimate = cf.surface(field)
    off = right_angle_deviation(field, estimate.heights)
    numbers = {
        "unfit": np.mean(off > OFF), "slant": np.degrees(np.arccos(estimate.normals[:, 2])).mean(),
        "confidence": estimate.confidence.mean(),
    }  # fmt: skip
    facts = {
        "drawing": name,
        "size": size,
        "spots": len(field.singularities.index),
        "doubts": estimate.doubts,
    }
    return [facts | {key: round(float(value), 4) for key, value in numbers.items()}]


def times(name: str, size: int) -> Rows:
    """Processor seconds for the surface over the bend field of a sample."""
    field = field_by("bend", cf.sample(name, size))
    cf.surface(field_by("bend", cf.sample(name, 8)))  # imports
    begin = time.process_time()
    cf.surface(field)
    seconds = round(time.process_time() - begin, 2)
    return [{"drawing": name, "size": size, "pixels": field.instance.grid.size, "seconds": seconds}]


MEASURES: Final[dict[str, Callable[..., Rows]]] = {
    "known": known, "noise": noise, "sides": sides, "trust": trust, "times": times,
}  # fmt: skip


def tasks(part: str, folder: Path | None) -> Iterator[tuple[Any, ...]]:
    """The arguments of each measurement of a part."""
    if part == "times":
        yield from TIMED
    elif part == "sides":
        yield from ((name, min(SIZES)) for name in PATCHES)
    elif part == "trust":
        own = [(name, name) for name, entry in SAMPLES.items() if entry.kind == "sketch"]
        files = (path for path in sorted(folder.iterdir()) if path.suffix in SUFFIXES) if folder else ()
        others = [(path.name, str(path)) for path in files if not path.stem.endswith("_mask")]
        yield from ((name, drawing, 48) for name, drawing in [*own, *others])
    else:
        yield from ((name, size) for name in SURFACES for size in SIZES)


def measure_part(part: str, folder: Path | None, jobs: int) -> Rows:
    """The rows of a part."""
    with ProcessPoolExecutor(1 if part == "times" else jobs) as processes:
        running = [processes.submit(MEASURES[part], *task) for task in tasks(part, folder)]
        return [row for future in running for row in future.result()]


# The page


def by_time(rows: Rows) -> str:
    """Sentence on the seconds of all surfaces that are timed."""
    texts = [f"`{row['drawing']}` {row['seconds']:.1f} s at {row['pixels']} pixels" for row in rows]
    return f"Processor time: {', '.join(texts)}."


def short_summary(rows: Rows, drawings: Rows, both_ways: Rows) -> str:
    """Summary of the errors of known surfaces and of the doubts about drawings."""
    bend = [row for row in rows if row["way"] == "bend"]
    errors = [row["mean"] for row in bend if row["size"] == max(SIZES)]
    sides = [row["side"] for row in rows if row["way"] != "power"]
    undoubted = {
        way: max(row["mean"] for row in rows if row["way"] == way and not row["doubts"]) for way in WAYS[:3]
    }
    worst = ", ".join(f"{error:.1f} degrees from a `{way}` field" for way, error in undoubted.items())
    even = [row["side"] for row in both_ways]
    ranks = [row["alike"] for row in bend]
    flagged = {
        subject: any(row["doubts"] for row in drawings if subject_of(row["drawing"]) == subject)
        for subject in {subject_of(row["drawing"]) for row in drawings}
    }
    own = [doubted for subject, doubted in flagged.items() if subject in SAMPLES]
    others = [doubted for subject, doubted in flagged.items() if subject not in SAMPLES]
    return f"""\
- **Good on clean nets of curvature lines.** On {len(errors)} known surfaces at {max(SIZES)} pixels, normals
  from bend fields have mean errors of {min(errors):.1f} to {max(errors):.1f} degrees.
- **Poor on most drawings by others.** crossfield [flags](#confidence-and-doubts) {sum(others)} of
  {len(others)} of their surfaces, and {sum(own)} of {len(own)} of our samples.
- **No doubt is no guarantee.** Known surfaces without doubts have mean errors of up to
  {worst}.
- **The side is a guess.** It is right in {sum(sides):.0f} of {len(sides)} cases on known surfaces, but for
  catenoids and saddle sheets, which look alike inside out, in {sum(even):.0f} of {len(even)} views.
- **`confidence` hardly shows errors**: its rank correlation with them is {min(ranks):.1f} to
  {max(ranks):.1f}."""


def draw_errors(rows: dict[str, Rows], path: Path) -> None:
    """Plot mean errors of the normals of every surface by source of the crosses, and by noise of strokes."""
    size = max(SIZES)
    known = {(row["surface"], row["way"]): row for row in rows["known"] if row["size"] == size}
    noise = {(row["surface"], row["noise"]): row for row in rows["noise"] if row["size"] == size}
    with_hint = {name: known[name, "bend"]["hinted"] for name in SURFACES}
    panels = {
        "crosses of": {
            way.replace("exact", "the surface"): {name: known[name, way]["mean"] for name in SURFACES}
            for way in ("exact", "bend", "greedy", "polyvector")
        },
        "`bend`, strokes with noise of": {"0°": {name: known[name, "bend"]["mean"] for name in SURFACES}}
        | {f"{degrees:g}°": {name: noise[name, degrees]["mean"] for name in SURFACES} for degrees in NOISE}
        | {"0°, with a hint": with_hint},
    }
    with open_panels(path, len(panels), high=6.2, wide=WIDE, stacked=True) as axes:
        for axis, (title, lines) in zip(axes, panels.items(), strict=True):
            looks = styles(list(lines))
            for name, errors in lines.items():
                look = looks[name] | {"linestyle": "none", "markersize": 7}
                axis.plot(list(errors.values()), list(errors), label=name, **look)
            axis.invert_yaxis()
            axis.set(xlim=(0, None), xlabel="mean error of the normals, degrees")
            axis.legend(title=title.replace("`", ""), loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=4)


WIDE: Final = 4.9
"""Inches, for words that are legible on a phone."""


COLUMNS: Final = {
    "known": {
        "surface": "surface", "size": "size", "way": "crosses", "flat": "facing the viewer",
        "mean": "mean error", "most": "95th percentile", "hinted": "mean error with a hint",
        "cross": "cross error",
        "side": "right side", "doubts": "doubts", "alike": "rank correlation of confidence",
    },
    "noise": {"surface": "surface", "size": "size", "noise": "noise", "mean": "mean error"},
    "trust": {
        "drawing": "drawing", "size": "size", "unfit": "unfit crosses", "spots": "singular spots",
        "slant": "mean slant", "confidence": "mean confidence", "doubts": "doubts",
    },
}  # fmt: skip
"""Columns of the CSV files, and their titles. Angles are in degrees."""


def cell_of(doubts: Any) -> Any:
    """Doubts as one text; their number as it is."""
    return "; ".join(doubts) if isinstance(doubts, list) else doubts


def write_page(rows: dict[str, Rows]) -> None:
    """Replace the summary and the times of the page, and write its plot and its rows as CSV."""
    summary = short_summary(rows["known"], rows["trust"], rows["sides"])
    replace_between(DOCS / "surface.md", "summary", summary)
    replace_between(DOCS / "surface.md", "times", by_time(rows["times"]))
    (DOCS / "surface").mkdir(exist_ok=True)
    for part, titles in COLUMNS.items():
        own = [row | {"doubts": cell_of(row.get("doubts"))} for row in rows[part]]
        table = [{title: row[name] for name, title in titles.items()} for row in own]
        (DOCS / "surface" / f"{part}.csv").write_text(csv_text(table), encoding="utf-8")
    draw_errors(rows, DOCS / "pictures" / "surface_errors.svg")


def main() -> None:
    """Measure the requested parts, and write the page."""
    parser = argparse.ArgumentParser(description="Measure surfaces, and replace the tables of their page.")
    parser.add_argument(
        "--measure", nargs="+", choices=MEASURES, default=[], help="parts to be measured anew"
    )
    parser.add_argument("--sketches", type=Path, help="folder of line drawings by others")
    parser.add_argument("--jobs", type=int, default=1, help="processes at once")
    options = parser.parse_args()
    rows = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    for part in options.measure:
        rows[part] = measure_part(part, options.sketches, options.jobs)
        KEPT.write_text(json.dumps(rows, indent=0, sort_keys=True) + "\n")
    write_page(rows)


if __name__ == "__main__":
    main()
