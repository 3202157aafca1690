"""The answer of the studio to a stroke: `python docs/bench studio`.

A drawing has an outline and curvature lines of half an ellipsoid, drawn with a trembling hand. One stroke is
added, and the CPU seconds of its new field and surface count, on the server and without the browser.
"""

from __future__ import annotations

import json
import statistics
from collections.abc import Sequence
from pathlib import Path
from time import process_time
from typing import Any, Final

import numpy as np
from crossfield.export.studio.views import field_step, surface_step
from crossfield.models.instance.domain import Floats
from machine import machine_facts
from make import replace_between, write_rows

STROKES: Final = (20, 200, 2000)
POINTS: Final = 50  # of a stroke
RUNS: Final = 5
CENTRE, AXES = np.array([400, 300]), np.array([330, 250])


def drawing(count: int, seed: int) -> dict[str, Any]:
    """A session of the studio with so many strokes."""
    random = np.random.default_rng(seed)
    turn = np.linspace(0, 2 * np.pi, 200)
    strokes = [stroke(np.column_stack([np.cos(turn), np.sin(turn)]), "cut")]
    while len(strokes) < count:
        x, y = 0.9 * random.uniform(-1, 1, 2)
        along = np.clip(x + np.linspace(-0.25, 0.25, POINTS), -0.95, 0.95)
        line = np.column_stack([along, y * np.sqrt(1 - along**2)])
        line = line[:, ::-1] if random.random() < 0.5 else line
        strokes.append(stroke(line + random.normal(0, 1e-3, line.shape), "line"))
    session = {"format": "crossfield-studio", "version": 1, "name": "many", "page": [0, 0, 800, 600]}
    return session | {"size": 48, "strokes": strokes}


def stroke(points: Floats, mark: str) -> dict[str, Any]:
    """A stroke of a session; points (k, 2) on the unit disc."""
    return {"points": np.round(CENTRE + AXES * points, 3).ravel().tolist(), "mark": mark}


def main(page: Path, _: Sequence[str]) -> None:
    """Measure, and replace the sentence of the page and its CSV file."""
    rows = []
    for count in STROKES:
        times = []
        for seed in range(RUNS + 1):  # the first one fills caches, and counts for nobody
            data = json.dumps(drawing(count + 1, seed)).encode()
            begin = process_time()
            _, drawn, field = field_step(data)
            middle = process_time()
            surface_step(drawn, field)
            times.append((middle - begin, process_time() - middle))
        field_time, surface_time = map(statistics.median, zip(*times[1:], strict=True))
        rows.append({"strokes": f"{count:,}", "field": f"{field_time:.2f}", "surface": f"{surface_time:.2f}"})
    write_rows("performance/studio.csv", rows)
    facts, last = machine_facts(), rows[-1]
    where = f"{facts['processor']}, Python {facts['python']}, load average {facts['load']:.1f}"
    seconds = f"{last['field']} for the field, {last['surface']} for the surface"
    text = f"CPU seconds among {last['strokes']} strokes: {seconds}. {where}. Medians of {RUNS} drawings."
    replace_between(page, "studio", text)
