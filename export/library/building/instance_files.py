"""The files of an instance: the instance, its known fields and certificates, and the document last."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from ....models.field.field import NORMS, CrossField
from ....models.field.file import field_to_json
from ....models.instance.file import instance_to_json
from ....models.instance.instance import Instance
from ....models.sketch.random_strokes import RAGGED_SHARE
from ...formats.registry import program_version
from ..documents.documents import ABOUT_FORMAT, VERSION, about_file, document_bytes
from ..ledger.known_points import InstancePoints
from ..ledger.ledger import SubmittedCertificate
from ..ledger.points import ROLES, KnownField, check_certificate, least_energy
from ..plan.instances import kind_of, make_instance
from ..plan.recipe import InstanceRecipe
from .fields import given_fields, search_fields

Files = dict[str, bytes]  # by name, in the order of writing
_SIDES: Final = ("height", "width", "vertices", "euler_characteristic")  # of a grid; of a mesh


@dataclass(frozen=True, eq=False)
class InstanceTask:
    """Everything that the files of an instance depend on, for any process, and its digest.

    given: points that replace a search. fields, certificates: those of the ledger, the latter with the
    contents of their files.
    """

    recipe: InstanceRecipe
    given: InstancePoints | None
    fields: tuple[KnownField, ...]
    certificates: tuple[tuple[SubmittedCertificate, bytes], ...]
    sha256: str

    @property
    def name(self) -> str:
        """Name of the instance."""
        return self.recipe.name


def make_instance_files(task: InstanceTask) -> Files:
    """Make the files of an instance; return their contents by name, the document last.

    Raises NoStrokeError if its size is too small.
    """
    instance = make_instance(task.recipe)
    points = task.given if task.given and task.given.instance == instance.sha256 else None
    sent = [
        check_certificate(data, row.file, instance)
        for row, data in task.certificates
        if row.instance_sha256 == instance.sha256
    ]
    baseline, low, proven = (
        given_fields(points, instance, task.recipe) if points else search_fields(instance, task.recipe, sent)
    )
    every = [
        baseline,
        *low,
        *(known for known in task.fields if known.field.instance.sha256 == instance.sha256),
        *(certificate.known for certificate in sent),  # last: an equal field that was submitted earlier stays
    ]
    # The ledger does not decide on the baseline, whose jumps are the data of `qp-fixed`.
    chosen = {"baseline": baseline} | {f"least_{norm}": least_energy(every, norm) for norm in NORMS}
    files: Files = {f"{task.name}.instance.json": instance_to_json(instance).encode()}
    fields: dict[str, dict[str, Any]] = {}
    for role in reversed(ROLES):
        known = chosen[role]
        same = next((earlier for earlier in fields if _are_equal(chosen[earlier].field, known.field)), None)
        name = f"{task.name}{ROLES[same or role]}.field.json"
        if same is None:
            files[name] = field_to_json(known.field)
        energies = {f"energy_{norm}norm": known.field.energy(norm).total for norm in NORMS}
        fields[role] = {"file": name, **known.origin, **energies}
    certificates = {}
    for norm in NORMS:
        if of_norm := [certificate for certificate in (*sent, *proven) if certificate.norm == norm]:
            best = max(of_norm, key=lambda certificate: certificate.facts["bound"])
            files[best.file] = best.data
            certificates[str(norm)] = {"file": best.file, **best.facts}
    about = _instance_document(instance, task, {role: fields[role] for role in ROLES})
    about |= {"certificates": certificates} if certificates else {}
    return files | {about_file(task.name): document_bytes(about)}


def _are_equal(first: CrossField, second: CrossField) -> bool:
    pairs = ((first.alpha, second.alpha), (first.beta, second.beta), (first.p, second.p))
    return all(bool((one == other).all()) for one, other in pairs)


def _instance_document(instance: Instance, task: InstanceTask, fields: dict[str, Any]) -> dict[str, Any]:
    recipe, given = task.recipe, task.given.sha256 if task.given else None
    stated = {"origin": recipe.sketch.origin, "added": recipe.sketch.added}
    return ({"given": given} if given else {}) | {
        "format": ABOUT_FORMAT,
        "version": VERSION,
        "name": task.name,
        "family": recipe.sketch.name,
        "title": recipe.sketch.title,
        "rung": recipe.rung,
        "generator": program_version(),
        "source": _source_facts(instance, recipe),
        **{key: value for key, value in stated.items() if value},
        "instance": {
            "file": f"{task.name}.instance.json",
            "sha256": instance.sha256,
            f"{instance.domain.kind}s": instance.domain.size,
            "strokes": len(instance.theta),
            "pairs": len(instance.domain.first),
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
        sketch = recipe.sketch
        parameters |= {"generator": "NumPy PCG64", "mask": sketch.what, "stroke_share": sketch.share}
        parameters |= {"ragged_share": RAGGED_SHARE} if sketch.what == "ragged" else {}
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
