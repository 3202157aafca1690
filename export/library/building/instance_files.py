"""The files of an instance: the instance, its known fields and certificates, and the document last."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Final

from ....models.field.field import CrossField
from ....models.field.file import field_to_json
from ....models.instance.file import instance_to_json
from ....models.instance.instance import Instance
from ....models.sketch.random_strokes import STROKE_SHARE
from ...formats.registry import program_version
from ..documents.documents import ABOUT_FORMAT, VERSION, about_file, document_bytes
from ..documents.statistics import instance_sizes
from ..ledger.points import check_certificate, least_energy
from ..plan.instances import kind_of, make_instance
from ..plan.recipe import NORMS, InstanceRecipe
from .fields import given_fields, search_fields
from .tasks import Files, InstanceTask

SUFFIXES: Final = {
    "baseline": ".baseline.field.json",
    "least_mixed": ".mixed.field.json",
    "least_1": ".l1.field.json",
    "least_2": ".field.json",
}
"""Suffixes of the files of fields by role; equal fields share the last file."""
_SIDES: Final = ("height", "width", "vertices", "euler_characteristic")  # of a grid; of a mesh


def make_instance_files(task: InstanceTask) -> Files:
    """Make the files of an instance; return their contents by name, the document last.

    Raises NoStrokeError if its size is too small.
    """
    instance = make_instance(task.recipe)
    points = task.given if task.given and task.given.instance == instance.sha256 else None
    sent = [
        check_certificate(proof.data, proof.file, instance, proof.provenance)
        for proof in task.proofs
        if proof.instance_sha256 == instance.sha256
    ]
    baseline, low, proven = (
        given_fields(points, instance, task.recipe) if points else search_fields(instance, task.recipe, sent)
    )
    submitted = [field.known() for field in task.fields]
    every = [
        baseline,
        *low,
        *(known for known in submitted if known.field.instance.sha256 == instance.sha256),
        *(certificate.known for certificate in sent),  # last: an equal field that was submitted earlier stays
    ]
    # The ledger does not decide on the baseline, whose jumps are the data of `qp-fixed`.
    chosen = {"baseline": baseline} | {f"least_{norm}": least_energy(every, norm) for norm in NORMS}
    files: Files = {f"{task.name}.instance.json": instance_to_json(instance).encode()}
    fields: dict[str, dict[str, Any]] = {}
    for role in reversed(SUFFIXES):
        known = chosen[role]
        same = next((earlier for earlier in fields if _are_equal(chosen[earlier].field, known.field)), None)
        name = f"{task.name}{SUFFIXES[same or role]}"
        if same is None:
            files[name] = field_to_json(known.field)
        energies = {f"energy_{norm}norm": known.field.energy(norm).total for norm in NORMS}
        fields[role] = {"file": name, **asdict(known.provenance), **energies}
    certificates = {}
    for norm in NORMS:
        if of_norm := [certificate for certificate in (*sent, *proven) if certificate.norm == norm]:
            best = max(of_norm, key=lambda certificate: certificate.facts["bound"])
            files[best.file] = best.data
            certificates[str(norm)] = {"file": best.file, **best.facts}
    about = _instance_document(instance, task, {role: fields[role] for role in SUFFIXES})
    about |= {"certificates": certificates} if certificates else {}
    return files | {about_file(task.name): document_bytes(about)}


def _are_equal(first: CrossField, second: CrossField) -> bool:
    pairs = ((first.alpha, second.alpha), (first.beta, second.beta), (first.p, second.p))
    return all(bool((one == other).all()) for one, other in pairs)


def _instance_document(instance: Instance, task: InstanceTask, fields: dict[str, Any]) -> dict[str, Any]:
    facts = {"given": task.given.sha256} if task.given and task.given.sha256 else {}
    recipe = task.recipe
    stated = {"origin": recipe.sketch.origin.document(), "added": recipe.added}
    return facts | {
        "format": ABOUT_FORMAT,
        "version": VERSION,
        "name": task.name,
        "family": task.recipe.sketch.name,
        "title": task.recipe.sketch.title,
        "rung": task.recipe.rung,
        "generator": program_version(),
        "source": _source_facts(instance, task.recipe),
        **{key: value for key, value in stated.items() if value},
        "instance": {
            "file": f"{task.name}.instance.json",
            "sha256": instance.sha256,
            **instance_sizes(instance),
        },
        "fields": fields,
        "recipe_sha256": task.sha256,
    }


def _source_facts(instance: Instance, recipe: InstanceRecipe) -> dict[str, Any]:
    """The facts about the source of an instance."""
    parameters: dict[str, Any] = {
        "w_strokes": instance.stroke_coefficient,
        "w_beta": instance.skew_coefficient,
    }
    if recipe.sketch.kind == "random":
        drawn = recipe.sketch.drawn
        share = drawn.get("share", STROKE_SHARE)
        parameters |= {"generator": "NumPy PCG64", "mask": recipe.sketch.what, "stroke_share": share}
        parameters |= {"ragged_share": drawn["mask_share"]} if recipe.sketch.what == "ragged" else {}
    sizes = instance.domain.facts
    return {
        "sketch": recipe.sketch.what,
        "kind": kind_of(recipe),
        "description": recipe.sketch.title,
        "size": recipe.size,
        **{key: sizes[key] for key in _SIDES if key in sizes},
        "gauge": recipe.gauge,
        "seed": recipe.seed,
        "parameters": parameters,
    }
