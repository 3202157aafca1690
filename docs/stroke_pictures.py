"""Pictures of good and bad strokes, for docs/guides/drawing.md: `python docs/make.py strokes`.

Each picture has two drawings of one object, each with the surface that crossfield computes from it. The
objects are surfaces of revolution, whose parallels and meridians are their curvature lines.
"""

from __future__ import annotations

import io
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import crossfield as cf
import numpy as np
import resvg_py
from crossfield.export.pictures.marks import ImageMark, Mark
from crossfield.export.pictures.underlay import read_underlay
from crossfield.export.shading.colours import shade_by_light, to_eight_bit
from crossfield.export.shading.raster import raster, view_of_box
from crossfield.export.surfaces.outline import find_outline
from crossfield.models.instance.domain import Floats
from crossfield.models.sketch.surfaces import rotation_by
from diagrams import page_of, save_thumbnail, word
from PIL import Image
from scipy.spatial import ConvexHull

FOLDER: Final = Path(__file__).resolve().parent / "pictures"
BOX: Final = (-115.0, -115.0, 230.0, 230.0)
HEAD: Final = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="{} {} {} {}" fill="none">'
SIDE, GAP, TOP = 100.0, 4.0, 22.0
"""Points of a drawing, between two, and above them."""
COLOURS: Final = 48
PEN: Final = 3.0
EGG: Final = (70.0, 95.0)
"""Semi-axes across and along."""


@dataclass(frozen=True)
class Case:
    """A drawing: its words, its SVG elements, the size of its grid, and the side of its surface."""

    words: str
    body: str
    size: int = 48
    flip: bool = False


def line(points: Floats | Iterable[tuple[float, float]], colour: str = "#000", width: float = PEN) -> str:
    """A polyline."""
    data = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{data}" stroke="{colour}" stroke-width="{width}"/>'


def on_egg(latitude: Any, longitude: Any, tilt: float = -25.0) -> Floats:
    """Points (n, 3) of the egg, y down, of these angles in degrees; the middle faces the viewer."""
    t, s = np.broadcast_arrays(*np.radians([latitude, longitude]))
    across, along = EGG
    points = np.stack([across * np.cos(t) * np.sin(s), along * np.sin(t), across * np.cos(t) * np.cos(s)], -1)
    return np.asarray(points @ rotation_by(tilt, 20.0).T) * (1, -1, 1)


def outline() -> Floats:
    """The outline (n, 2) of the egg."""
    points = on_egg(*np.meshgrid(np.linspace(-90, 90, 181), np.linspace(-180, 180, 361))).reshape(-1, 3)[
        :, :2
    ]
    corners = points[ConvexHull(points).vertices]
    return np.concatenate([corners, corners[:1]])


AROUND: Final = np.linspace(-62.0, 62.0, 40)
BODY: Final = line(outline())


def parallels(*latitudes: float) -> str:
    """Red parallels of the egg."""
    return "".join(line(on_egg(np.full(40, at), AROUND)[:, :2], "red") for at in latitudes)


def meridians(*longitudes: float) -> str:
    """Red meridians of the egg."""
    return "".join(line(on_egg(AROUND, np.full(40, at))[:, :2], "red") for at in longitudes)


BOTH: Final = parallels(-30, 0, 30) + meridians(-35, 0, 35)


def hatching() -> str:
    """Slanted red lines, as a shadow is hatched."""
    return "".join(line([(x - 30, 45), (x + 30, -45)], "red") for x in range(-30, 31, 15))


def on_bowl(latitude: Any, longitude: Any) -> Floats:
    """Points (n, 2) inside of a shallow bowl seen from above, y down, of these angles in degrees."""
    t, s = np.broadcast_arrays(*np.radians([latitude, longitude]))
    points = np.stack([108 * np.cos(t) * np.sin(s), 40 * np.sin(t), 108 * np.cos(t) * np.cos(s)], -1)
    return np.asarray(points @ rotation_by(-58.0, 0.0).T)[:, :2] * (1, -1) - (0, 12)


def bowl() -> str:
    """The rim of a bowl, a parallel and meridians inside."""
    turn, down = np.linspace(0, 360, 73), np.linspace(0, -65, 30)
    ribs = (line(on_bowl(down, np.full(30, at)), "red") for at in range(20, 380, 60))
    return line(on_bowl(np.zeros(73), turn)) + line(on_bowl(np.full(73, -42.0), turn), "red") + "".join(ribs)


