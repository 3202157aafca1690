"""Doubts about drawings whose surfaces are known, for docs/surface.md: `python docs/bench doubts [FOLDER]`.

FOLDER, by default ../shared/known_surfaces, has drawings NAME.clean.svg and NAME.rough_axes.svg, and
truth.json: samples of x, y on the page (y down) and of the unit normal there (y up).
"""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from crossfield.export.studio.document import FORMAT, VERSION, Document
from crossfield.export.studio.opening import open_drawing
from crossfield.export.studio.session import compute_surface
from crossfield.export.studio.views import field_step, surface_step
from crossfield.models.instance.domain import Floats
from crossfield.models.surface.trust import OFF, right_angle_deviation
from make import markdown, replace_between, write_rows
from PIL import Image, ImageDraw
from scipy import ndimage
from scipy.interpolate import RBFInterpolator
from scipy.spatial import KDTree
from surface_pictures import mean_angle
from surfaces import SHARED

SIZE: Final = 48
WRONG: Final = 15.0
"""Mean error of the normals, in degrees, above which a surface counts as wrong."""
SEED: Final = 1
FLAT: Final = 0.1
"""Median ratio of principal curvatures below which rulings are straight, so that the depth is open."""
COLOURS: Final = {"line": "#d0202a", "cut": "#111", "axis": "#9ab"}
SIDE: Final = 900
"""Pixels of the longer side of a scan."""


@dataclass(frozen=True)
class Stroke:
    """Points (k, 2), y down. kind: line, cut or axis. wrong: no curvature line; None: unclear."""

    points: Floats
    kind: str
    wrong: bool | None = False


@dataclass(frozen=True)
class Case:
    """A file with a drawing of a known surface. samples: x, y and normal (k, 5). is_open: its depth is."""

    drawing: str
    variant: str
    seed: int
    file: str
    data: bytes
    strokes: list[Stroke]
    samples: Floats
    is_open: bool = False


def read_strokes(path: Path) -> tuple[list[float], list[Stroke]]:
    """Page and strokes of a drawing."""
    opened = open_drawing(path.read_bytes(), path.name)
    return opened["page"], [
        Stroke(np.reshape(each["points"], (-1, 2)), each["mark"]) for each in opened["strokes"]
    ]


def draw_svg(page: Sequence[float], strokes: list[Stroke]) -> bytes:
    """A drawing as SVG."""
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{" ".join(map(str, page))}" fill="none">'
    width = 0.007 * max(page[2:])
    lines = [
        f'<path stroke="{COLOURS[stroke.kind]}" stroke-width="{width:.3g}" '
        f'd="M{" L".join(f"{x:.2f} {y:.2f}" for x, y in stroke.points)}"/>'
        for stroke in strokes
    ]
    return "\n".join([head, *lines, "</svg>"]).encode()


