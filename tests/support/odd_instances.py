"""Odd instances: masks in parts, parts without strokes, one pixel, extreme weights, both gauges."""

import numpy as np
from crossfield.models.instance.instance import MOST_WEIGHT, Instance

NORMS = [2, 1, "mixed"]
"""Norms, in turn by seed: with the gauges they make six combinations."""
SHAPES = [(1, 1), (1, 2), (2, 1), (1, 4), (2, 2), (2, 2), (2, 2), (2, 3), (3, 2), (1, 5), (3, 3)]
WEIGHTS = [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.05, 1.0, 20.0, 1e3, 1e4, 1e5, MOST_WEIGHT]


def odd_instance(seed, shape=None):
    """An instance, tiny unless it has a shape; every oddity appears in each block of some dozens of seeds."""
    rng = np.random.default_rng(seed)
    tiny = SHAPES[rng.integers(len(SHAPES))]
    mask = rng.random(tiny if shape is None else shape) < rng.choice([0.6, 1.0])
    mask[rng.integers(mask.shape[0]), rng.integers(mask.shape[1])] = True
    if rng.random() < 0.3:  # a part without strokes
        part = np.ones(tuple(rng.integers(1, 3, 2)), bool)
        apart = np.zeros((max(len(mask), len(part)), mask.shape[1] + 1 + part.shape[1]), bool)
        apart[: len(mask), : mask.shape[1]] = mask
        apart[: len(part), mask.shape[1] + 1 :] = part
        mask, most = apart, mask.shape[1]
    else:
        most = mask.shape[1]
    at = np.argwhere(mask)
    at = at[at[:, 1] < most]
    at = at[np.sort(rng.permutation(len(at))[: 1 + rng.integers(len(at))])]
    theta = rng.uniform(0, np.pi, len(at)) if rng.random() < 0.7 else rng.integers(0, 8, len(at)) * np.pi / 8
    w = 1 - rng.random(len(at)) if rng.random() < 0.8 else 10.0 ** -rng.uniform(0, 12, len(at))
    stroke, skew = WEIGHTS[rng.integers(len(WEIGHTS))], WEIGHTS[rng.integers(len(WEIGHTS))]
    gauge = ("strokes", "box")[seed // len(NORMS) % 2]
    return Instance.on_pixels(
        "odd", mask, at, theta, w, stroke_coefficient=stroke, skew_coefficient=skew, gauge=gauge
    )
