"""Build of a library: missing files are written, and complete ones are kept.

There are two kinds of tasks: an instance with its fields, then each of its entries. Only this module writes
their files, the file that marks completion last. So an interrupted build continues.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from ....models.errors import CrossfieldError, InputError, NoStrokeError
from ....models.processes.deadline import Progress, silent
from ....models.storage import make_folder, write_bytes
from ....models.written_files import sha256_of
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
from ..ledger.known_points import NO_POINTS, PointSource, given_points_of, read_points
from ..ledger.ledger import LEDGER, Ledger, Record, merge_ledgers, read_ledger, write_ledger
from ..plan.recipe import InstancePlan, plan_library, without_skipped
from ..plan.spec import Spec
from .entry_files import make_entry
from .executor import Tasks, open_tasks
from .index import GENERAL, write_index
from .instance_files import make_instance_files
from .tasks import BuildInputs, Files


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
    folder, is_new = Path(folder), not Path(folder).exists()
    make_folder(folder)
    try:
        with library_lock(folder, "a build of the library", progress):
            _claim_targets(folder, plans, force=force)
            points = read_points(spec.points) if spec.points else NO_POINTS
            ledger = read_ledger(spec.ledger.parent, spec.ledger.name) if spec.ledger else Ledger(folder)
            return build_locked(
                spec, folder, ledger, points, jobs=jobs, scheduler=scheduler, progress=progress
            )
    except BaseException:
        if is_new:
            with suppress(OSError):  # it may contain complete files for the next build
                folder.rmdir()
        raise


def rebuild(folder: str | Path, *, jobs: int = 1, progress: Progress = silent) -> Library:
    """Bring a library up to date with its ledger; only files that the change affects are written again."""
    folder = read_library(folder).folder
    with library_lock(folder, "a build of the library", progress):
        spec, ledger = read_library(folder).spec, read_ledger(folder)
        _claim_targets(folder, plan_library(spec))
        return build_locked(spec, folder, ledger, given_points_of(folder), jobs=jobs, progress=progress)


def build_locked(
    spec: Spec,
    folder: Path,
    ledger: Ledger,
    points: PointSource,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> Library:
    """Build a library as `build` does, with the records of another ledger, under the lock of the caller.

    The ledger is written last, so a refused build has none.
    """
    plans = plan_library(spec)
    entries = [entry.name for planned in plans for entry in planned.entries]
    ledger = merge_ledgers(folder, ledger, entries, [planned.recipe.name for planned in plans])
    with open_tasks(jobs, scheduler) as tasks:
        work = _Build(folder, BuildInputs(ledger, plans, points), tasks, progress)
        for planned in sorted(plans, key=lambda planned: -planned.recipe.size):
            work.begin(planned)  # the last task runs first: small ones, whose faults show at once
        tasks.run()
    complete = without_skipped(plans, work.skipped)
    if not any(planned.entries for planned in complete):
        for error in work.failed.values():
            raise error
        name, reason = next(iter(work.skipped.items()))
        raise InputError(f"none of its instances can be made; {name}: {reason}")
    write_ledger(ledger)
    progress("index and checksums")
    write_index(
        folder, spec, complete, dict(sorted(work.skipped.items())), failed=work.failed, earlier=work.sums
    )
    return replace(read_library(folder), failed=work.failed)


def _claim_targets(folder: Path, plans: Iterable[InstancePlan], *, force: bool = False) -> None:
    """Raise OutputError for files of the user that are in the way of a build, unless it is forced."""
    stems = {entry.name for planned in plans for entry in planned.entries}
    for planned in plans:
        stems |= {planned.recipe.name, f"cf_{planned.recipe.sketch.name}"}
    claim_targets(folder, stems, GENERAL, force=force)


def has_unbuilt_records(library: Library) -> bool:
    """Whether the ledger differs from SHA256SUMS: a change was interrupted before its rebuild."""
    return _known_checksums(library.folder).get(LEDGER) != sha256_of(library.folder / LEDGER)


def records_of_changed_problems(library: Library) -> list[Record]:
    """Return the ledger's records that no longer count because the problem of their entry has changed."""
    records = read_ledger(library.folder).records
    names = {record.entry for record in records} & set(library.document["entries"])
    problems = {name: library.entry(name)["problem_sha256"] for name in names}
    return [
        record
        for record in records
        if problems.get(record.entry, record.problem_sha256) != record.problem_sha256
    ]


