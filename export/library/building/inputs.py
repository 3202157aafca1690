"""What each file of a library is made from, for building and verifying alike."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from ....models.storage import read_bytes
from ..ledger.given import Points, nothing
from ..ledger.ledger import Ledger, Record
from ..ledger.points import Provenance
from ..plan.recipe import InstancePlan
from .entry_task import Entry
from .instance_task import Preparation, Submitted


class Inputs:
    """The tasks of a library of these plans with this ledger and given points."""

    def __init__(self, ledger: Ledger, plans: Iterable[InstancePlan], points: Points = nothing) -> None:
        self.ledger, self.plans, self.points = ledger, tuple(plans), points
        self._relatives: dict[str, list[str]] = {}
        for each in self.plans:
            self._relatives.setdefault(_relation(each), []).extend(entry.name for entry in each.entries)

    def preparation(self, each: InstancePlan) -> Preparation:
        """The task of an instance. Raises InputError, InstanceError for a damaged field of the ledger."""
        return Preparation(each.recipe, self._submitted(each), self.points(each.recipe.name))

    def entries(self, each: InstancePlan, about: dict[str, Any], folder: Path) -> Iterator[Entry]:
        """The tasks of its entries. Raises as `preparation`, InputError for a file that is missing."""
        files = {facts["name"]: read_bytes(folder / facts["name"]) for facts in about["files"]}
        relatives, submitted = tuple(self._relatives[_relation(each)]), self._submitted(each)
        records = self._records(each)
        for recipe in each.entries:
            yield Entry(recipe, about, files, records, submitted, relatives)

    def _records(self, each: InstancePlan) -> tuple[Record, ...]:
        names = {entry.name for entry in each.entries}
        return tuple(record for record in self.ledger.records if record.entry in names)

    def _submitted(self, each: InstancePlan) -> tuple[Submitted, ...]:
        """The fields that the ledger keeps for the entries of an instance."""
        records = (self.ledger.with_point(entry.name) for entry in each.entries)
        return tuple(self._submission(record) for record in records if record is not None)

    def _submission(self, record: Record) -> Submitted:
        self.ledger.field(record)  # damage is told here, with the file's name
        provenance = Provenance(record.solver, record.version, record.seconds, record.by)
        return Submitted(read_bytes(self.ledger.path(record)), provenance)


def _relation(each: InstancePlan) -> str:
    """What instances share whose entries may be related: everything but the gauge."""
    return each.recipe.name.removesuffix("_box")
