"""Build of a library: missing files are written, and complete ones are kept.

There are two kinds of tasks: an instance with its fields, then each of its entries. Only this module writes
their files, the file that marks completion last. So an interrupted build continues.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from ....models.errors import CrossfieldError, InputError, NoStrokeError
from ....models.processes.deadline import Progress, silent
from ....models.storage import make_folder, read_bytes, write_bytes
from ...formats.registry import program_version
from ..documents.checksums import claim_targets, is_intact, read_checksums
from ..documents.documents import (
    Library,
    about_file,
    files_of_entry,
    files_of_instance,
    read_about,
    read_library,
    read_sidecar,
)
from ..documents.lock import library_lock
from ..ledger.known_points import NO_POINTS, PointSource, points_of, read_points
from ..ledger.ledger import Ledger, merge_ledgers, read_ledger, write_ledger
from ..ledger.points import KnownField
from ..plan.recipe import InstanceRecipe, digest, plan_library, without_skipped
from ..plan.spec import Spec
from .entry_files import EntryTask, make_entry
from .executor import Tasks, open_tasks
from .index import GENERAL, write_index
from .instance_files import Files, InstanceTask, make_instance_files


def build(
    spec: Spec,
    folder: str | Path,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Library:
    """Build the library of a specification in a folder and return it.

    scheduler: address of a dask scheduler whose workers replace the processes; force: whether to replace
    files of the user; progress: called with a line per entry. The same specification gives the same bytes
    with any number of processes, and with points on every processor. Raises InputError; OutputError, before
    any work for files of the user that are in the way; BuildError.
    """
    plans = plan_library(spec)  # raises before there is a folder
    folder = make_folder(folder)
    with library_lock(folder, "a build of the library", progress):
        _claim_targets(folder, plans, force=force)
        points = read_points(spec.points) if spec.points else NO_POINTS
        ledger = read_ledger(spec.ledger.parent, spec.ledger.name) if spec.ledger else Ledger()
        options: dict[str, Any] = {"jobs": jobs, "scheduler": scheduler, "force": force}
        return build_locked(spec, folder, ledger, points, **options, progress=progress)


def rebuild(folder: str | Path, *, jobs: int = 1, progress: Progress = silent) -> Library:
    """Bring a library up to date with its ledger; its fields replace searches."""
    folder = Path(folder)
    with library_lock(folder, "a build of the library", progress):
        library = read_library(folder)
        _claim_targets(folder, plan_library(library.spec))
        points = points_of(library, strict=False)
        return build_locked(library.spec, folder, Ledger(), points, jobs=jobs, progress=progress)


def build_locked(
    spec: Spec,
    folder: Path,
    ledger: Ledger,
    points: PointSource,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Library:
    """Build a library as `build` does, also with the records of another ledger, under the lock of the caller.

    The ledger is written last, so a refused build has none. force: whether it may have lost files.
    """
    plans = plan_library(spec)
    entries = [entry.name for recipe in plans for entry in recipe.entries]
    earlier = read_ledger(folder, omit_missing=force)
    ledger = merge_ledgers(earlier, ledger, entries, [recipe.name for recipe in plans])
    sums: dict[str, str] = {}
    with suppress(CrossfieldError):  # without a list, or with a damaged one
        sums = read_checksums(folder)
    with open_tasks(jobs, scheduler) as tasks:
        work = _Build(folder, ledger, points, tasks, progress, sums, len(entries))
        for recipe in sorted(plans, key=lambda recipe: -recipe.size):
            work.begin(recipe)  # the last task runs first: small ones, whose faults show at once
        tasks.run()
    complete = without_skipped(plans, work.skipped)
    if not any(recipe.entries for recipe in complete):
        for error in work.failed.values():
            raise error
        name, reason = next(iter(work.skipped.items()))
        raise InputError(f"none of its instances can be made; {name}: {reason}")
    write_ledger(folder, ledger)
    progress("index and checksums")
    write_index(folder, spec, complete, dict(sorted(work.skipped.items())), failed=work.failed, earlier=sums)
    return replace(read_library(folder), failed=work.failed, notices=work.notices)


def _claim_targets(folder: Path, plans: Iterable[InstanceRecipe], *, force: bool = False) -> None:
    """Raise OutputError for files of the user that are in the way of a build, unless it is forced."""
    stems = {entry.name for recipe in plans for entry in recipe.entries}
    for recipe in plans:
        stems |= {recipe.name, f"cf_{recipe.sketch.name}"}
    claim_targets(folder, stems, GENERAL, force=force)


def _attempt(make: Callable[[Any], Files], task: Any) -> Files | CrossfieldError:
    """Return the files of a task, or its error, which does not end the build."""
    try:
        return make(task)
    except CrossfieldError as error:
        return error


@dataclass
class _Build:
    """A build in progress: its tasks, the number of finished entries, and checksums of an earlier build.

    skipped: instances and entries that are not made, and the reasons. failed: those with an error, unless
    their size leaves no strokes or they await a certificate.
    """

    folder: Path
    ledger: Ledger
    points: PointSource
    tasks: Tasks
    progress: Progress
    sums: dict[str, str]
    total: int
    done: int = 0
    skipped: dict[str, str] = field(default_factory=dict)
    failed: dict[str, CrossfieldError] = field(default_factory=dict)
    notices: list[str] = field(default_factory=list)

    def begin(self, recipe: InstanceRecipe) -> None:
        """Schedule an instance unless it is complete, and then its entries."""
        name = recipe.name
        try:
            task = self._instance_task(recipe)
        except CrossfieldError as error:
            self._omit(name, error, len(recipe.entries))
            return
        about = self._complete_document(about_file(name), task.sha256, read_about, files_of_instance)
        if about is not None:
            self._schedule_entries(recipe, about)
            return

        def finish(files: Files | CrossfieldError) -> None:
            if isinstance(files, CrossfieldError):
                self._omit(name, files, len(recipe.entries))
                return
            self._write(files)
            about = json.loads(files[about_file(name)])
            if task.given and task.given.instance != about["instance"]["sha256"]:
                self.notices.append(f"{name}: the points given are of another instance; searched for others")
            self._schedule_entries(recipe, about)

        self.progress(f"points and bounds of {name}")
        self.tasks.add(partial(_attempt, make_instance_files), task, finish)

    def _instance_task(self, recipe: InstanceRecipe) -> InstanceTask:
        """The task of an instance. Raises InputError, InstanceError for a damaged file."""
        points = self.points(recipe.name)
        fields, facts = self._submitted_fields(recipe)
        rows = [row for row in self.ledger.certificates if row.instance == recipe.name]
        inputs = [recipe.document(), facts, points.sha256 if points else None, [row.file for row in rows]]
        certificates = tuple((row, self.ledger.files[row.file]) for row in rows)
        return InstanceTask(recipe, points, fields, certificates, digest([program_version(), *inputs]))

    def _entry_tasks(self, recipe: InstanceRecipe, about: dict[str, Any]) -> Iterator[EntryTask]:
        """Yield the tasks of the entries that can be made. Raises InputError for a missing file."""
        files = {name: read_bytes(self.folder / name) for name in files_of_instance(about)}
        digests = {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}
        fields, facts = self._submitted_fields(recipe)
        names = {entry.name for entry in recipe.entries}
        records = tuple(record for record in self.ledger.records if record.entry in names)
        plain = tuple(entry.name for entry in recipe.entries if not entry.tightened)
        inputs = [program_version(), about, digests, list(map(vars, records)), facts, plain]
        for entry in recipe.entries:
            if not entry.reason_to_skip(about):
                sha256 = digest([vars(entry), *inputs])
                yield EntryTask(entry, about, files, records, fields, plain, sha256)

    def _submitted_fields(self, recipe: InstanceRecipe) -> tuple[tuple[KnownField, ...], list[Any]]:
        """The fields that the ledger has for the entries of an instance, and what identifies them."""
        known = [self.ledger.record_with_field(entry.name) for entry in recipe.entries]
        records = [record for record in known if record is not None]
        fields = tuple(KnownField.of(self.ledger.read_field(record), vars(record)) for record in records)
        contents = [self.ledger.files[str(record.point)] for record in records]
        digests = [hashlib.sha256(data).hexdigest() for data in contents]
        return fields, [[field.origin for field in fields], digests]

    def _complete_document(
        self,
        name: str,
        sha256: str,
        read: Callable[[Path], dict[str, Any]],
        files_of: Callable[[dict[str, Any]], Iterable[str]],
    ) -> dict[str, Any] | None:
        """A document if it was made from the same recipe, and it and its files are complete."""
        try:
            document = read(self.folder / name)
        except CrossfieldError:
            return None
        is_same = document["recipe_sha256"] == sha256
        complete = is_same and all(
            is_intact(self.folder, file, self.sums) for file in (name, *files_of(document))
        )
        return document if complete else None

    def _schedule_entries(self, recipe: InstanceRecipe, about: dict[str, Any]) -> None:
        for entry in recipe.entries:
            if reason := entry.reason_to_skip(about):
                self.total -= 1
                self.skipped[entry.name] = reason
        for task in reversed(list(self._entry_tasks(recipe, about))):
            if self._complete_document(f"{task.name}.json", task.sha256, read_sidecar, files_of_entry):
                self.done += 1
            else:
                self.tasks.add(partial(_attempt, make_entry), task, partial(self._finish_entry, task.name))

    def _omit(self, name: str, error: CrossfieldError, entries: int) -> None:
        """Keep an instance or entry out of the library, and the reason."""
        self.total -= entries
        self.skipped[name] = str(error).removeprefix(f"{name}: ")
        if not isinstance(error, NoStrokeError):
            self.failed[name] = error

    def _finish_entry(self, name: str, files: Files | CrossfieldError) -> None:
        if isinstance(files, CrossfieldError):
            self._omit(name, files, 1)
            return
        self._write(files)
        self.done += 1
        self.progress(f"{self.done} of {self.total} entries: {name}")

    def _write(self, files: Files) -> None:
        for name, data in files.items():
            write_bytes(self.folder / name, data)
