"""Small instances, random fields and problems that several test modules share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import crossfield as cf
import numpy as np
from angles import QUARTER
from command_line import listed
from meshes import box, tetrahedron

FORMULATIONS = [row["name"] for row in listed()["formulations"]]
RIGHT = [name for name in FORMULATIONS if name.endswith(("-orthogonal", "-cycle"))]
"""The formulations of orthogonal crosses only."""
SKEWED = [name for name in FORMULATIONS if name not in RIGHT]
"""Those of crosses that may be skewed."""

OPTIONS = {
    "relax": [True],
    "facet": ["printed"],
    "stroke_norm": [1, 2],
    "beta_norm": [1, 2],
    "limits": [True],
}
"""Values of the options of formulations, other than their defaults or all."""

MASKS = {
    "hole": ["###", "#.#", "###"],
    "parts": ["##.#", "#..#", "..#."],
    "row": ["#####"],
    "column": ["#"] * 5,
    "pixel": ["#"],
    "far": ["." * 98 + "###"],
    "full": ["####"] * 3,
}
"""Shapes by name: with a hole, of several parts (one of them a single pixel), lines, one pixel,
three-digit columns, 3 x 4.
"""

MESHES = {"tetrahedron": tetrahedron, "box": box}
"""Closed meshes of 4 and 12 faces."""


def make_instance(shape: str = "hole", gauge: str = "strokes", seed: int = 1, **more: Any) -> cf.Instance:
    """A random instance on a mask or a mesh by name, some 40 % of its points with a stroke.

    Pairs on meshes have random weights.
    """
    rng = np.random.default_rng(seed)
    values: dict[str, Any] = {"stroke_coefficient": 1.5, "skew_coefficient": 1e-3, "gauge": gauge}
    mesh = MESHES[shape]() if shape in MESHES else None
    mask = None if mesh else np.array([[pixel == "#" for pixel in row] for row in MASKS[shape]])
    places = np.arange(mesh.size) if mesh else np.argwhere(mask)
    chosen = rng.random(len(places)) < 0.4
    chosen[rng.integers(len(places))] = True
    places = places[chosen]
    strokes = places, rng.uniform(0, np.pi, len(places)), rng.uniform(0.1, 1, len(places))
    if mesh is None:
        return cf.Instance.on_pixels("tiny", mask, *strokes, **values | more)
    values["pair_weights"] = rng.uniform(0.5, 2, len(mesh.first))
    return cf.Instance.on_faces("tiny", mesh, *strokes, **values | more)


def make_field(instance: cf.Instance, seed: int = 2) -> cf.CrossField:
    """A random field: angles anywhere within their bounds, any jump within its bounds.

    Orthogonal crosses have jumps that no single change improves, because their residuals have limits.
    """
    rng = np.random.default_rng(seed)
    alpha = rng.uniform(instance.alpha_lower, instance.alpha_upper)
    beta = rng.uniform(-QUARTER, QUARTER, instance.domain.size) * (not instance.orthogonal)
    field = cf.CrossField(instance, alpha, beta, rng.integers(instance.p_min, instance.p_max + 1))
    return cf.improved_field(field.with_best_jumps()) if instance.orthogonal else field


def make_problem(name: str, instance: cf.Instance, **options: Any) -> Any:
    """The problem of that formulation, with the jumps of the random field where they are data."""
    return cf.formulate(instance, name, p=make_field(instance).p if name == "qp-fixed" else None, **options)


def points_of(problem: Any, count: int = 20, seed: int = 3) -> np.ndarray:
    """Random points (count, columns), with no regard to bounds, rows and integrality."""
    return np.random.default_rng(seed).normal(size=(count, problem.n_columns))


def write_point(path: Path, problem: Any, point: np.ndarray) -> Path:
    """Write a list of names and values as any program might."""
    pairs = zip(problem.to_arrays().column_names.tolist(), point.tolist(), strict=True)
    path.write_text("".join(f"{name} {value!r}\n" for name, value in pairs))
    return path
