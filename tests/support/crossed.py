"""Instances in which two strokes meet at some pixels."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from cases import make_instance
from crossfield.models.instance.instance import Instance


def crossed(shape: str = "hole", gauge: str = "strokes", seed: int = 1, **given: Any) -> Instance:
    """A random instance with second strokes on about half of its stroke pixels, 30 degrees off or more."""
    instance = make_instance(shape, gauge, seed, **given)
    rng = np.random.default_rng(seed + 100)
    at = np.nonzero(rng.random(len(instance.theta)) < 0.5)[0]
    at = at if len(at) else np.array([0])
    return replace(
        instance,
        crossings=at,
        theta_cross=instance.theta[at] + rng.uniform(np.pi / 6, 5 * np.pi / 6, len(at)),
        w_cross=rng.uniform(0.1, 1, len(at)),
    )


def exchanged(instance: Instance) -> Instance:
    """The same instance with the first and the second stroke exchanged at every crossing."""
    theta, w, at = instance.theta.copy(), instance.w.copy(), instance.crossings
    theta[at], w[at] = instance.theta_cross, instance.w_cross
    return replace(instance, theta=theta, w=w, theta_cross=instance.theta[at], w_cross=instance.w[at])
