"""The figures of docs/mathematics.md: `python docs/make.py figures`.

Every figure is computed.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from crossfield.export.pictures.draw import fixed_settings
from crossfield.models.field.field import CrossField
from crossfield.models.field.jumps import best_jumps
from crossfield.models.instance.angles import HALF, QUARTER
from crossfield.models.instance.instance import Instance
from matplotlib.figure import Figure

U, V, GREY, FILL = "#c0392b", "#2563a8", "#7a7a7a", "#dfe9f5"
STYLE: Final = {"font.family": "DejaVu Sans", "font.size": 11}


def line(axes: Any, angle: float, colour: str, name: str = "", at: tuple[float, float] = (0.0, 0.0)) -> None:
    """A line through a point, with its name at its end."""
    step = 0.42 * np.array([np.cos(angle), np.sin(angle)])
    begin, end = np.array(at) - step, np.array(at) + step
    axes.plot(*zip(begin, end, strict=True), color=colour, linewidth=2.6, solid_capstyle="round")
    axes.text(*(np.array(at) + 1.16 * step), name, color=colour, ha="center", va="center")


def arc(axes: Any, begin: float, end: float, radius: float, name: str) -> None:
    """An angle with its name."""
    angles = np.linspace(begin, end, 60)
    axes.plot(radius * np.cos(angles), radius * np.sin(angles), color=GREY, linewidth=1.2)
    middle = (begin + end) / 2
    axes.text(1.28 * radius * np.cos(middle), 1.28 * radius * np.sin(middle), name, ha="center", va="center")


def bare(axes: Any, title: str, *, equal: bool = True) -> None:
    """Remove frame and ticks."""
    axes.set_axis_off()
    axes.set_title(title, fontsize=11)
    if equal:
        axes.set_aspect("equal")


def cross(figure: Figure) -> None:
    """A cross and its angles; and two labels of one cross with the jump between them."""
    alpha, beta = np.radians(22), np.radians(14)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.35))
    bare(left, "a cross: two angles, two lines")
    left.plot([-0.46, 0.5], [0, 0], color=GREY, linewidth=0.8)
    for angle in (alpha, alpha + HALF):
        left.plot(
            [0, 0.5 * np.cos(angle)], [0, 0.5 * np.sin(angle)], color=GREY, linewidth=0.9, linestyle="--"
        )
    line(left, alpha + beta, U, "u")
    line(left, alpha + HALF - beta, V, "v")
    arc(left, 0, alpha, 0.26, "α")
    arc(left, alpha, alpha + beta, 0.34, "β")
    arc(left, alpha + HALF - beta, alpha + HALF, 0.34, "β")
    bare(right, "the same lines under two labels: jump p = 1")
    for x, (a, b) in ((0, (alpha, beta)), (1.35, (alpha + HALF, -beta))):
        line(right, a + b, U, "u", (x, 0))
        line(right, a + HALF - b, V, "v", (x, 0))
        words = f"α = {np.degrees(a):.0f}°, β = {np.degrees(b):.0f}°".replace("-", "−")
        right.text(x, -0.62, words, ha="center")
    right.annotate("", (0.9, 0), (0.45, 0), arrowprops={"arrowstyle": "->", "color": GREY})
    right.text(0.675, 0.07, "p = 1", ha="center")
    right.set(ylim=(-0.7, 0.62))


def strip(figure: Figure) -> None:
    """The strip of all crosses with its edges glued, and the windows of both gauges for a stroke."""
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1))
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
            axes.plot(degrees(beta), degrees(p1 * beta), color=V, linewidth=2.4, label="z = p1 β")
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
    shown[0].legend(loc="upper left", frameon=False, fontsize=9)


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
            axes.plot(0.5, 0.5, "o", color="#d62728", markersize=9)
            axes.text(0.5, 0.38, f"+{index:g}", ha="center", va="top", fontsize=10)
        axes.set(xlim=(-0.55, 1.55), ylim=(-0.55, 1.55))


FIGURES: Final[dict[str, tuple[Callable[[Figure], None], float, float]]] = {
    "cross": (cross, 7.6, 3.0),
    "strip": (strip, 8.6, 3.4),
    "facets": (facets, 7.6, 2.9),
    "singularities": (singular, 6.0, 3.1),
}
"""Name -> drawing function, width and height in inches."""


def draw(folder: Path) -> None:
    """Write every figure as SVG, with equal bytes each time."""
    for name, (paint, width, height) in FIGURES.items():
        with fixed_settings(STYLE):
            figure = Figure(figsize=(width, height), layout="constrained")
            paint(figure)
            figure.savefig(folder / f"math_{name}.svg", metadata={"Date": None, "Creator": None})
