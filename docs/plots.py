"""Settings of plots: SVG, equal for equal numbers, in colours for the colour-blind."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl

mpl.use("svg")


@contextmanager
def fixed_settings(more: dict[str, Any]) -> Iterator[None]:
    """Constant settings of matplotlib, whatever the user's are, and some more."""
    settings = {"svg.hashsalt": "crossfield", "path.simplify": False}
    defaults = {key: value for key, value in mpl.rcParamsDefault.items() if not key.startswith("backend")}
    with mpl.rc_context(defaults | settings | more):
        yield
