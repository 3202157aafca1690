"""Inputs of each file of a library, for building and verifying alike."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from ....models.storage import read_bytes
from ..ledger.given import Points, nothing
from ..ledger.ledger import Ledger, Record
from ..ledger.points import METHOD, Provenance, ours
from ..plan.recipe import InstancePlan
from .entry_task import Entry
from .instance_task import Evidence, Preparation, Submitted


class Inputs:
    """Tasks of a library with these plans, this ledger and given points."""

    def __init__(self, ledger: Ledger, plans: Iterable[InstancePlan], points: Points = nothing) -> None:
        self.ledger, self.plans, self.points = ledger, tuple(plans), points
        self._relatives: dict[str, list[str]] = {}
        for each in self.plans:
            self._relatives.setdefault(_relation(each), []).extend(entry.name for entry in each.entries)

    def preparation(self, each: InstancePlan) -> Preparation:
        """Return the task of an instance. Raises InputError, InstanceError for a damaged file."""
        name = each.recipe.name
        return Preparation(each.recipe, self._submitted(each), self.points(name), self._certificate(name))

    def entries(self, each: InstancePlan, about: dict[str, Any], folder: Path) -> Iterator[Entry]:
        """Yield the tasks of its entries. Raises as `preparation`, and InputError for a missing file."""
        files = {facts["name"]: read_bytes(folder / facts["name"]) for facts in about["files"]}
        relatives, submitted = tuple(self._relatives[_relation(each)]), self._submitted(each)
        names = {entry.name for entry in each.entries}
        records = tuple(record for record in self.ledger.records if record.entry in names)
        for recipe in each.entries:
            yield Entry(recipe, about, files, records, submitted, relatives)

    def _submitted(self, each: InstancePlan) -> tuple[Submitted, ...]:
        """The fields that the ledger keeps for the entries of an instance."""
        records = (self.ledger.with_point(entry.name) for entry in each.entries)
        return tuple(self._submission(record) for record in records if record is not None)

    def _submission(self, record: Record) -> Submitted:
        self.ledger.field(record)  # an error here names the file
        provenance = Provenance(record.solver, record.version, record.seconds, record.by)
        return Submitted(self.ledger.content(str(record.point), record.point_sha256), provenance)

    def _certificate(self, instance: str) -> Evidence | None:
        """The certificate that the ledger keeps for an instance."""
        kept = next((each for each in self.ledger.certificates if each.instance == instance), None)
        if kept is None:
            return None
        data = self.ledger.content(kept.file, kept.sha256)
        return Evidence(kept.file, data, kept.instance_sha256, replace(ours(METHOD), by=kept.by))


def _relation(each: InstancePlan) -> str:
    """The name without the gauge, which instances with related entries share."""
    return each.recipe.name.removesuffix("_box")
