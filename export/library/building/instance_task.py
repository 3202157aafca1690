"""The task of each instance: files of the instance and of its known fields.

A task is a function from values to the bytes of files, which the caller writes. It runs in any process.
"""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass
from typing import Any, Final

from ....models.errors import NoStrokeError
from ....models.field.field import CrossField
from ....models.field.file import field_of_json, field_to_json
from ....models.instance.file import instance_to_json
from ....models.instance.instance import Instance
from ....models.sketch.random_strokes import STROKE_SHARE
from ...formats.registry import generator
from ..documents.documents import ABOUT_FORMAT, VERSION, about_file, as_bytes
from ..documents.statistics import sizes
from ..ledger.given import Given
from ..ledger.points import (
    Known,
    Provenance,
    certified_by,
    least_energy,
)
from ..plan.recipe import NORMS, InstanceRecipe, digest
from ..plan.sources import instance_from, kind_of
from .fields import found_fields, given_fields

Files = dict[str, bytes]  # by name, in the order of writing

SUFFIXES: Final = {
    "baseline": ".baseline.field.json",
    "least_mixed": ".mixed.field.json",
    "least_1": ".l1.field.json",
    "least_2": ".field.json",
}
"""Suffixes of the files of fields by role; equal fields share the last file."""


@dataclass(frozen=True)
class Submitted:
    """A field of the ledger: bytes of its file and provenance."""

    data: bytes
    provenance: Provenance

    def known(self) -> Known:
        """Return the field."""
        return Known(field_of_json(self.data), self.provenance)


@dataclass(frozen=True)
class Evidence:
    """A certificate of a ledger: name and bytes of its file, its instance and its submitter."""

    file: str
    data: bytes
    instance_sha256: str
    provenance: Provenance


@dataclass(frozen=True)
class Preparation:
    """The task of an instance: its recipe, fields and certificates of the ledger, and given points."""

    recipe: InstanceRecipe
    submitted: tuple[Submitted, ...] = ()
    given: Given | None = None
    evidence: tuple[Evidence, ...] = ()

    @property
    def name(self) -> str:
        """Name of the instance."""
        return self.recipe.name

    @property
    def sha256(self) -> str:
        """Digest of everything that its files depend on."""
        submitted = [
            [hashlib.sha256(each.data).hexdigest(), asdict(each.provenance)] for each in self.submitted
        ]
        given = [] if self.given is None else [self.given.sha256]
        proofs = [[each.file, asdict(each.provenance)] for each in self.evidence]
        return digest([generator(), self.recipe.document(), submitted, *given, *proofs])


def prepared(task: Preparation) -> Files | NoStrokeError:
    """Return the files of an instance, its document last, or the error that its size is too small."""
    try:
        return files_of(task, instance_from(task.recipe))
    except NoStrokeError as error:
        return error


def files_of(task: Preparation, instance: Instance) -> Files:
    """Return the files of an instance that was made from the recipe of the task, its document last."""
    given = task.given if task.given and task.given.instance == instance.sha256 else None
    sent = [
        certified_by(each.data, each.file, instance, each.provenance)
        for each in task.evidence
        if each.instance_sha256 == instance.sha256
    ]
    baseline, low, proven = (
        given_fields(given, instance, task.recipe) if given else found_fields(instance, task.recipe, sent)
    )
    submitted = [each.known() for each in task.submitted]
    every = [
        baseline,
        *low,
        *(each for each in submitted if each.field.instance.sha256 == instance.sha256),
        *(each.known for each in sent),  # last, so that an equal field that was submitted earlier stays
    ]
    # The ledger does not decide on the baseline, whose jumps are the data of `qp-fixed`.
    chosen = {"baseline": baseline} | {f"least_{norm}": least_energy(every, norm) for norm in NORMS}
    files: Files = {f"{task.name}.instance.json": instance_to_json(instance).encode()}
    fields: dict[str, dict[str, Any]] = {}
    for role in reversed(SUFFIXES):
        known = chosen[role]
        same = next((other for other in fields if _same(chosen[other].field, known.field)), None)
        name = f"{task.name}{SUFFIXES[same or role]}"
        if same is None:
            files[name] = field_to_json(known.field)
        energies = {f"energy_{norm}norm": known.field.energy(norm).total for norm in NORMS}
        fields[role] = {"file": name, **asdict(known.provenance), **energies}
    certificates = {}
    for norm in NORMS:
        if of_norm := [each for each in (*sent, *proven) if each.norm == norm]:
            best = max(of_norm, key=lambda each: each.facts["bound"])
            files[best.file] = best.data
            certificates[str(norm)] = {"file": best.file, **best.facts}
    about = _about(instance, task, {role: fields[role] for role in SUFFIXES}, files)
    about |= {"certificates": certificates} if certificates else {}
    return files | {about_file(task.name): as_bytes(about)}


def _same(first: CrossField, second: CrossField) -> bool:
    pairs = ((first.alpha, second.alpha), (first.beta, second.beta), (first.p, second.p))
    return all(bool((one == other).all()) for one, other in pairs)


def _about(instance: Instance, task: Preparation, fields: dict[str, Any], files: Files) -> dict[str, Any]:
    given = {} if task.given is None else {"given": task.given.sha256}
    recipe = task.recipe
    stated = {"origin": recipe.sketch.origin.document(), "added": recipe.added, "split": recipe.split}
    return given | {
        "format": ABOUT_FORMAT,
        "version": VERSION,
        "name": task.name,
        "family": task.recipe.sketch.name,
        "title": task.recipe.sketch.title,
        "rung": task.recipe.rung,
        "generator": generator(),
        "source": _source(instance, task.recipe),
        **{key: value for key, value in stated.items() if value},
        "instance": {
            "file": f"{task.name}.instance.json",
            "sha256": instance.sha256,
            **sizes(instance),
        },
        "fields": fields,
        "files": [
            {"name": name, "bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
            for name, data in files.items()
        ],
        "recipe_sha256": task.sha256,
    }


def _source(instance: Instance, recipe: InstanceRecipe) -> dict[str, Any]:
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
        parameters |= {key: drawn[key] for key in ("strokes", "noise") if key in drawn}
    return {
        "sketch": recipe.sketch.what,
        "kind": kind_of(recipe),
        "description": recipe.sketch.title,
        "size": recipe.size,
        "height": instance.grid.height,
        "width": instance.grid.width,
        "gauge": recipe.gauge,
        "seed": recipe.seed,
        "parameters": parameters,
    }
