"""Runs that make a field of a drawing or a surface, with its error on a hidden curve or on the truth."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import crossfield as cf
import numpy as np
from crossfield.export.formats.registry import program_version
from crossfield.export.runs.methods import METHODS, Request
from crossfield.models.errors import CrossfieldError
from crossfield.models.field.field import CrossField, field_in_windows
from crossfield.models.instance.instance import Instance
from crossfield.models.search.box_qp import fit_in_box
from crossfield.models.sketch.samples import SAMPLES
from crossfield.models.smooth.polyvector import HOLDS

from .hidden import HiddenCurve
from .instances import curves, drawing, noisy_instance
from .rows import FAILED, Run

MOST_CURVES: Final = 8
"""Number of curves of a drawing that are hidden in turn, the longest ones."""
PERTURBED: Final = "perturbed"
SHARES: Final = (0.02, 0.1, 0.3)
"""Shares of the pixels of a perturbed field that get another cross at random."""
Found = tuple[CrossField, dict[str, Any]]


def hidden(run: Run, folder: Path | None) -> HiddenCurve:
    """The curve that a run hides."""
    return curves(run.instance, run.size, MOST_CURVES, folder)[run.hidden]


@lru_cache(maxsize=4)
def surface(name: str, size: int) -> Any:
    """A surface with its true field."""
    return cf.analytic(name, size)


def instance_of(run: Run, folder: Path | None) -> Instance:
    """The instance of a run."""
    if run.instance in SAMPLES and SAMPLES[run.instance].kind == "analytic":
        instance = noisy_instance(surface(run.instance, run.size).instance, run.noise, run.seed)
    else:
        instance = drawing(run.instance, run.size, folder) if run.hidden < 0 else hidden(run, folder).rest
    return instance.with_weights(stroke_weight=run.w_strokes, skew_weight=run.w_beta)


def error(run: Run, field: CrossField, folder: Path | None) -> float | None:
    """Mean degrees from a field to the hidden curve, or to the true crosses; None without either."""
    if run.instance in SAMPLES and SAMPLES[run.instance].kind == "analytic":
        truth = surface(run.instance, run.size)
        return float(np.degrees(field.cross_error(truth.u_angle, truth.v_angle)).mean())
    return None if run.hidden < 0 else float(np.degrees(hidden(run, folder).deviation(field)))


def sizes(instance: Instance) -> dict[str, int]:
    """Numbers of pixels and pairs of an instance."""
    return {"pixels": instance.grid.size, "pairs": len(instance.grid.first)}


def energies(field: CrossField) -> dict[str, float]:
    """The energies of a field in both norms."""
    return {"energy_2": field.energy(2).total, "energy_1": field.energy(1).total}


def field_row(run: Run, folder: Path | None) -> dict[str, Any]:
    """The row of a field."""
    instance = instance_of(run, folder)
    facts: dict[str, Any] = {"version": program_version(), **sizes(instance)}
    begin = time.perf_counter()
    try:
        field, facts_of_field = _field(run, instance)
    except CrossfieldError as failure:
        spent = time.perf_counter() - begin
        return facts | {"status": FAILED, "seconds": spent, "note": str(failure)}
    facts |= {"status": "field", "seconds": time.perf_counter() - begin, **energies(field)}
    norm = 1 if run.norm == 1 else 2
    facts |= {"objective": field.energy(norm).total, "error": error(run, field, folder)}
    return facts | {"off": float(np.degrees(field.shape.mean_deviation))} | facts_of_field


def _field(run: Run, instance: Instance) -> Found:
    if run.way == "prove" and run.part == "quality":
        return _proven(run, instance)
    if run.way.startswith(PERTURBED):
        return perturbed_field(instance, float(run.way.split()[1]), run.seed), {}
    if run.way in PLAIN:
        return PLAIN[run.way](instance), {}
    if run.way == "search":
        return cf.search(instance, limits=cf.Limits(run.limit), jobs=1, seed=run.seed).field, {}
    return _by_method(run, instance)


def _proven(run: Run, instance: Instance) -> Found:
    proof = cf.prove(instance, norm=1 if run.norm == 1 else 2, limits=cf.Limits(run.limit, gap=0), jobs=1)
    return proof.field, {"status": proof.status, "bound": proof.bound, "note": proof.ended}


def _by_method(run: Run, instance: Instance) -> Found:
    """The last field of a method of the table."""
    with tempfile.TemporaryDirectory(prefix="crossfield-study-") as folder:
        request = Request(instance, Path(folder), cf.Limits(run.limit, threads=1))
        *_, answer = METHODS[run.way].find(request)
    if answer.proof is not None:
        return answer.field, {"status": answer.proof.status, "bound": answer.proof.bound}
    return answer.field, {}


def perturbed_field(instance: Instance, share: float, seed: int) -> CrossField:
    """A local optimum near the greedy field: random crosses at some pixels, best jumps, then best angles."""
    field, rng = cf.greedy_field(instance), np.random.default_rng([3, seed])
    chosen = rng.random(instance.grid.size) < share
    alpha = np.where(chosen, rng.uniform(0, np.pi, instance.grid.size), field.alpha)
    moved = field_in_windows(instance, alpha, np.where(chosen, 0.0, field.beta), field.p)
    return fit_in_box(moved.with_best_jumps())


PLAIN: Final[dict[str, Callable[[Instance], CrossField]]] = {
    "greedy": cf.greedy_field,
    "improved": lambda instance: cf.improved_field(cf.greedy_field(instance)),
    "power": lambda instance: fit_in_box(cf.power_field(instance)),
    "polyvector": lambda instance: fit_in_box(cf.polyvector_field(instance)),
    "bend": lambda instance: cf.bend_field(cf.polyvector_field(instance, hold=max(HOLDS))),
}
"""Ways without a time limit."""
