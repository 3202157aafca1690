"""Tasks of a build: an instance, or an entry, with everything that its files depend on.

A task is a value that any process can work on; its digest tells whether files of an earlier build are
the same.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from ....models.field.file import field_of_json
from ....models.storage import read_bytes
from ...formats.registry import program_version
from ..documents.documents import files_of_instance
from ..ledger.known_points import NO_POINTS, InstancePoints, PointSource
from ..ledger.ledger import Ledger, Record
from ..ledger.points import METHOD, KnownField, Provenance, provenance_by
from ..plan.recipe import EntryRecipe, InstancePlan, InstanceRecipe, digest

Files = dict[str, bytes]  # by name, in the order of writing


@dataclass(frozen=True)
class SubmittedField:
    """A field of the ledger: bytes of its file and provenance."""

    data: bytes
    provenance: Provenance

    def known(self) -> KnownField:
        """Return the field."""
        return KnownField(field_of_json(self.data), self.provenance)


@dataclass(frozen=True)
class SubmittedProof:
    """A certificate of the ledger: name and bytes of its file, its instance and its submitter."""

    file: str
    data: bytes
    instance_sha256: str
    provenance: Provenance


@dataclass(frozen=True)
class InstanceTask:
    """The task of an instance: its recipe, given points, and the fields and certificates of the ledger."""

    recipe: InstanceRecipe
    fields: tuple[SubmittedField, ...] = ()
    given: InstancePoints | None = None
    proofs: tuple[SubmittedProof, ...] = ()

    @property
    def name(self) -> str:
        """Name of the instance."""
        return self.recipe.name

    @property
    def sha256(self) -> str:
        """Digest of everything that its files depend on."""
        fields = [[hashlib.sha256(field.data).hexdigest(), asdict(field.provenance)] for field in self.fields]
        points = [self.given.sha256] if self.given and self.given.sha256 else []
        proofs = [[proof.file, asdict(proof.provenance)] for proof in self.proofs]
        return digest([program_version(), self.recipe.document(), fields, *points, *proofs])


@dataclass(frozen=True)
class EntryTask:
    """The task of an entry: its recipe, and the document and files of its instance.

    records, fields: of all entries of the instance in the ledger; relatives: its plain entries.
    """

    recipe: EntryRecipe
    about: dict[str, Any]
    files: Files
    records: tuple[Record, ...] = ()
    fields: tuple[SubmittedField, ...] = ()
    relatives: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the entry."""
        return self.recipe.name

    @property
    def sha256(self) -> str:
        """Digest of everything that its files depend on."""
        fields = [hashlib.sha256(field.data).hexdigest() for field in self.fields]
        files = {name: hashlib.sha256(data).hexdigest() for name, data in self.files.items()}
        records = [asdict(record) for record in self.records]
        recipe = self.recipe.document()
        return digest([program_version(), recipe, self.about, files, records, fields, self.relatives])

    @property
    def certificate(self) -> dict[str, Any] | None:
        """The facts about the certificate in the norm that the entry minimises; None without one."""
        facts: dict[str, Any] | None = self.about.get("certificates", {}).get(str(self.recipe.norm))
        return facts


class BuildInputs:
    """The inputs of a build, of which it makes tasks: plans, the ledger, and given points."""

    def __init__(
        self, ledger: Ledger, plans: Iterable[InstancePlan], points: PointSource = NO_POINTS
    ) -> None:
        self.ledger, self.plans, self.points = ledger, tuple(plans), points

    def instance_task(self, planned: InstancePlan) -> InstanceTask:
        """Return the task of an instance. Raises InputError, InstanceError for a damaged file."""
        name = planned.recipe.name
        return InstanceTask(planned.recipe, self._fields(planned), self.points(name), self._proofs(name))

    def entry_tasks(self, planned: InstancePlan, about: dict[str, Any], folder: Path) -> Iterator[EntryTask]:
        """Yield the tasks of its entries that can be made.

        Raises as `instance_task`, and InputError for a missing file.
        """
        files = {name: read_bytes(folder / name) for name in files_of_instance(about)}
        names, fields = {entry.name for entry in planned.entries}, self._fields(planned)
        records = tuple(record for record in self.ledger.records if record.entry in names)
        plain = tuple(entry.name for entry in planned.entries if not entry.tightened)
        for recipe in planned.entries:
            if not recipe.reason_to_skip(about):
                yield EntryTask(recipe, about, files, records, fields, plain)

    def _fields(self, planned: InstancePlan) -> tuple[SubmittedField, ...]:
        """The fields that the ledger has for the entries of an instance."""
        records = (self.ledger.record_with_field(entry.name) for entry in planned.entries)
        return tuple(self._field(record) for record in records if record is not None)

    def _field(self, record: Record) -> SubmittedField:
        self.ledger.read_field(record)  # an error here names the file
        provenance = Provenance(record.solver, record.version, record.seconds, record.by)
        return SubmittedField(self.ledger.read_file(str(record.point)), provenance)

    def _proofs(self, instance: str) -> tuple[SubmittedProof, ...]:
        """The certificates that the ledger has for an instance."""
        return tuple(
            SubmittedProof(
                row.file,
                self.ledger.read_file(row.file),
                row.instance_sha256,
                replace(provenance_by(METHOD), by=row.by),
            )
            for row in self.ledger.certificates
            if row.instance == instance
        )