def along(points: Floats) -> Floats:
    """Length from the first point to each one."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def resampled(points: Floats, step: float) -> Floats:
    """Points about a step apart."""
    length = along(points)
    at = np.linspace(0, length[-1], max(3, round(length[-1] / step)))
    return np.stack([np.interp(at, length, side) for side in points.T], axis=1)


def roughen(stroke: Stroke, scale: float, rng: np.random.Generator) -> Iterator[Stroke]:
    """A stroke drawn once or twice: it wavers by 0.5 % of the drawing, and overshoots by up to 3 %."""
    for _ in range(int(rng.integers(1, 3))):
        points = resampled(stroke.points, scale / 100)
        if np.hypot(*(points[0] - points[-1])) > scale / 50:
            back = min(3, len(points) - 1)
            ends = [points[0] - points[back], points[-1] - points[-1 - back]]
            first, last = (0.03 * scale * rng.uniform(0.3, 1) * end / np.hypot(*end) for end in ends)
            points = np.concatenate([points[:1] + first, points, points[-1:] + last])
        noise = ndimage.gaussian_filter1d(rng.normal(size=points.shape), 5, axis=0, mode="nearest")
        noise *= 0.005 * scale / noise.std()
        yield replace(stroke, points=points + noise + rng.normal(0, 0.003 * scale, 2))


def scan(case: Case, page: Sequence[float], rng: np.random.Generator) -> Case:
    """A case as a picture: turned by up to 2 degrees, blurred and noisy."""
    scale, turn = SIDE / (1.16 * max(page[2:])), np.radians(rng.uniform(-2, 2))
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    size = [round(1.16 * scale * side) for side in page[2:]]
    shift = np.array(size) / 2 - scale * rotation @ (np.array(page[:2]) + np.array(page[2:]) / 2)
    strokes = [replace(each, points=scale * each.points @ rotation.T + shift) for each in case.strokes]
    image = Image.new("RGB", (2 * size[0], 2 * size[1]), (244, 242, 236))
    pen = ImageDraw.Draw(image)
    for stroke in strokes:
        pen.line((2 * stroke.points).ravel().tolist(), COLOURS[stroke.kind], 10, joint="curve")
    pixels = ndimage.gaussian_filter(np.asarray(image.reduce(2)).astype(float), (0.9, 0.9, 0))
    pixels += rng.normal(0, 6, pixels.shape)
    stream = io.BytesIO()
    Image.fromarray(np.clip(pixels, 0, 255).astype(np.uint8)).save(stream, "PNG")
    places, lean, depth = np.split(case.samples, [2, 4], axis=1)
    # The normals' y points upward, so that they turn the other way.
    samples = np.concatenate([scale * places @ rotation.T + shift, lean @ rotation, depth], axis=1)
    variant = f"{case.variant}, scanned"
    return replace(
        case, variant=variant, file="a.png", data=stream.getvalue(), strokes=strokes, samples=samples
    )


class Curvature:
    """Curvature lines of a surface, from its normals at samples."""

    def __init__(self, samples: Floats, scale: float) -> None:
        self.samples, self.scale, self.step = samples, scale, 0.01 * scale
        self.tree = KDTree(samples[:, :2])
        self.normals = RBFInterpolator(samples[:, :2], samples[:, 2:], neighbors=24, smoothing=1e-3)

    def slopes(self, places: Floats) -> Floats:
        """Slopes of the heights by x and by y down."""
        x, y, z = self.normals(places).T
        return np.stack([-x, y], axis=1) / np.maximum(z, 0.1)[:, None]

    def at(self, places: Floats) -> tuple[Floats, Floats, Floats]:
        """First fundamental form (k, 2, 2), principal curvatures (k, 2) and directions (k, 2, 2), columns."""
        slope = self.slopes(places)
        steps = self.step * np.eye(2)
        changes = [self.slopes(places + step) - self.slopes(places - step) for step in steps]
        change = np.stack(changes, axis=2) / (2 * self.step)
        second = (change + change.swapaxes(1, 2)) / 2 / np.sqrt(1 + (slope**2).sum(axis=1))[:, None, None]
        first = np.eye(2) + slope[:, :, None] * slope[:, None, :]
        inverse = np.linalg.inv(np.linalg.cholesky(first))
        values, vectors = np.linalg.eigh(inverse @ second @ inverse.swapaxes(1, 2))
        return first, values, inverse.swapaxes(1, 2) @ vectors

    def off(self, points: Floats) -> float:
        """Median angle in degrees, on the surface, between a stroke and the nearer curvature line."""
        points = resampled(points, 2 * self.step)
        run = np.diff(points, axis=0)
        first, _, directions = self.at((points[1:] + points[:-1]) / 2)
        length = np.sqrt(np.einsum("ka,kab,kb->k", run, first, run))
        cosine = np.abs(np.einsum("ka,kab,kbc->kc", run, first, directions)).max(axis=1) / length
        return float(np.median(np.degrees(np.arccos(np.minimum(cosine, 1)))))

    def has_straight_rulings(self) -> bool:
        """Whether one principal curvature is small, so that the lines leave the depth open."""
        sizes = np.sort(np.abs(self.at(self.samples[self.samples[:, 4] > 0.4, :2][::4])[1]), axis=1)
        return bool(np.median(sizes[:, 0] / sizes[:, 1]) < FLAT)

    def stray(self, rng: np.random.Generator, *, straight: bool) -> Floats | None:
        """A straight stroke, or one half-way between both families, far from curvature lines and long.

        None where the surface is so round that every line is one.
        """
        middle = self.samples[self.samples[:, 4] > 0.6, :2]
        most = np.abs(curvatures := self.at(middle)[1]).max(axis=1)
        apart = np.abs(curvatures[:, 1] - curvatures[:, 0])
        starts = middle[(apart > 0.3 * most) & (most * self.scale > 0.5)]
        ways = []
        for _ in range(40 if len(starts) >= 20 else 0):
            start, turn = starts[rng.integers(len(starts))], rng.uniform(0, np.pi)
            ahead = np.array([np.cos(turn), np.sin(turn)])
            if straight:
                way = start + np.outer(np.linspace(-0.22, 0.22, 45) * self.scale, ahead)
            else:
                way = np.concatenate([self._between(start, -ahead)[:0:-1], self._between(start, ahead)])
            gaps = np.flatnonzero(self.tree.query(way)[0] >= 0.03 * self.scale)
            low = max(gaps[gaps < len(way) // 2], default=-1) + 1
            way = way[low : min(gaps[gaps > len(way) // 2], default=len(way))]
            if len(way) >= 16:
                ways.append((min(self.off(way), 30.0) + 20 * min(along(way)[-1] / self.scale, 0.4), way))
        return max(ways, key=lambda entry: entry[0])[1] if ways else None

    def _between(self, place: Floats, ahead: Floats) -> Floats:
        """A way from a place, at 45 degrees to both curvature lines."""
        way = [place]
        for _ in range(22):
            lines = self.at(way[-1][None])[2][0]
            diagonals = [lines[:, 0] + sign * lines[:, 1] for sign in (1, -1)]
            sides = [side * each / np.hypot(*each) for each in diagonals for side in (1, -1)]
            ahead = max(sides, key=lambda each: float(each @ ahead))
            way.append(way[-1] + self.step * ahead)
        return np.array(way)


def cases(folder: Path) -> Iterator[Case]:
    """All drawings, and variants of the clean ones."""
    for number, (name, truth) in enumerate(
        sorted(json.loads((folder / "truth.json").read_text("utf-8")).items())
    ):
        samples, rng = np.array(truth["normals"]), np.random.default_rng([SEED, number])
        page, strokes = read_strokes(folder / f"{name}.clean.svg")
        rough, curvature = folder / f"{name}.rough_axes.svg", Curvature(samples, max(page[2:]))
        drawn = Case(
            name, "rough with axes", 0, rough.name, rough.read_bytes(), read_strokes(rough)[1], samples
        )
        drawn = replace(drawn, is_open=curvature.has_straight_rulings())
        yield drawn
        for case in variants(page, strokes, curvature, rng):
            drawn = replace(
                drawn,
                variant=case.variant,
                seed=case.seed,
                file=case.file,
                data=draw_svg(page, case.strokes),
                strokes=case.strokes,
            )
            yield drawn
            if case.variant in {"clean", "rough", "stray line"} and case.seed == 0:
                yield scan(drawn, page, rng)


def variants(
    page: Sequence[float], strokes: list[Stroke], curvature: Curvature, rng: np.random.Generator
) -> Iterator[Case]:
    """Strokes of variants of a clean drawing."""
    lines, cuts = ([k for k, each in enumerate(strokes) if each.kind == kind] for kind in ("line", "cut"))

    def case(variant: str, seed: int, drawn: list[Stroke]) -> Case:
        return Case("", variant, seed, "a.svg", b"", drawn, np.empty(0))

    yield case("clean", 0, strokes)
    for seed in range(2):
        yield case("rough", seed, [copy for each in strokes for copy in roughen(each, max(page[2:]), rng)])
    corner, size = np.array(page[:2]), np.array(page[2:])
    for_axes = rng.uniform(0.4, 0.6, (2, 2))
    ends = [[(0, for_axes[0, 0]), (1, for_axes[0, 1])], [(for_axes[1, 0], 0), (for_axes[1, 1], 1)]]
    yield case("pale axes", 0, [*(Stroke(corner + size * np.array(each), "axis") for each in ends), *strokes])
    if cuts:
        longest = max(cuts, key=lambda k: along(strokes[k].points)[-1])
        off = curvature.off(strokes[longest].points)
        red = replace(strokes[longest], kind="line", wrong=None if 5 <= off < 10 else off >= 10)
        yield case("red outline", 0, [red if k == longest else each for k, each in enumerate(strokes)])
    for seed in range(2):
        way = curvature.stray(rng, straight=seed == 1)
        if way is not None:
            yield case("stray line", seed, [*strokes, Stroke(way, "line", wrong=True)])
    for seed, gone in enumerate(rng.choice(lines, 2, replace=False)):
        yield case("line missing", seed, [each for k, each in enumerate(strokes) if k != gone])
    for count in range(2, len(lines) - 1, 2):
        yield case("begun", count, [strokes[k] for k in sorted([*cuts, *lines[:count]])])


def match_strokes(case: Case, document: Document) -> list[int]:
    """Of each stroke of a document, the number of the stroke that is drawn there."""
    points = [resampled(each.points, along(each.points)[-1] / 200) for each in case.strokes]
    owner = np.repeat(np.arange(len(points)), list(map(len, points)))
    tree = KDTree(np.concatenate(points))
    read = [resampled(each.points, along(each.points)[-1] / 60) for each in document.strokes]
    return [int(np.bincount(owner[tree.query(each)[1]]).argmax()) for each in read]


def measure(case: Case) -> dict[str, Any]:
    """The error of the surface of a case, and what the studio says of it."""
    opened = open_drawing(case.data, case.file)
    content = {name: opened[name] for name in ("name", "page", "strokes", "source")}
    content |= {"format": FORMAT, "version": VERSION, "size": SIZE}
    _, drawn, field = field_step(json.dumps(content).encode())
    seen, document, instance = surface_step(drawn, field), drawn.document, drawn.instance
    at = np.floor((case.samples[:, :2] - instance.origin) / instance.pixel_size).astype(int)[:, ::-1]
    inside = ((at >= 0) & (at < instance.mask.shape)).all(axis=1)
    inside[inside] = instance.mask[tuple(at[inside].T)]
    lifted = compute_surface(document, field)
    normals, true = lifted.normals[instance.grid.number[tuple(at[inside].T)]], case.samples[inside, 2:]
    sides = [mean_angle(normals * side, true) for side in ((1, 1, 1), (-1, -1, 1))]
    drawn_at = match_strokes(case, document)
    suspects = [case.strokes[number].wrong for number in {drawn_at[number] for number in seen["suspects"]}]
    is_named = any(choice["kind"] == "depth" for choice in seen["freedom"])
    return {
        "drawing": case.drawing,
        "variant": case.variant,
        "seed": case.seed,
        "mean error": f"{min(sides):.1f}",
        "inside out": int(sides[1] < sides[0]),
        "misfit": f"{np.mean(right_angle_deviation(field, lifted.heights) > OFF):.2f}",
        "depth is open": int(case.is_open),
        "open depth": int(is_named),
        "wrong lines": sum(stroke.wrong is True for stroke in case.strokes),
        "suspected": len(suspects) - suspects.count(None),
        "rightly suspected": suspects.count(True),
        "warned": int(is_named or bool(seen["suspects"])),
    }


def summarise(rows: list[dict[str, Any]]) -> Iterator[list[str]]:
    """Statements, their precision and recall: for drawings in two halves, scans, and drawings begun."""
    names = sorted({row["drawing"] for row in rows})
    halves = {name: f"{half[0]} to {half[-1]}" for half in (names[:6], names[6:]) for name in half}
    sets: dict[str, list[dict[str, Any]]] = {title: [] for title in (*halves.values(), "scanned", "begun")}
    for row in rows:
        kinds = [kind for kind in ("scanned", "begun") if kind in row["variant"]]
        sets[kinds[0] if kinds else halves[row["drawing"]]].append(row)
    for title, chosen in {
        **sets,
        "all but begun": [row for row in rows if row["variant"] != "begun"],
    }.items():
        lines, rightly = (sum(row[head] for row in chosen) for head in ("wrong lines", "rightly suspected"))
        wrong = [float(row["mean error"]) > WRONG for row in chosen]
        is_open, named, warned = (
            [row[head] for row in chosen] for head in ("depth is open", "open depth", "warned")
        )
        yield [
            f"{title} ({len(chosen)})",
            str(lines),
            describe(sum(row["suspected"] for row in chosen), rightly, lines),
            str(sum(is_open)),
            describe(sum(named), int(np.dot(is_open, named)), sum(is_open)),
            str(sum(wrong)),
            describe(sum(warned), int(np.dot(wrong, warned)), sum(wrong)),
        ]


def describe(doubted: int, right: int, wrong: int) -> str:
    """A number of statements, their precision and recall."""
    return ", ".join(
        [str(doubted), *(f"{right / count:.2f}" if count else "-" for count in (doubted, wrong))]
    )


def main(page: Path, arguments: Sequence[str]) -> None:
    """Measure all cases, and replace the table and its CSV file."""
    folder = Path(*arguments) if arguments else SHARED
    if not (folder / "truth.json").exists():
        sys.exit(f"{folder} holds no drawings with known surfaces; give the folder that does")
    rows = []
    for case in cases(folder):
        rows.append(measure(case))
        print(*rows[-1].values(), flush=True)
    write_rows("surface/doubts.csv", rows)
    heads = ("drawings", "wrong lines", "suspected", "open depths", "named", "wrong surfaces", "warned")
    replace_between(page.with_name("surface.md"), "doubts", markdown(heads, list(summarise(rows))))
