"""The first task of each instance: the instance itself and the fields that are known of it, as files.

A task is a function from values to the bytes of files, so that it runs in any process on any machine; who
started it writes the files.
"""

from __future__ import annotations

import hashlib
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from ....models.errors import NoStrokeError
from ....models.field.field import CrossField
from ....models.field.file import read_field, write_field
from ....models.instance.file import to_json
from ....models.instance.instance import Instance
from ....models.search.box_qp import fitted
from ...formats.registry import generator
from ..documents.documents import ABOUT_FORMAT, VERSION, as_bytes
from ..documents.statistics import sizes
from ..ledger.certificates import Certified, certified
from ..ledger.points import Known, Provenance, baseline_field, least_energy, ours, searched_field
from ..ledger.search_1norm import better_in_1norm
from ..plan.recipe import InstanceRecipe, digest
from ..plan.sources import RAGGED_SHARE, STROKE_SHARE, instance_from, kind_of

Files = dict[str, bytes]
"""Files by name, in the order in which they are to be written."""

ROLES: Final = {"baseline": ".baseline.field.json", "least_1": ".l1.field.json", "least_2": ".field.json"}
"""Fields of an instance and the ends of their files' names; equal ones share the last file."""


@dataclass(frozen=True)
class Submitted:
    """The field of a ledger: bytes of its file, and who found it."""

    data: bytes
    provenance: Provenance

    def known(self) -> Known:
        """The field."""
        with tempfile.TemporaryDirectory(prefix="crossfield-") as folder:
            path = Path(folder) / "submitted.field.json"
            path.write_bytes(self.data)
            return Known(read_field(path), self.provenance)


@dataclass(frozen=True)
class Preparation:
    """The task of an instance: its recipe, and the fields that the ledger has for its entries."""

    recipe: InstanceRecipe
    submitted: tuple[Submitted, ...] = ()

    @property
    def name(self) -> str:
        """Name of the instance."""
        return self.recipe.name

    @property
    def sha256(self) -> str:
        """Stands for all that its files depend on."""
        given = [[hashlib.sha256(each.data).hexdigest(), asdict(each.provenance)] for each in self.submitted]
        return digest([generator(), self.recipe.document(), given])


def about_file(instance: str) -> str:
    """Name of the file that says what is known of an instance; it is written last."""
    return f"{instance}.about.json"


def prepared(task: Preparation) -> Files | NoStrokeError:
    """The files of an instance as `prepare` has them, or why its size does not suit its sketch."""
    try:
        return prepare(task)
    except NoStrokeError as error:
        return error


def prepare(task: Preparation) -> Files:
    """The files of an instance: itself, fields, and last what is known of it; or InputError."""
    instance = instance_from(task.recipe)
    searched = searched_field(instance)
    proven = certified(searched.field) if task.recipe.prove and not len(instance.crossings) else None
    chosen = _chosen(instance, task, [searched, *([proven.known] if proven else [])])
    files: Files = {f"{task.name}.instance.json": to_json(instance).encode()}
    fields: dict[str, dict[str, Any]] = {}
    for role in reversed(ROLES):
        known = chosen[role]
        same = next((other for other in fields if _same(chosen[other].field, known.field)), None)
        name = f"{task.name}{ROLES[same or role]}"
        if same is None:
            files[name] = field_bytes(known.field)
        energies = {f"energy_{norm}norm": known.field.energy(norm).total for norm in (2, 1)}
        fields[role] = {"file": name, **asdict(known.provenance), **energies}
    certificate = _certificate(proven, task, files)
    about = _about(instance, task, {role: fields[role] for role in ROLES}, files) | certificate
    return files | {about_file(task.name): as_bytes(about)}


def _certificate(proven: Certified | None, task: Preparation, files: Files) -> dict[str, Any]:
    """What is told of the certificate, which is among the files now; nothing where there is none."""
    if proven is None:
        return {}
    name = f"{task.name}.certificate.npz"
    files[name] = proven.data
    return {"certificate": {"file": name, **proven.facts}}


def field_bytes(field: CrossField) -> bytes:
    """A field as the bytes of its JSON file."""
    with tempfile.TemporaryDirectory(prefix="crossfield-") as folder:
        return write_field(field, Path(folder) / "a.field.json").read_bytes()


def _chosen(instance: Instance, task: Preparation, low: list[Known]) -> dict[str, Known]:
    """The field of each role; not the ledger but the instance decides on the baseline, for `qp-fixed`.

    low: fields of low 2-norm energy, the searched one first.
    """
    baseline = baseline_field(instance)
    found = better_in_1norm(low[0].field, task.recipe.rung)
    staged = [Known(fitted(each.field), ours("two stages")) for each in found]
    submitted = [each.known() for each in task.submitted]
    known = [
        baseline,
        *low,
        *found,
        *staged,
        *(each for each in submitted if each.field.instance.sha256 == instance.sha256),
    ]
    return {"baseline": baseline, "least_1": least_energy(known, 1), "least_2": least_energy(known, 2)}


def _same(first: CrossField, second: CrossField) -> bool:
    pairs = ((first.alpha, second.alpha), (first.beta, second.beta), (first.p, second.p))
    return all(bool((one == other).all()) for one, other in pairs)


def _about(instance: Instance, task: Preparation, fields: dict[str, Any], files: Files) -> dict[str, Any]:
    return {
        "format": ABOUT_FORMAT,
        "version": VERSION,
        "name": task.name,
        "family": task.recipe.sketch.name,
        "title": task.recipe.sketch.title,
        "rung": task.recipe.rung,
        "generator": generator(),
        "source": source_of(instance, task.recipe),
        **stated_of(task.recipe),
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


def stated_of(recipe: InstanceRecipe) -> dict[str, Any]:
    """What the specification states of an instance: origin and the day on which it came into the library."""
    stated = {"origin": recipe.sketch.origin.document(), "added": recipe.added}
    return {key: value for key, value in stated.items() if value}


def source_of(instance: Instance, recipe: InstanceRecipe) -> dict[str, Any]:
    """What is told of where an instance comes from."""
    parameters: dict[str, Any] = {"w_strokes": instance.w_strokes, "w_beta": instance.w_beta}
    if recipe.sketch.kind == "random":
        parameters |= {"generator": "NumPy PCG64", "mask": recipe.sketch.what, "stroke_share": STROKE_SHARE}
        parameters |= {"ragged_share": RAGGED_SHARE} if recipe.sketch.what == "ragged" else {}
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
