"""Entries of the library that ships, by name: made on the spot from the known points.

Fields ship with their instances. A build makes the same instances from drawings, which takes longer.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ....models.arguments import check_choice
from ....models.errors import InputError, InstanceError, shortened
from ....models.processes.deadline import Progress, silent
from .table import TABLE, read_table

if TYPE_CHECKING:
    from ....models.field.field import CrossField
    from ....models.formulations.problem import Problem
    from ....models.instance.instance import Instance
    from ....models.proof.descent.record import Claim
    from ...formats.registry import Written
    from ..ledger.known_points import InstancePoints
    from ..ledger.ledger import Ledger
    from ..ledger.points import KnownField

SHIPPED: Final = Path(__file__).parents[1] / "plan" / TABLE
POINTS: Final = SHIPPED.parent / "known" / "points"  # as in the specification
_REMEDY: Final = "make the points again with `crossfield library build --search`"


@dataclass(frozen=True, eq=False)
class LibraryEntry:
    """An entry of the library that ships, without a build and without a network.

    Instance, problem and field are made when they are first used, and kept.

    Parameters
    ----------
    facts
        The entry's row of `entries.csv` by column, None for unknown values.

    """

    facts: Mapping[str, Any]

    def __repr__(self) -> str:
        return f"<LibraryEntry {self.name}: {self.status}, objective {self.objective:.6g}>"

    @property
    def name(self) -> str:
        """Name of the entry."""
        return str(self.facts["name"])

    @property
    def status(self) -> str:
        """Status of the entry: `optimal`, `claimed` or `open`."""
        return str(self.facts["status"])

    @property
    def objective(self) -> float:
        """Objective of the best known point."""
        return float(self.facts["objective"])

    @property
    def bound(self) -> float | None:
        """Best dual bound, None without one."""
        bound: float | None = self.facts["bound"]
        return bound

    @cached_property
    def instance(self) -> Instance:
        """The instance. Raises InputError, InstanceError for a damaged file."""
        from ....models.field.file import read_field

        return read_field(POINTS / f"{self.facts['instance']}.field.json").instance

    @cached_property
    def problem(self) -> Problem:
        """The problem. Raises InputError, InstanceError for a damaged file."""
        from ....models.formulations.catalogue import FORMULATIONS
        from ..plan.problems import formulate_entry

        formulation = self.facts["formulation"]
        jumps = self._points.field("baseline").field.p if FORMULATIONS[formulation].fixed else None
        problem = formulate_entry(self.instance, formulation, self.facts["facet"], jumps)
        if not self.facts["tightened"] or self.certificate is None:
            return problem
        from ..documents.documents import tightened_by

        return tightened_by(self.certificate, problem)

    @cached_property
    def field(self) -> CrossField:
        """The field of the best known point. Raises InputError, InstanceError for damaged points."""
        from ..ledger.points import ROLES, best_point

        known = [*(self._points.field(role) for role in ROLES), *self._submitted()]
        certified = self.certificate.field if self.facts["tightened"] and self.certificate else None
        return best_point(self.problem, known, certified).known.field

    @cached_property
    def certificate(self) -> Claim | None:
        """The checked certificate of the instance in the norm that the entry minimises; None without one.

        Raises InputError for a certificate that is refused.
        """
        from ....models.proof.certificate import read_certificate
        from ..plan.recipe import norm_minimised

        norm = norm_minimised(self.facts["formulation"], self.facts["facet"])
        stated = self._points.about.get("certificates", {}).get(str(norm))
        if stated is None:
            return None
        return read_certificate(POINTS / stated["file"], on=self.instance)

    def write(self, path: str | Path) -> Written:
        """Write the model file, with the same bytes as in a built library.

        Parameters
        ----------
        path
            File to write. Its suffix names the format, and a further `.gz` compresses it.

        Returns
        -------
        Written
            Format, the problem as the file holds it, and size and SHA-256 by file name.

        Raises
        ------
        UnsupportedByFormatError
            If the format cannot carry the problem.
        InputError
            For an unknown suffix.
        OutputError
            If a file cannot be written.

        """
        from ...formats.registry import write

        return write(self.problem, path)

    def write_set(self, folder: Path) -> list[str]:
        """Write the model files that a build writes, with manifest and instance; return the names of all.

        The manifest has the name of the entry, because several entries have one formulation. Raises
        OutputError.
        """
        from ...bundle.manifest import write_manifest
        from ..plan.spec import default_spec
        from .entry_files import write_models

        (rung,) = (rung for rung in default_spec().rungs if rung.name == self.facts["rung"])
        written, refused = write_models(self.problem, self.name, rung.formats, folder, compress=rung.compress)
        manifest = write_manifest(self.problem, written, refused, folder, self.name)
        models = [name for model in written for name in model.files]
        return [*models, manifest.path.name, manifest.document["instance"]["file"]]

    @cached_property
    def _points(self) -> InstancePoints:
        """The points that ship for the instance. Raises InstanceError for points of another one."""
        from ..documents.documents import about_file
        from ..ledger.known_points import read_instance_points

        points = read_instance_points(POINTS / about_file(self.facts["instance"]))
        if points.instance != self.instance.sha256:
            raise InstanceError(f"holds points of another instance; {_REMEDY}", file=POINTS)
        return points

    def _submitted(self) -> Iterable[KnownField]:
        """The fields of the ledger for the entries of the instance."""
        from ..ledger.points import KnownField

        for row in _rows().values():
            record = _ledger().record_with_field(row["name"])
            if record is not None and row["instance"] == self.facts["instance"]:
                field = _ledger().read_field(record)
                if field.instance.sha256 == self.instance.sha256:
                    yield KnownField.of(field, vars(record))


def entries(*names: str, rung: str | None = None) -> list[LibraryEntry]:
    """Entries of the library that ships, with their facts, in its order.

    Parameters
    ----------
    names
        Names of entries, such as `cf_mouse_n032_exact`; without any, all entries.
    rung
        Only entries of this class: `tiny`, `small`, `medium`, `large` or `mesh`.

    Returns
    -------
    list of LibraryEntry
        The entries. `facts` of each has the columns of `entries.csv`.

    Raises
    ------
    InputError
        For an unknown name, with similar ones, and for an unknown rung.

    """
    for name in names:
        if name not in _rows():
            near = get_close_matches(name, _rows(), 3)
            asked = f"is it {' or '.join(near)}?" if near else "crossfield.entries() lists them"
            raise InputError(f"the library that ships has no entry {shortened(name)!r}; {asked}")
    if rung is not None:
        from ..plan.spec import RUNGS

        check_choice("rung", rung, RUNGS)
    rows = _rows().values()
    return [
        LibraryEntry(row)
        for row in rows
        if rung in (None, row["rung"]) and (not names or row["name"] in names)
    ]


def write_entries(
    folder: str | Path,
    chosen: Sequence[LibraryEntry],
    *,
    force: bool = False,
    progress: Progress = silent,
) -> dict[str, list[str]]:
    """Write the files of entries as a build does, with manifests and instances that read answers back.

    force: whether to replace files of the user. Returns the names of the files by entry. Raises OutputError.
    """
    from ....models.storage import make_folder
    from ..documents.checksums import claim_targets

    target, written = make_folder(folder), {}
    claim_targets(target, {name for one in chosen for name in (one.name, one.facts["instance"])}, force=force)
    for number, one in enumerate(chosen, 1):
        progress(f"{number} of {len(chosen)} entries: {one.name}")
        written[one.name] = one.write_set(target)
    return written


@cache
def _rows() -> dict[str, dict[str, Any]]:
    return {row["name"]: row for row in read_table(SHIPPED)}


@cache
def _ledger() -> Ledger:
    from ..ledger.ledger import read_ledger

    return read_ledger(POINTS.parent)
