"""The figures of README, docs/cross-field.md and docs/mathematics.md: `python docs/make.py figures`.

Every figure is computed. Lines, strokes and singularities have the colours of all pictures of fields.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Final

import crossfield as cf
import matplotlib as mpl
import numpy as np
from crossfield.export.library.documents.statistics import problem_counts
from crossfield.export.pictures.marks import (
    BORDER,
    FAINT,
    FAMILIES,
    PAPER,
    POSITIVE,
    STROKE,
    Area,
    ImageMark,
    Layer,
    Lines,
    Mark,
    Sheet,
    TextMark,
    straight_line,
)
from crossfield.export.pictures.panels import PanelContent, draw_surface
from crossfield.export.pictures.streamlines import align_labels
from crossfield.export.pictures.svg import render_sheet, sheet_svg
from crossfield.export.pictures.underlay import Underlay, read_underlay
from crossfield.export.shading.colours import shade_by_light, to_eight_bit
from crossfield.export.shading.raster import grid_box, raster, view_of_grid
from crossfield.export.surfaces.files import draw_strokes
from crossfield.export.surfaces.outline import find_outline
from crossfield.models.field.field import CrossField
from crossfield.models.field.jumps import best_jumps
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.choice import declare
from crossfield.models.instance.angles import HALF, QUARTER
from crossfield.models.instance.instance import Instance
from crossfield.models.smooth.bend import surface_field
from matplotlib.figure import Figure
from PIL import Image
from plots import fixed_settings

U, V = FAMILIES
GREY, FILL = "#7a7a7a", "#dfe9f5"
STYLE: Final = {"font.family": "DejaVu Sans"}
PAGE: Final = 340.0
"""Points of the width of a picture of docs/cross-field.md, whose words stay legible on a phone."""
TEXT, SCALE = 13.0, 110 / 72
"""Points of words in pictures of the same page, and dots per point of thumbnails."""
CLOSE: Final = 68.0
"""Points of a pixel in the picture of the singularity."""
SIZED: Final = ("mouse", 24)
"""The sketch whose formulations are counted."""
CONVEX, NON_CONVEX = "#4477aa", "#cc79a7"
ROW, BAR = 24.0, 46.0
"""Points of a row and of the longest bar in the picture of sizes."""
COLUMNS: Final = (122.0, 179.0, 236.0, 289.0)


def line(axes: Any, angle: float, colour: str, name: str = "", at: tuple[float, float] = (0.0, 0.0)) -> None:
    """A line through a point, with its name at its end."""
    step = 0.42 * np.array([np.cos(angle), np.sin(angle)])
    begin, end = np.array(at) - step, np.array(at) + step
    axes.plot(*zip(begin, end, strict=True), color=colour, linewidth=2.6, solid_capstyle="round")
    axes.text(*(np.array(at) + 1.22 * step), name, color=colour, ha="center", va="center")


def bare(axes: Any, title: str, *, equal: bool = True) -> None:
    """Remove frame and ticks."""
    axes.set_axis_off()
    axes.set_title(title, fontsize=11)
    if equal:
        axes.set_aspect("equal")


@cache
def mouse(size: int) -> CrossField:
    """The bend field of the sample `mouse`."""
    return surface_field(cf.sample("mouse", size))


def panel(field: CrossField, width: float, left: float = 0.0, top: float = 0.0) -> PanelContent:
    """A panel of that width, in points, y down, with margins to the left and above."""
    return PanelContent(field.instance, field, width, corner=(left, top))


def drawing_of(instance: Instance, drawing: str | Path | None) -> Underlay:
    """A file or sample on its instance; without one, the curvature lines whose pixels are strokes."""
    if drawing:
        return read_underlay(drawing, on=instance)
    segments = cf.analytic(instance.name, max(instance.mask.shape)).segments
    breaks = np.flatnonzero((segments[1:, 0] != segments[:-1, 1]).any(axis=1)) + 1
    return Underlay(grid_box(instance), {"red": np.split(segments, breaks)}, ("", ""), None)


def draw_drawing(content: PanelContent, drawing: Underlay) -> Mark:
    """The drawing from which the instance of a panel was read."""
    view = view_of_grid(content.instance, round(2 * content.unit))
    return ImageMark(content.box, draw_strokes(content.instance, drawing, view))


def strokes() -> list[Mark]:
    """The drawing, and its stroke pixels, each with its direction."""
    content = panel(mouse(20), PAGE)
    frame = content.frame
    drawing = draw_drawing(content, drawing_of(content.instance, "mouse"))
    sides = [frame.sides("#e4e4e4", 0.6, between=True), frame.sides(BORDER, 0.9)]
    return [drawing, *sides, *frame.strokes(STROKE, 3.0)]


def front() -> list[Mark]:
    """The row of the mouse, for README and home page."""
    return draw_row(mouse(48), "mouse")


def draw_row(field: CrossField, drawing: str | Path | None) -> list[Mark]:
    """A drawing, the lines of its field, and the surface, without words. drawing: as in `drawing_of`."""
    contents = [panel(field, 0.64 * PAGE, number * 0.68 * PAGE, 4.0) for number in range(3)]
    instance, lines = field.instance, contents[1].frame
    strokes_of = drawing_of(instance, drawing)
    outline = find_outline(instance, strokes_of) if drawing else None
    view = view_of_grid(instance, round(2 * contents[2].unit))
    shaded = shade_by_light(raster(instance, cf.surface(field).normals, view, outline=outline))
    return [
        draw_drawing(contents[0], strokes_of),
        *lines.streamlines(field, 1.1, 7.0),
        *lines.singularities(field, 3.0),
        ImageMark(contents[2].box, to_eight_bit(shaded)),
    ]


def draw_thumbnail(field: CrossField, drawing: str | Path | None, path: Path) -> None:
    """Draw a row as a PNG; the longer side of each grid has the same length."""
    height = 0.64 * PAGE * field.instance.grid.height / max(field.instance.mask.shape) + 8
    save_thumbnail([page_of(draw_row(field, drawing), 2 * PAGE, height)], path, 256)


def save_thumbnail(sheets: list[Sheet], path: Path, colours: int) -> None:
    """Save sheets side by side as a PNG with a palette."""
    sizes = [[round(SCALE * side) for side in sheet.page[2:]] for sheet in sheets]
    rendered = [render_sheet(sheet, *size) for sheet, size in zip(sheets, sizes, strict=True)]
    picture = Image.fromarray(np.hstack(rendered)).convert("RGB")
    picture.quantize(colours, dither=Image.Dither.NONE).save(path, optimize=True)


def page_of(marks: list[Mark], width: float, height: float) -> Sheet:
    """White paper with marks on it."""
    page = (0.0, 0.0, width, height)
    return Sheet(page, (Layer("", (Area(PAPER, np.array([page])), *marks)),))


def polyline(colour: str, width: float, *points: Any) -> Lines:
    """A line through points (x, y)."""
    return Lines(colour, width, [straight_line(np.array(points))])


def crosses() -> list[Mark]:
    """A cross at every pixel, and the two angles of one."""
    content = panel(mouse(20), 0.6 * PAGE, 0.0, 16.0)
    centre, scale = np.array([0.59 * PAGE + 62, 115.0]), 124.0

    def at(angle: float, radius: float) -> Any:
        return centre + scale * radius * np.array([np.cos(angle), -np.sin(angle)])

    alpha, beta = np.radians(24), np.radians(20)
    marks: list[Mark] = [*content.frame.strokes(FAINT, 3.0), *content.frame.crosses(content.crosses, 1.5)]
    marks.append(polyline(GREY, 0.9, at(0, -0.3), at(0, 0.55)))
    marks += [polyline(GREY, 1.0, at(angle, 0), at(angle, 0.52)) for angle in (alpha, alpha + HALF)]
    for angle, colour, name in ((alpha + beta, U, "u"), (alpha + HALF - beta, V, "v")):
        marks.append(polyline(colour, 2.6, at(angle, -0.42), at(angle, 0.42)))
        marks.append(word(name, at(angle, 0.51), colour))
    for begin, end, name in (
        (0, alpha, "α"),
        (alpha, alpha + beta, "β"),
        (alpha + HALF - beta, alpha + HALF, "β"),
    ):
        marks.append(polyline(GREY, 1.2, *(at(angle, 0.24) for angle in np.linspace(begin, end, 20))))
        marks.append(word(name, at((begin + end) / 2, 0.384)))
    return marks


def word(text: str, middle: Any, colour: str = "#000000") -> TextMark:
    """A word with its middle at a place (x, y)."""
    x, y = middle.tolist()
    return TextMark(text, (x, y + 0.35 * TEXT), TEXT, colour)


def jump(figure: Figure) -> None:
    """The same two lines under two labels, and the jump from one label to the other."""
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    bare(axes, "")
    alpha, beta = np.radians(22), np.radians(14)
    for x, name, (a, b) in ((0, "i", (alpha, beta)), (1.8, "j", (alpha + HALF, -beta))):
        axes.add_patch(mpl.patches.Rectangle((x - 0.6, -0.6), 1.2, 1.2, fill=False, edgecolor="#c9c9c9"))
        line(axes, a + b, U, "u", (x, 0))
        line(axes, a + HALF - b, V, "v", (x, 0))
        axes.text(x - 0.5, 0.46, name, style="italic", ha="center", va="center")
        words = f"α = {np.degrees(a):.0f}°, β = {np.degrees(b):.0f}°".replace("-", "−")
        axes.text(x, -0.76, words, ha="center", va="center")
    axes.annotate("", (1.14, 0), (0.66, 0), arrowprops={"arrowstyle": "->", "color": GREY, "lw": 1.6})
    axes.text(0.9, 0.13, "p = 1", ha="center", va="center")
    axes.set(xlim=(-0.65, 2.45), ylim=(-0.9, 0.64))


def singularity() -> list[Mark]:
    """The crosses round a singularity, and the jumps between the four next to it."""
    field = align_labels(mouse(20))
    grid, ring = field.instance.grid, field.singularities.ring[0]
    middle = panel(field, CLOSE * grid.width).frame.at(
        np.array([field.singularities.column[0] + 0.5, -field.singularities.row[0] - 0.5])
    )
    _, width, height = SHEETS["first_singularity"]
    frame = panel(field, CLOSE * grid.width, *(np.array([width, height]) / 2 - middle).tolist()).frame
    marks: list[Mark] = [*frame.crosses(field, 2.6), *frame.singularities(field, 6.0)]
    for pair in grid.quads[ring]:
        ends = np.array([(grid.columns[k], -grid.rows[k]) for k in (grid.first[pair], grid.second[pair])])
        points = frame.at(ends)
        (x, y), text = points.mean(axis=0).tolist(), f"{field.p[pair]}".replace("-", "−")
        marks.append(polyline(GREY, 1.2, *points))
        marks.append(Area(PAPER, np.array([[x - 9, y - 8, x + 9, y + 8]])))
        marks.append(word(text, np.array([x, y])))
    return marks


def surface() -> list[Mark]:
    """The surface, with the lines of the field on it."""
    field = mouse(48)
    content = panel(field, PAGE)
    shaded = draw_surface(replace(content, surface=cf.surface(field)))
    return [*shaded, *content.frame.streamlines(field, 1.2, 14.0)]


def strip(figure: Figure) -> None:
    """The strip of all crosses with its edges glued, and the windows of both gauges for a stroke."""
    left, right = figure.subplots(2, 1, height_ratios=(1.35, 1))
    bare(left, "all crosses: a strip, glued with a twist", equal=False)
    left.add_patch(mpl.patches.Rectangle((0, -45), 90, 90, facecolor=FILL, edgecolor="none"))
    for x, (low, high) in ((0, (-45, 45)), (90, (45, -45))):
        left.annotate("", (x, high), (x, low), arrowprops={"arrowstyle": "-|>", "color": "#333", "lw": 1.6})
    for y in (-45, 45):
        left.plot([0, 90], [y, y], color="#333", linewidth=1, linestyle=":")
    first, second = np.array([78, 22]), np.array([14, -8])
    other = second * (1, -1) + (90, 0)
    share = (90 - first[0]) / (other[0] - first[0])
    edge = first + share * (other - first)
    left.plot(*zip(first, edge, strict=True), color=U, linewidth=2)
    left.plot(*zip((0, -edge[1]), second, strict=True), color=U, linewidth=2)
    left.plot(*zip(first, second, strict=True), color=GREY, linewidth=1, linestyle="--")
    for name, (x, y), shift in (("i", first, (-6, -2)), ("j", second, (3, -9))):
        left.plot(x, y, "o", color=U)
        left.text(x + shift[0], y + shift[1], name)
    left.text(38, 11, "p = 0: long", color=GREY, ha="center", rotation=16)
    left.text(70, 31, "p = −1: short", color=U, ha="center")
    for x, name in ((0, "α = 0"), (90, "α = 90°")):
        left.text(x, -54, name, ha="center")
    for y, name in ((-45, "β = −45°"), (0, "0"), (45, "45°")):
        left.text(-3, y, name, ha="right", va="center")
    left.set(xlim=(-22, 96), ylim=(-60, 50))
    bare(right, "windows of alpha that admit a stroke at 120°", equal=False)
    for y, name, (low, high), colour in (
        (1, "box", (0, 90), GREY),
        (0, "strokes", (75, 165), U),
    ):
        right.plot([low, high], [y, y], color=colour, linewidth=9, solid_capstyle="butt", alpha=0.55)
        right.text(-8, y, name, ha="right", va="center")
    right.plot([120, 120], [-0.35, 1.35], color="#333", linewidth=1, linestyle=":")
    right.text(120, 1.42, "θ = 120°", ha="center")
    right.annotate("", (120, 1), (90, 1), arrowprops={"arrowstyle": "->", "color": "#333"})
    right.text(103, 1.14, "β = 30°", ha="center")
    right.text(126, -0.2, "β = 0", ha="left", va="top")
    for x in (0, 90, 180):
        right.text(x, -0.62, f"α = {x}°", ha="center")
    right.set(xlim=(-45, 190), ylim=(-0.8, 1.7))


def facets(figure: Figure) -> None:
    """The points (beta, z) that satisfy the facets, for three values of p1, and points that (26) adds."""
    shown = figure.subplots(1, 3, sharey=True)
    beta = np.linspace(-QUARTER, QUARTER, 5)  # all corners are among these
    for axes, p1 in zip(shown, (0.0, 0.5, 1.0), strict=True):
        upper = np.minimum(beta - QUARTER * p1 + QUARTER, QUARTER * p1)
        lower = beta + QUARTER * p1 - QUARTER
        degrees = np.degrees
        printed, hull = np.maximum(lower, -QUARTER), np.maximum(lower, -QUARTER * p1)
        axes.fill_between(
            degrees(beta), degrees(printed), degrees(upper), color="#f3d9b5", label="(26) as printed"
        )
        axes.fill_between(degrees(beta), degrees(hull), degrees(upper), color="#9db9dd", label="hull")
        if p1 in {0.0, 1.0}:
            axes.plot(degrees(beta), degrees(p1 * beta), color="#333", linewidth=2.4, label="z = p1 β")
        axes.set(
            title=f"p1 = {p1:g}",
            xlabel="β",
            xticks=(-45, 0, 45),
            yticks=(-45, 0, 45),
            xlim=(-46, 46),
            ylim=(-48, 48),
        )
        axes.spines[["top", "right"]].set_visible(False)
    shown[0].set_ylabel("z")
    figure.legend(*shown[0].get_legend_handles_labels(), loc="outside upper center", frameon=False, ncols=3)


def singular(figure: Figure) -> None:
    """Two quads of crosses: in one they close, in the other they turn by a quarter."""
    for axes, turn, title in zip(
        figure.subplots(1, 2), (0, 0.25), ("regular: sum of jumps 0", "singular: index +1/4"), strict=True
    ):
        bare(axes, title)
        row, column = np.indices((2, 2)).reshape(2, -1)
        at = np.arctan2(0.5 - row, column - 0.5)
        alpha = (0.35 + turn * at) % HALF
        instance = Instance.on_pixels(
            "block", np.ones((2, 2), bool), np.array([[0, 0]]), np.array([0.0]), np.ones(1), gauge="box"
        )
        p = best_jumps(instance, alpha, np.zeros(4))
        field = CrossField(instance, alpha, np.zeros(4), p)
        for x, y, angle in zip(column, 1 - row, alpha, strict=True):
            line(axes, angle, U, "", (x, y))
            line(axes, angle + HALF, V, "", (x, y))
        grid = instance.grid
        for i, j, jump in zip(grid.first, grid.second, p, strict=True):
            x, y = (column[i] + column[j]) / 2, 1 - (row[i] + row[j]) / 2
            words = f"p = {jump}".replace("-", "−")
            axes.text(
                x,
                y,
                words,
                ha="center",
                va="center",
                fontsize=9,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1},
            )
        for index in field.singularities.index:
            axes.plot(0.5, 0.5, "o", color=POSITIVE, markersize=9)
            axes.text(0.5, 0.38, f"+{index:g}", ha="center", va="top", fontsize=10)
        axes.set(xlim=(-0.55, 1.55), ylim=(-0.55, 1.55))


def sizes(figure: Figure) -> None:
    """Columns, rows, integers and nonlinear terms of every formulation of one sketch, as numbers and bars."""
    rows = {name: count_parts(name) for name in FORMULATIONS}
    most = np.max(list(rows.values()), axis=0)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0, PAGE), ylim=(ROW * (len(rows) + 2), 0))
    axes.set_axis_off()
    for place, title in zip(COLUMNS, ("columns", "rows", "integers", "nonlinear\nterms"), strict=True):
        axes.text(place, 1.2 * ROW, title, ha="left", va="bottom", fontsize=10)
    for number, (name, counts) in enumerate(rows.items()):
        y = (number + 1.8) * ROW
        colour = CONVEX if declare(name).is_convex else NON_CONVEX
        axes.text(2, y + 4, name, va="center", fontsize=10.5)
        for place, count, whole in zip(COLUMNS, counts, most, strict=True):
            axes.text(place, y, f"{count:,}", va="center", fontsize=9.5)
            bar = ((place, y + 6.5), BAR * count / whole, 4.5)
            axes.add_patch(mpl.patches.Rectangle(*bar, color=colour, linewidth=0))
    for x, colour, words in ((2, CONVEX, "convex"), (58, NON_CONVEX, "not convex")):
        axes.add_patch(mpl.patches.Rectangle((x, 6), 9, 9, color=colour, linewidth=0))
        axes.text(x + 13, 10.5, words, va="center", fontsize=10)


def count_parts(name: str) -> tuple[int, int, int, int]:
    """Columns, rows, integers, and terms of degree 2 or more of a formulation of `SIZED`.

    A row of degree 2 has one such term.
    """
    instance = replace(cf.sample(*SIZED), orthogonal=FORMULATIONS[name].orthogonal)
    jumps = {"p": cf.greedy_field(instance).p} if FORMULATIONS[name].fixed else {}
    problem = cf.formulate(instance, name, **jumps)
    counts = problem_counts(problem)
    kinds = ("quadratic", "higher", "general")
    terms = sum(counts[f"objective_{kind}_terms"] for kind in kinds) + counts["quadratic_constraints"]
    return problem.n_columns, problem.n_rows, int(problem.integer.sum()), terms


SHEETS: Final[dict[str, tuple[Callable[[], list[Mark]], float, float]]] = {
    "front": (front, 2 * PAGE, 191.0),
    "first_strokes": (strokes, PAGE, 290.0),
    "first_crosses": (crosses, PAGE, 202.0),
    "first_singularity": (singularity, PAGE, 274.0),
    "first_surface": (surface, PAGE, 284.0),
}
"""File -> function that returns the marks, width and height in points."""
FIGURES: Final[dict[str, tuple[Callable[[Figure], None], float, float, float]]] = {
    "first_jump": (jump, PAGE / 72, 2.35, 13),
    "formulation_sizes": (sizes, PAGE / 72, 15 * ROW / 72, 10),
    "math_strip": (strip, PAGE / 72, 5.4, 11),
    "math_facets": (facets, PAGE / 72, 2.5, 10),
    "math_singularities": (singular, PAGE / 72, 2.6, 10),
}
"""File -> drawing function, width and height in inches, points of its words."""


def draw(folder: Path) -> None:
    """Write every figure as SVG, with equal bytes each time."""
    for name, (marks_of, wide, high) in SHEETS.items():
        (folder / f"{name}.svg").write_bytes(sheet_svg(page_of(marks_of(), wide, high)))
    for name, (paint_figure, width, height, points) in FIGURES.items():
        with fixed_settings(STYLE | {"font.size": points}):
            figure = Figure(
                figsize=(width, height), layout="constrained" if name.startswith("math") else "none"
            )
            paint_figure(figure)
            figure.savefig(folder / f"{name}.svg", metadata={"Date": None, "Creator": None})
