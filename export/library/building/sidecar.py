"""The sidecar of an entry: all facts about it, as a JSON document."""

from __future__ import annotations

from typing import Any

from ....models.formulations.problem import Problem
from ...bundle.manifest import ENTRY_FORMAT, nonzero_jumps
from ...writing.curvature import probtype
from ..documents.citation import REFERENCES
from ..documents.documents import VERSION
from ..documents.statistics import problem_counts, problem_curvature
from ..ledger.points import BestPoint
from ..plan.equivalence import equivalent_entries
from ..plan.recipe import entry_name
from .tasks import EntryTask

_OF_INSTANCE = ("family", "title", "rung", "generator", "source", "instance")
_OF_SKETCH = ("origin", "added")  # absent if not stated


def sidecar_of(
    task: EntryTask,
    best: BestPoint,
    listed: list[dict[str, Any]],
    refused: dict[str, str],
    results: dict[str, Any],
) -> dict[str, Any]:
    """Return the sidecar of an entry.

    listed: facts about its files; refused: formats that cannot hold it, and why; results: of `entry_results`.
    """
    problem, about = best.problem, task.about
    inherited = {key: about[key] for key in _OF_INSTANCE}
    inherited |= {key: about[key] for key in _OF_SKETCH if key in about}
    facts = best.facts()
    points = {file["dialect"]: file["name"] for file in listed if file["format"] == "sol"}
    numbers = {key: facts.pop(key) for key in ("objective", "violation", "integrality")}
    return {
        "format": ENTRY_FORMAT,
        "version": VERSION,
        "name": task.name,
        **inherited,
        "formulation": problem.name,
        "paper": problem.formulation.paper,
        "options": problem.formulation.options.document,
        "jumps": nonzero_jumps(problem),
        **_tightening(task, problem),
        "problem_sha256": problem.sha256,
        "class": problem.problem_class,
        "probtype": probtype(problem),
        "convex": problem.is_convex,
        "counts": problem_counts(problem),
        "curvature": problem_curvature(problem),
        "files": listed,
        "refused": refused,
        "best": {**numbers, "point": points["miplib"], "nl_point": points.get("ampl"), **facts},
        **results,
        "equivalent": equivalent_entries(task.recipe, task.relatives),
        "licence": about.get("origin", {}).get("license"),
        "references": list(REFERENCES),
        "recipe_sha256": task.sha256,
    }


def _tightening(task: EntryTask, problem: Problem) -> dict[str, Any]:
    """The certificate of a tightened entry, and its plain entry; empty for others."""
    if problem.windows is None or task.certificate is None:
        return {}
    recipe = task.recipe
    plain = entry_name(recipe.instance, recipe.formulation, recipe.facet)
    facts = {"certificate": task.certificate["file"], "plain": plain, "windows": problem.tightened}
    return {"tightened": facts}
