"""The plots of the study: SVG, equal for equal rows, in colours for the colour-blind."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import cycle
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from crossfield.export.pictures.draw import fixed_settings
from matplotlib.figure import Figure

from .errors import quartiles

mpl.use("svg")

INK: Final = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""The palette of Okabe and Ito, without yellow, which is illegible on white paper."""
MARKS: Final = ("o", "s", "^", "D", "v", "P", "X", "*", "h")
DASHES: Final = ("-", "--", ":", "-.")
_STYLE: Final = {
    "svg.fonttype": "path",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "axes.axisbelow": True,
}
Line = tuple[list[float], list[float]]


@contextmanager
def open_panels(
    path: Path, panels: int, high: float, wide: float = 8.0, *, stacked: bool = False
) -> Iterator[Any]:
    """The axes of panels side by side, or stacked; the file is written at the end of the context."""
    with fixed_settings(_STYLE):
        figure = Figure(figsize=(wide, high), layout="constrained")
        figure.get_layout_engine().set(w_pad=0.1)
        yield np.atleast_1d(figure.subplots(*((panels, 1) if stacked else (1, panels))))
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, metadata={"Date": None, "Creator": None})


def styles(names: list[str]) -> dict[str, dict[str, Any]]:
    """A style for each name: colour, marker and dash all differ between neighbours."""
    looks = zip(cycle(INK), cycle(MARKS), cycle(DASHES), strict=False)
    return {
        name: {"color": ink, "marker": mark, "linestyle": dash, "markersize": 5, "linewidth": 1.6}
        for name, (ink, mark, dash) in zip(names, looks, strict=False)
    }


def error_by_gap(path: Path, panels: dict[str, dict[str, Line]], shown: tuple[str, ...]) -> None:
    """Error against the gap to the optimum: medians, middle halves and points, some kinds in colour."""
    looks = styles(["all fields", *shown])
    with open_panels(path, len(panels), high=6.2, wide=5.0, stacked=True) as axes:
        for axis, (title, kinds) in zip(axes, panels.items(), strict=True):
            x, y = (np.concatenate([np.array(line[k]) for line in kinds.values()] or [[]]) for k in (0, 1))
            axis.scatter(np.maximum(x, _ZERO), y, s=5, color="#888888", alpha=0.5, linewidths=0)
            for name in shown:
                look = {"color": looks[name]["color"], "marker": looks[name]["marker"]}
                gaps, more = kinds.get(name, ([], []))
                axis.scatter(np.maximum(gaps, _ZERO), more, s=14, alpha=0.8, linewidths=0, label=name, **look)
            centre, low, middle, high = quartiles(x / 100, y)
            at = np.maximum(100 * np.array(centre), _ZERO)
            axis.fill_between(at, low, high, color="#000000", alpha=0.15, label="middle half", linewidth=0)
            axis.plot(at, middle, color="#000000", linewidth=2.2, label="median")
            axis.set(title=title, xscale="log", xlabel="energy above the proven optimum, %")
            axis.set_ylabel("error above optimum's, degrees")
            axis.axhline(0, color="#888888", linewidth=0.8)
            axis.set_xlim(_ZERO / 1.5, max(1.5 * x.max(initial=0.0), 100))
            least, most = np.percentile(y, [1, 99]) if len(y) else (-1, 1)
            axis.set_ylim(least - 1, most + 1)
            ticks = [tick for tick in (0.1, 1, 10, 100, 1000, 10000) if tick <= axis.get_xlim()[1]]
            axis.set_xticks([_ZERO, *ticks], ["0", *(f"{tick:g}" for tick in ticks)])
            axis.minorticks_off()
        axes[0].figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)


_ZERO: Final = 0.01
"""Percent: smaller gaps are drawn here."""


def lines_by_value(path: Path, panels: dict[tuple[str, str], dict[str, Line]]) -> None:
    """Lines over a weight or a size, on a logarithmic axis; panels have the titles of their axes."""
    with open_panels(path, len(panels), high=0.8 + 2.2 * len(panels), wide=5.0, stacked=True) as axes:
        for axis, ((across, up), lines) in zip(axes, panels.items(), strict=True):
            looks = styles(list(lines))
            for name, (x, y) in lines.items():
                axis.plot(x, y, label=name, **looks[name])
            top = max(max(y) for _, y in lines.values())
            axis.set(xscale="log", xlabel=across, ylabel=up, ylim=(0, 1.08 * top))
            ticks = sorted({value for x, _ in lines.values() for value in x})
            axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
            axis.minorticks_off()
            axis.legend(ncols=1 + len(lines) // 5)
