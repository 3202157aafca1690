"""Build of a library: missing files are written, and complete ones are kept.

There are two kinds of tasks: an instance with its fields, then each of its entries. Only this module writes
their files, the file that marks completion last. So an interrupted build continues.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ....models.errors import CrossfieldError, InputError, NoStrokeError
from ....models.processes.deadline import Progress, silent
from ....models.storage import make_folder, read_bytes, sha256_of, write_bytes
from ..documents.documents import Library, about_file, are_whole, read_about, read_library, read_sidecar
from ..documents.lock import locked
from ..ledger.given import NO_POINTS, Points, points_of, read_points
from ..ledger.ledger import FILE as LEDGER
from ..ledger.ledger import Ledger, Record, merged, read_ledger, write_ledger
from ..plan.recipe import InstancePlan, plan, without
from ..plan.spec import Spec
from .entry_task import Inputs, make_entry
from .executor import Tasks, ahead, executor
from .index import SUMS, write_index
from .instance_task import Files, prepared


def build(
    spec: Spec,
    folder: str | Path,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> Library:
    """Build the library of a specification in a folder and return it.

    scheduler: address of a dask scheduler whose workers replace the processes; progress: called with a line
    per entry. The same specification gives the same bytes with any number of processes, and with points on
    every processor. Raises InputError, OutputError, BuildError.
    """
    plans = plan(spec)
    folder, is_new = Path(folder), not Path(folder).exists()
    make_folder(folder)
    try:
        with locked(folder, "a build of the library", progress):
            points = read_points(spec.points) if spec.points else NO_POINTS
            return _built(spec, plans, folder, points, jobs=jobs, scheduler=scheduler, progress=progress)
    except BaseException:
        if is_new:
            with suppress(OSError):  # it may contain complete files for the next build
                folder.rmdir()
        raise


def _built(
    spec: Spec,
    plans: Sequence[InstancePlan],
    folder: Path,
    points: Points,
    *,
    jobs: int,
    scheduler: str | None,
    progress: Progress,
) -> Library:
    """Build it under the lock of the caller; the ledger is written last, so a refused build has none."""
    for path in folder.glob(".*.part"):  # of a build that was killed
        path.unlink(missing_ok=True)
    entries = [entry.name for each in plans for entry in each.entries]
    other = Ledger(folder) if spec.ledger is None else read_ledger(spec.ledger.parent, spec.ledger.name)
    ledger = merged(folder, other, entries, [each.recipe.name for each in plans])
    with executor(jobs, scheduler) as chosen:
        tasks = Tasks(chosen, ahead(jobs, scheduler))
        work = _Build(folder, Inputs(ledger, plans, points), tasks, progress)
        for each in sorted(plans, key=lambda each: -each.recipe.size):
            work.begin(each)  # the last task runs first: small ones, whose faults show at once
        tasks.run()
    kept = without(plans, work.skipped)
    if not kept:
        name, reason = next(iter(work.skipped.items()))
        raise InputError(f"every grid is too coarse for its sketch; {name}: {reason}")
    write_ledger(ledger)
    progress("index and checksums")
    write_index(folder, spec, kept, dict(sorted(work.skipped.items())))
    return read_library(folder)


def rebuild(folder: str | Path, *, jobs: int = 1, progress: Progress = silent) -> Library:
    """Bring a library up to date with its ledger; only files that the change affects are written again."""
    folder = read_library(folder).folder
    with locked(folder, "a build of the library", progress):
        return rebuilt(folder, jobs=jobs, progress=progress)


def rebuilt(folder: Path, *, jobs: int = 1, progress: Progress = silent) -> Library:
    """Bring a library up to date as `rebuild` does, under the lock of the caller."""
    spec = read_library(folder).spec
    return _built(spec, plan(spec), folder, points_of(folder), jobs=jobs, scheduler=None, progress=progress)


def has_unbuilt_records(library: Library) -> bool:
    """Whether the ledger differs from SHA256SUMS: a change was interrupted before its rebuild."""
    digest = sha256_of(library.folder / LEDGER)
    sums = read_bytes(library.folder / SUMS).decode("utf-8", "replace").splitlines()
    return f"{digest}  {LEDGER}" not in sums


def unmatched(library: Library) -> list[Record]:
    """Return the ledger's records that no longer count because the problem of their entry has changed."""
    records = read_ledger(library.folder).records
    names = {record.entry for record in records} & set(library.document["entries"])
    problems = {name: library.entry(name)["problem_sha256"] for name in names}
    return [each for each in records if problems.get(each.entry, each.problem_sha256) != each.problem_sha256]


class _Build:
    """A build in progress: its tasks and the number of finished entries."""

    def __init__(self, folder: Path, inputs: Inputs, tasks: Tasks, progress: Progress) -> None:
        self.folder, self.inputs, self.tasks, self.progress = folder, inputs, tasks, progress
        self.total, self.done = sum(len(each.entries) for each in self.inputs.plans), 0
        self.skipped: dict[str, str] = {}  # instances and entries that cannot be made, and the reasons

    def begin(self, each: InstancePlan) -> None:
        """Schedule an instance unless it is complete, and then its entries."""
        task = self.inputs.preparation(each)
        about = self._whole(about_file(task.name), task.sha256, read_about)
        if about is not None:
            self._entries(each, about)
            return

        def finish(files: Files | NoStrokeError) -> None:
            if isinstance(files, NoStrokeError):
                self.total -= len(each.entries)
                self.skipped[task.name] = str(files).removeprefix(f"{task.name}: ")
                self.progress(f"skipped: {files}")
                return
            self._write(files)
            about = read_about(self.folder / about_file(task.name))
            if task.given and task.given.instance != about["instance"]["sha256"]:
                self.progress(f"{task.name}: the points given are of another instance; searched for others")
            self._entries(each, about)

        self.tasks.add(prepared, task, finish)

    def _whole(self, name: str, sha256: str, read: Callable[[Path], dict[str, Any]]) -> dict[str, Any] | None:
        """A document if it was made from the same recipe and its files are complete."""
        try:
            found = read(self.folder / name)
        except CrossfieldError:
            return None
        return found if found["recipe_sha256"] == sha256 and are_whole(self.folder, found["files"]) else None

    def _entries(self, each: InstancePlan, about: dict[str, Any]) -> None:
        for recipe in each.entries:
            if reason := recipe.lacks(about):
                self.total -= 1
                self.skipped[recipe.name] = reason
                self.progress(f"skipped: {recipe.name}: {reason}")
        for task in reversed(list(self.inputs.entries(each, about, self.folder))):
            if self._whole(f"{task.name}.json", task.sha256, read_sidecar):
                self.done += 1
            else:
                self.tasks.add(make_entry, task, self._finish(task.name))

    def _finish(self, name: str) -> Callable[[Files], None]:
        def finish(files: Files) -> None:
            self._write(files)
            self.done += 1
            self.progress(f"{self.done} of {self.total} entries: {name}")

        return finish

    def _write(self, files: Files) -> None:
        for name, data in files.items():
            write_bytes(self.folder / name, data)
