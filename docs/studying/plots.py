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

from .errors import medians

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
Bars = tuple[list[float], list[float], list[float]]
"""Values, means and standard errors."""


@contextmanager
def open_panels(
    path: Path, panels: int, high: float = 3.4, wide: float = 10.0, *, stacked: bool = False
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


def error_by_gap(path: Path, panels: dict[str, dict[str, Line]]) -> None:
    """Error against the gap to the optimum: points by kind of field, and medians of bins."""
    with open_panels(path, len(panels), high=3.8) as axes:
        names = list(dict.fromkeys(name for kinds in panels.values() for name in kinds))
        looks = styles(names)
        for axis, (title, kinds) in zip(axes, panels.items(), strict=True):
            for name, (x, y) in kinds.items():
                look = {"color": looks[name]["color"], "marker": looks[name]["marker"]}
                axis.scatter(np.maximum(x, _ZERO), y, s=16, alpha=0.6, linewidths=0, label=name, **look)
            x, y = (
                np.concatenate([np.array(points[i]) for points in kinds.values()] or [[]]) for i in (0, 1)
            )
            centre, middle = medians(x / 100, y)
            axis.plot(
                np.maximum(100 * np.array(centre), _ZERO),
                middle,
                color="#000000",
                linewidth=2.2,
                label="median of bins",
            )
            axis.set(title=title, xscale="log", xlabel="energy above the proven optimum, %")
            axis.axhline(0, color="#888888", linewidth=0.8)
            axis.set_xlim(_ZERO / 1.5, max(1.5 * x.max(initial=0.0), 100))
            ticks = [tick for tick in (0.1, 1, 10, 100, 1000, 10000) if tick <= axis.get_xlim()[1]]
            axis.set_xticks([_ZERO, *ticks], ["0", *(f"{tick:g}" for tick in ticks)])
            axis.minorticks_off()
        axes[0].set_ylabel("error less that of the optimum, degrees")
        axes[-1].legend(*_all_of(axes), loc="center left", bbox_to_anchor=(1.0, 0.5))


_ZERO: Final = 0.01
"""Percent: smaller gaps are drawn here."""


def error_by_weight(path: Path, panels: dict[str, dict[str, Bars]]) -> None:
    """Mean error by weight, with standard errors over drawings; panels have the names of the weights."""
    with open_panels(path, len(panels), high=3.2) as axes:
        for axis, (title, lines) in zip(axes, panels.items(), strict=True):
            looks = styles(list(lines))
            ticks = sorted({value for x, _, _ in lines.values() for value in x})
            wide = ticks[-1] / ticks[0] if ticks else 1.0
            for place, (name, (x, y, bar)) in enumerate(lines.items()):
                beside = np.array(x) * wide ** (
                    _BESIDE * (place - (len(lines) - 1) / 2)
                )  # or bars hide others
                axis.errorbar(beside, y, yerr=bar, capsize=2, elinewidth=0.9, label=name, **looks[name])
            axis.set(xscale="log", xlabel=title, ylim=(0, None))
            axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
            axis.minorticks_off()
        axes[0].set_ylabel("error, degrees")
        axes[-1].legend(*_all_of(axes), loc="center left", bbox_to_anchor=(1.0, 0.5))


_BESIDE: Final = 0.0155
"""Share of the axis between the places of two lines at the same weight."""


def error_by_seconds(path: Path, panels: dict[str, dict[str, tuple[float, float, float]]]) -> None:
    """Error on hidden curves against seconds, a panel for each size, a mark for each way."""
    names = list(dict.fromkeys(name for ways in panels.values() for name in ways))
    looks = styles(names)
    with open_panels(path, len(panels), high=3.6, wide=11.0) as axes:
        for axis, (title, ways) in zip(axes, panels.items(), strict=True):
            for name, (x, y, bar) in ways.items():
                look = looks[name] | {"linestyle": "none", "markersize": 8}
                axis.errorbar([x], [y], yerr=[bar], capsize=2, label=name, elinewidth=0.8, **look)
            axis.set(title=title, xscale="log", xlabel="seconds, median", xlim=(3e-3, 60))
            axis.xaxis.set_major_formatter("{x:g}")
        low = min((y - bar for ways in panels.values() for _, y, bar in ways.values()), default=0)
        high = max((y + bar for ways in panels.values() for _, y, bar in ways.values()), default=1)
        for axis in axes:
            axis.set_ylim(low - 1, high + 1)
        axes[0].set_ylabel("error to hidden curves, degrees")
        axes[-1].legend(*_all_of(axes), loc="center left", bbox_to_anchor=(1.0, 0.5))


def _all_of(axes: Any) -> tuple[list[Any], list[str]]:
    """The legend of all panels, each name once."""
    handles: dict[str, Any] = {}
    for axis in axes:
        for handle, name in zip(*axis.get_legend_handles_labels(), strict=True):
            handles.setdefault(name, handle)
    return list(handles.values()), list(handles)
