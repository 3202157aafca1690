"""Small instances, random fields and problems that several test modules share."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from crossfield.models.field.field import CrossField, field_in_windows
from crossfield.models.field.jumps import step_labels
from crossfield.models.formulations.catalogue import FORMULATIONS, list_formulations
from crossfield.models.formulations.problem import Problem, formulate, with_integers_fixed
from crossfield.models.instance.angles import HALF, QUARTER
from crossfield.models.instance.domain import Floats
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.least_squares import RightAngles
from meshes import box, tetrahedron

SKEWED = list_formulations()
"""The formulations of crosses that may be skewed."""
RIGHT = [name for name in FORMULATIONS if name not in SKEWED]
"""Those of orthogonal crosses only."""

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

_VARIANTS: list[tuple[str, dict[str, Any]]] = [
    *(
        (name, {"shape": shape})
        for name in ("minlp-quartic", "milp-mccormick", "qp-fixed")
        for shape in MASKS
        if shape != "hole"
    ),
    ("minlp-parity", {"shape": "pixel"}),
    ("miqcp-bilinear", {"shape": "parts"}),
    ("miqcp-bilinear-l1", {"shape": "pixel"}),
    ("miqp-exact", {"shape": "row"}),
    ("minlp-parity", {"relax": True}),
    ("minlp-quartic", {"relax": True}),
    ("minlp-cubic", {"relax": True, "gauge": "box"}),
    ("miqcp-bilinear", {"relax": True}),
    ("miqp-mccormick", {"relax": True}),
    ("milp-mccormick", {"relax": True}),
    ("miqp-exact", {"relax": True}),
    ("miqp-mccormick", {"facet": "printed"}),
    ("milp-mccormick", {"facet": "printed", "gauge": "box"}),
    ("miqcp-bilinear", {"stroke_norm": 1}),
    ("miqcp-bilinear-l1", {"beta_norm": 2}),
    ("miqp-mccormick", {"beta_norm": 1}),
    ("milp-mccormick", {"stroke_norm": 2, "beta_norm": 2}),
    *(
        (name, {"shape": "tetrahedron", "orthogonal": orthogonal})
        for name in FORMULATIONS
        for orthogonal in (True, False)
        if orthogonal or name in SKEWED
    ),
    ("milp-mccormick", {"shape": "box", "gauge": "box"}),
    ("miqp-exact", {"orthogonal": True}),
    ("milp-mccormick", {"orthogonal": True}),
    *((name, {"limits": True}) for name in ("miqp-orthogonal", "miqp-cycle")),
    *(("milp-cycle", {"shape": shape}) for shape in MASKS if shape != "hole"),
    ("miqp-cycle", {"relax": True}),
    ("milp-cycle", {"stroke_norm": 2}),
    *((name, {"pinned": True}) for name in FORMULATIONS if name != "qp-fixed"),
]

CASES: dict[str, tuple[str, dict[str, Any]]] = {
    " ".join([name, *(f"{key}={value}" for key, value in changes.items())]): (name, changes)
    for name, changes in [
        *(
            (name, {"gauge": gauge})
            for name in FORMULATIONS
            for gauge in ("strokes", "box")
            if gauge == "strokes" or "cycle" not in name
        ),
        *_VARIANTS,
    ]
}
"""Every formulation in both gauges, and the variants: formulation and what differs from the default."""

LOW_DEGREE = [
    label for label, (name, changes) in CASES.items() if name != "minlp-parity" or changes.get("orthogonal")
]
"""The cases that LP and MPS can hold."""


def make_instance(shape: str = "hole", gauge: str = "strokes", seed: int = 1, **more: Any) -> Instance:
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
        return Instance.on_pixels("tiny", mask, *strokes, **values | more)
    values["pair_weights"] = rng.uniform(0.5, 2, len(mesh.first))
    return Instance.on_faces("tiny", mesh, *strokes, **values | more)


def make_field(instance: Instance, seed: int = 2) -> CrossField:
    """A random field: angles anywhere within their bounds, any jump within its bounds.

    Orthogonal crosses have jumps that no single change improves, because their residuals have limits.
    """
    rng = np.random.default_rng(seed)
    alpha = rng.uniform(instance.alpha_lower, instance.alpha_upper)
    beta = rng.uniform(-QUARTER, QUARTER, instance.domain.size) * (not instance.orthogonal)
    field = CrossField(instance, alpha, beta, rng.integers(instance.p_min, instance.p_max + 1))
    if not instance.orthogonal:
        return field
    best = field.with_best_jumps()
    return best if instance.gauge == "box" else _settle(best)


def _settle(field: CrossField) -> CrossField:
    """The field of orthogonal crosses after changes of single integers, until none lowers the energy."""
    instance, terms = field.instance, RightAngles.of(field.instance)
    roots = np.sqrt(terms.weight)
    matrix = roots[:, None] * terms.matrix.toarray()

    def fit(z: Floats) -> tuple[float, Floats]:
        wanted = -roots * (terms.constant + HALF * z)
        alpha = np.linalg.lstsq(matrix, wanted)[0]
        return float(np.sum((matrix @ alpha - wanted) ** 2)), alpha

    steps = np.vstack([np.eye(len(roots)), -np.eye(len(roots))])
    z = np.append(field.p, np.zeros(len(instance.theta)))
    energy, lower = np.inf, z
    while fit(lower)[0] < energy - 1e-9:
        z, energy = lower, fit(lower)[0]
        lower = min((z + step for step in steps), key=lambda changed: fit(changed)[0])
    pairs, line = len(field.p), np.zeros(instance.domain.size, dtype=np.int32)
    line[instance.stroke_index] = z[pairs:]
    jumps = z[:pairs].astype(np.int32)
    alpha, beta, p = step_labels(instance.domain, fit(z)[1], np.zeros(len(line)), jumps, line)
    return field_in_windows(instance, alpha, beta, p)


def make_problem(name: str, instance: Instance, **options: Any) -> Problem:
    """The problem of that formulation, with the jumps of the random field where they are data."""
    return formulate(instance, name, p=make_field(instance).p if name == "qp-fixed" else None, **options)


@cache
def problem_of(label: str) -> Problem:
    """The problem of a case; it is the same object every time, so that its arrays are made once."""
    name, options = CASES[label]
    options = ({"orthogonal": True} if name in RIGHT else {}) | options
    pinned = options.pop("pinned", False)
    keys = [key for key in ("shape", "gauge", "orthogonal") if key in options]
    instance = make_instance(**{key: options.pop(key) for key in keys})
    problem = make_problem(name, instance, **options)
    return with_integers_fixed(problem, make_field(instance)) if pinned else problem


def points_of(problem: Problem, count: int = 20, seed: int = 3) -> Floats:
    """Random points (count, columns), with no regard to bounds, rows and integrality."""
    return np.random.default_rng(seed).normal(size=(count, problem.n_columns))


def names_of(matrix: np.ndarray[Any, Any]) -> list[str]:
    """Names as text, from rows of bytes padded with NUL."""
    return [bytes(row).rstrip(b"\0").decode() for row in matrix]