def _known_checksums(folder: Path) -> dict[str, str]:
    """The checksums of an earlier build; none without a list, or with a damaged one."""
    with suppress(CrossfieldError):
        return read_checksums(folder)
    return {}


def _attempt(make: Callable[[Any], Files], task: Any) -> Files | CrossfieldError:
    """Return the files of a task, or its error, which does not end the build."""
    try:
        return make(task)
    except CrossfieldError as error:
        return error


class _Build:
    """A build in progress: its tasks and the number of finished entries."""

    def __init__(self, folder: Path, inputs: BuildInputs, tasks: Tasks, progress: Progress) -> None:
        self.folder, self.inputs, self.tasks, self.progress = folder, inputs, tasks, progress
        self.total, self.done = sum(len(planned.entries) for planned in self.inputs.plans), 0
        self.skipped: dict[str, str] = {}  # instances and entries that are not made, and the reasons
        self.failed: dict[
            str, CrossfieldError
        ] = {}  # those of them that are not too small and await no certificate
        self.sums = _known_checksums(folder)

    def begin(self, planned: InstancePlan) -> None:
        """Schedule an instance unless it is complete, and then its entries."""
        try:
            task = self.inputs.instance_task(planned)
        except CrossfieldError as error:
            self._omit(planned.recipe.name, error, len(planned.entries))
            return
        about = self._complete_document(about_file(task.name), task.sha256, read_about, files_of_instance)
        if about is not None:
            self._schedule_entries(planned, about)
            return

        def finish(files: Files | CrossfieldError) -> None:
            if isinstance(files, CrossfieldError):
                self._omit(task.name, files, len(planned.entries))
                return
            self._write(files)
            about = json.loads(files[about_file(task.name)])
            if task.given and task.given.instance != about["instance"]["sha256"]:
                self.progress(f"{task.name}: the points given are of another instance; searched for others")
            self._schedule_entries(planned, about)

        self.progress(f"points and bounds of {task.name}")
        self.tasks.add(partial(_attempt, make_instance_files), task, finish)

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

    def _schedule_entries(self, planned: InstancePlan, about: dict[str, Any]) -> None:
        for recipe in planned.entries:
            if reason := recipe.reason_to_skip(about):
                self.total -= 1
                self.skipped[recipe.name] = reason
                self.progress(f"skipped: {recipe.name}: {reason}")
        for task in reversed(list(self.inputs.entry_tasks(planned, about, self.folder))):
            if self._complete_document(f"{task.name}.json", task.sha256, read_sidecar, files_of_entry):
                self.done += 1
            else:
                self.tasks.add(partial(_attempt, make_entry), task, self._finish(task.name))

    def _omit(self, name: str, error: CrossfieldError, entries: int) -> None:
        """Keep an instance or entry out of the library, and the reason."""
        self.total -= entries
        self.skipped[name] = str(error).removeprefix(f"{name}: ")
        if not isinstance(error, NoStrokeError):
            self.failed[name] = error
        self.progress(f"omitted: {name}: {self.skipped[name]}")

    def _finish(self, name: str) -> Callable[[Files | CrossfieldError], None]:
        def finish(files: Files | CrossfieldError) -> None:
            if isinstance(files, CrossfieldError):
                self._omit(name, files, 1)
                return
            self._write(files)
            self.done += 1
            self.progress(f"{self.done} of {self.total} entries: {name}")

        return finish

    def _write(self, files: Files) -> None:
        for name, data in files.items():
            write_bytes(self.folder / name, data)