def scribble(*, back_and_forth: bool) -> str:
    """The lines of the egg in rough strokes: one that goes back and forth, or several over each other."""
    lines = []
    for at in (-25.0, 25.0):
        if back_and_forth:
            shift = 9 * np.where(np.arange(40) % 2, 1, -1)
            lines += [on_egg(at + shift, AROUND), on_egg(AROUND, at + shift)]
        else:
            for wobble in (-2.5, 1.0, 3.0):
                lines += [on_egg(at + wobble * np.cos(AROUND / 20 + wobble), AROUND)]
                lines += [on_egg(AROUND, at + wobble * np.cos(AROUND / 25 + wobble))]
    return "".join(line(points[:, :2], "red", 2.0) for points in lines)


def axes(colour: str, width: float) -> str:
    """Construction lines through the egg."""
    return line([(-105, 5), (105, 5)], colour, width) + line([(0, -110), (0, 110)], colour, width)


PAIRS: Final[dict[str, tuple[Case, Case]]] = {
    "follow": (Case("hatching", BODY + hatching()), Case("lines that follow the shape", BODY + BOTH)),
    "families": (
        Case("one family", BODY + parallels(-40, -20, 0, 20, 40)),
        Case("two families", BODY + BOTH),
    ),
    "bend": (
        Case(
            "straight lines: flat",
            BODY + line([(-55, 10), (58, -12)], "red") + line([(-10, -75), (12, 75)], "red"),
        ),
        Case("bent lines: round", BODY + parallels(-25, 20) + meridians(-30, 25)),
    ),
    "close": (Case("open outline", line(outline()[:-40]) + BOTH), Case("closed outline", BODY + BOTH)),
    "scribble": (
        Case("back and forth", BODY + scribble(back_and_forth=True)),
        Case("over each other", BODY + scribble(back_and_forth=False)),
    ),
    "room": (
        Case(
            "no room between lines", BODY + parallels(*range(-60, 61, 6)) + meridians(*range(-64, 65, 8)), 24
        ),
        Case("few lines", BODY + BOTH, 24),
    ),
    "axes": (
        Case("strong axes", axes("#000", PEN) + BODY + BOTH),
        Case("pale axes", axes("#9ab", 1.5) + BODY + BOTH),
    ),
    "flip": (Case("as computed", bowl()), Case("with --flip", bowl(), flip=True)),
}
"""Name of the picture -> the worse and the better drawing."""


def draw_case(case: Case, left: float) -> list[Mark]:
    """The drawing and its surface, side by side, with words above."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "drawing.svg"
        path.write_text(HEAD.format(*BOX) + case.body + "</svg>")
        instance = cf.read_sketch(path, size=case.size)
        drawing = read_underlay(path, on=instance)
        estimate = cf.surface(cf.bend_field(cf.polyvector_field(instance)), flip=case.flip)
        view = view_of_box(BOX, round(2 * SIDE))
        shown = resvg_py.svg_to_bytes(svg_path=str(path), width=view.width, height=view.height)
    shaded = shade_by_light(raster(instance, estimate.normals, view, outline=find_outline(instance, drawing)))
    strokes = np.asarray(Image.open(io.BytesIO(bytes(shown))).convert("RGBA"))
    high = SIDE * BOX[3] / BOX[2]
    return [
        ImageMark((left, TOP, SIDE, high), strokes),
        ImageMark((left + SIDE + GAP, TOP, SIDE, high), to_eight_bit(shaded)),
        word(case.words, np.array([left + SIDE + GAP / 2, TOP - 8])),
    ]


def draw_pictures() -> None:
    """Draw docs/pictures/stroke_*.png."""
    for name, pair in PAIRS.items():
        marks = [draw_case(case, GAP + number * (2 * SIDE + 4 * GAP)) for number, case in enumerate(pair)]
        sheet = page_of([mark for part in marks for mark in part], 4 * SIDE + 6 * GAP, SIDE + TOP + GAP)
        save_thumbnail([sheet], FOLDER / f"stroke_{name}.png", COLOURS)
