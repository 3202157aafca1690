"""The drawings and surfaces of the study of fields."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import crossfield as cf
import numpy as np
from crossfield.models.instance.instance import Instance
from crossfield.models.sketch.samples import SAMPLES
from drawings import drawings_of

from .hidden import HiddenCurve, hidden_curves
from .tracing import curves_of


def drawings(folder: Path | None) -> list[str]:
    """The drawn samples, and the names of the drawings in a folder."""
    own = [name for name, entry in SAMPLES.items() if entry.kind == "sketch"]
    if folder is None:
        return own
    return own + [sketch.name for sketch in drawings_of(folder)]


def surfaces() -> list[str]:
    """The samples whose true field is known."""
    return [name for name, entry in SAMPLES.items() if entry.kind == "analytic"]


@lru_cache(maxsize=8)
def drawing(name: str, size: int, folder: Path | None = None) -> Instance:
    """A drawing at a size, with the default weights."""
    return cf.sample(name, size) if name in SAMPLES else cf.read_sketch(_file(name, folder), size=size)


def _file(name: str, folder: Path | None) -> str | Path:
    return name if folder is None or name in SAMPLES else folder / name


@lru_cache(maxsize=8)
def curves(name: str, size: int, most: int, folder: Path | None = None) -> list[HiddenCurve]:
    """The longest curves of a drawing that can be hidden."""
    instance = drawing(name, size, folder)
    return hidden_curves(instance, curves_of(instance, _file(name, folder)), most)


def noisy_instance(instance: Instance, degrees: float, seed: int) -> Instance:
    """The instance with an independent error of that standard deviation on each stroke pixel."""
    error = np.random.default_rng(seed).standard_normal(len(instance.theta))
    return replace(instance, theta=instance.theta + np.radians(degrees) * error)
