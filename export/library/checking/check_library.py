"""Checks of a library as a whole: files, checksums, schemas, instances, and every entry (`verify_entry`)."""

from __future__ import annotations

import json
import re
from collections import deque
from collections.abc import Collection, Iterator
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from ....models.errors import CrossfieldError, InputError
from ....models.processes.deadline import Progress, silent
from ....models.storage import read_bytes, sha256_of
from ..building.dataset import CROISSANT, PARQUET, same_rows
from ..building.entry_task import Entry, Inputs
from ..building.executor import executor
from ..building.index import CERTIFICATES, CHECKER, SOLU, SUMS, TEXTS, general
from ..building.table import TABLE
from ..documents.documents import (
    INDEX,
    Library,
    about_file,
    folder_of,
    read_about,
    read_library,
    read_sidecar,
)
from ..documents.lock import FILE as LOCK
from ..documents.lock import unchanged
from ..ledger.given import points_of
from ..ledger.ledger import FILE as LEDGER
from ..ledger.ledger import Ledger, read_ledger
from ..plan.recipe import InstancePlan, plan, without
from ..plan.sources import instance_from
from .check_entry import BUILD, Finding, instance_findings, of_error, verify_entry

FETCH: Final = "fetch it again, or build the library again"
REMOVE: Final = "remove it"
_INTERRUPTED: Final = f"after an interrupted solve or submission {BUILD}; otherwise fetch it again"
PLAIN: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")  # names of files in a library

Checked = tuple[dict[str, Any] | None, list[Finding]]

_AHEAD: Final = 16  # entries per process that are submitted at once: the first one may be the slowest
_SUM: Final = re.compile(r"([0-9a-f]{64})  (.+)")


def verify_library(folder: str | Path, *, jobs: int = 1, progress: Progress = silent) -> list[Finding]:
    """Return the findings about a library in a folder, which is locked during the work.

    Raises InputError without a library, OutputError if another process holds the lock for too long.
    """
    place = folder_of(folder)
    if not (place / INDEX).is_file() and not (place / SUMS).is_file():
        raise InputError("is no library: it has neither library.json nor SHA256SUMS", file=folder)
    with unchanged(place, "a verification of the library", progress):
        return list(findings_in(place, jobs=jobs, progress=progress))


def findings_in(folder: Path, *, jobs: int = 1, progress: Progress = silent) -> Iterator[Finding]:
    """Yield the findings about a folder whose lock the caller holds."""
    return _Verification(folder, jobs, progress).findings()


class _Verification:
    """A verification in progress: present, damaged and known files."""

    def __init__(self, folder: Path, jobs: int, progress: Progress) -> None:
        self.folder, self.jobs, self.progress = folder, jobs, progress
        self.present: set[str] = set()
        self.damaged: set[str] = set()
        self.known = {SUMS, INDEX, LEDGER, SOLU, TABLE, CROISSANT, PARQUET, CHECKER, *TEXTS}

    def findings(self) -> Iterator[Finding]:
        """Yield all findings in the order of the checks."""
        self.progress("files and checksums")
        yield from self._files()
        listed: set[str] = set()
        yield from self._checksums(listed)
        try:
            library = read_library(self.folder)
        except CrossfieldError as error:
            yield of_error(error, INDEX)
            return
        yield from self._index(library)
        yield from self._entries(library)
        for name in sorted(self.present - self.known):
            if name in listed:  # else it was reported already
                yield Finding(name, "belongs to nothing in the library", REMOVE)

    def _files(self) -> Iterator[Finding]:
        """Findings about links, folders and temporary files."""
        for path in sorted(self.folder.iterdir()):
            if path.name == LOCK:  # of a change in progress or a killed process
                continue
            if path.is_symlink() or not path.is_file():
                kind = "a link" if path.is_symlink() else "a folder, or no plain file"
                yield Finding(path.name, f"is {kind}; a library is flat and holds files alone", REMOVE)
            elif path.name.startswith(".") and path.name.endswith(".part"):
                yield Finding(path.name, "was left by a build that was stopped")
            else:
                self.present.add(path.name)

    def _checksums(self, listed: set[str]) -> Iterator[Finding]:
        """Files that are not in SHA256SUMS or differ from it; adds the names there to `listed`."""
        if SUMS not in self.present:
            yield Finding(SUMS, "is missing", FETCH)
            return
        sums = read_bytes(self.folder / SUMS).decode("utf-8", "replace")
        for number, line in enumerate(sums.splitlines(), 1):
            parts = _SUM.fullmatch(line)
            if parts is None:
                yield Finding(SUMS, f"line {number} is no checksum and name", FETCH)
            elif not PLAIN.fullmatch(parts[2]) or parts[2] in listed:
                yield Finding(
                    SUMS,
                    f"line {number} names {parts[2][:60]!r}, which is no plain file name, or there twice",
                    FETCH,
                )
            else:
                listed.add(parts[2])
                yield from self._checksum(parts[2], parts[1])
        of_ledger: Collection[str] = ()
        with suppress(CrossfieldError):  # a damaged ledger is reported with the entries
            of_ledger = read_ledger(self.folder).files
        for name in sorted(self.present - listed - {SUMS}):
            remedy = BUILD if name in of_ledger else f"{REMOVE}, or {BUILD}"
            yield Finding(name, "is not in SHA256SUMS", remedy)

    def _checksum(self, name: str, expected: str) -> Iterator[Finding]:
        if name not in self.present:
            yield Finding(name, "is missing", FETCH)
        elif sha256_of(self.folder / name) != expected:
            self.damaged.add(name)
            remedy = _INTERRUPTED if name == LEDGER else FETCH
            yield Finding(name, "has another SHA-256 than SHA256SUMS states", remedy)

    def _index(self, library: Library) -> Iterator[Finding]:
        """Findings about the index, and missing texts and checkers."""
        names = library.document["entries"]
        if sorted(library.document["sha256"]) != sorted(names):
            yield Finding(INDEX, "lists other entries than it has checksums for")
        try:
            spec = library.spec
            plans = plan(spec)
        except CrossfieldError as error:
            yield of_error(error, INDEX)
        else:
            self.known |= {name for sketch in spec.sketches for name in sketch.files}
            yield from self._skipped(library, plans)
            made = without(plans, library.skipped)
            if [entry.name for each in made for entry in each.entries] != names:
                yield Finding(INDEX, "lists other entries than its specification asks for")
        for name in sorted({*TEXTS, SOLU, TABLE, CROISSANT, CHECKER, LEDGER} - self.present):
            yield Finding(name, "is missing", FETCH)

    def _skipped(self, library: Library, plans: tuple[InstancePlan, ...]) -> Iterator[Finding]:
        """Skipped instances and entries that can be made, or that have another reason."""
        recipes = {each.recipe.name: each.recipe for each in plans}
        entries = {entry.name: entry for each in plans for entry in each.entries}
        for name, stated in library.skipped.items():
            try:
                if name in recipes:
                    instance_from(recipes[name])
                elif name in entries:
                    about = read_about(self.folder / about_file(entries[name].instance))
                    if reason := entries[name].lacks(about):
                        raise InputError(f"{name}: {reason}")
                yield Finding(INDEX, f"skips {name}, which can be made or is not asked for")
            except CrossfieldError as error:
                if str(error) != f"{name}: {stated}":
                    yield Finding(INDEX, f"states another reason for skipping {name} than there is")

    def _entries(self, library: Library) -> Iterator[Finding]:
        """Findings about ledger, instances and entries, and about texts if all entries are sound."""
        try:
            ledger = read_ledger(self.folder)
        except CrossfieldError as error:
            yield of_error(error, LEDGER)
            ledger = Ledger(self.folder)
        yield from self._ledger(ledger, library)
        inputs, sidecars, sound = self._inputs(library, ledger), [], True
        names = library.document["entries"]
        for sidecar, wrong in self._each(names, ledger, inputs):
            yield from wrong
            sidecars += [] if sidecar is None else [sidecar]
            sound = sound and not wrong
        yield from self._instances(sidecars, inputs)
        if sound and len(sidecars) == len(names):
            yield from self._texts(library, sidecars)

    def _inputs(self, library: Library, ledger: Ledger) -> Inputs:
        """The inputs of the library; without plans if its specification is damaged."""
        try:
            return Inputs(ledger, plan(library.spec), points_of(self.folder))
        except CrossfieldError:
            return Inputs(ledger, ())

    def _task(self, name: str, inputs: Inputs) -> Entry | None:
        """The inputs of an entry; None if they are damaged or missing, which is reported elsewhere."""
        plans = (each for each in inputs.plans for entry in each.entries if entry.name == name)
        with suppress(CrossfieldError, StopIteration):
            each = next(plans)
            about = read_about(self.folder / about_file(each.recipe.name))
            return next(task for task in inputs.entries(each, about, self.folder) if task.name == name)
        return None

    def _texts(self, library: Library, sidecars: list[dict[str, Any]]) -> Iterator[Finding]:
        """General files that differ from those made of sound sidecars."""
        try:
            made = general(self.folder, library.spec, sidecars, library.skipped)
        except CrossfieldError:
            return  # reported with the index
        if json.loads(made.pop(INDEX)) != library.document:
            yield Finding(INDEX, "is not what follows from the specification and the sidecars")
        if PARQUET in self.present - self.damaged and not same_rows(
            read_bytes(self.folder / PARQUET), made[TABLE]
        ):
            yield Finding(PARQUET, f"has other rows than {TABLE}")
        for name in sorted(made):
            if name in self.present - self.damaged and read_bytes(self.folder / name) != made[name]:
                yield Finding(name, "is not what follows from the specification and the sidecars")

    def _each(self, names: list[str], ledger: Ledger, inputs: Inputs) -> Iterator[Checked]:
        """The sidecar of each entry in order, None if it is damaged, and the findings."""
        most = 1 if self.jobs == 1 else _AHEAD * self.jobs
        under_way: deque[tuple[dict[str, Any] | None, list[Finding], Future[list[Finding]] | None]] = deque()
        with executor(self.jobs, None) as chosen:
            for number, name in enumerate(names, 1):
                self.progress(f"{number} of {len(names)}: {name}")
                sidecar, wrong = self._sidecar(name)
                future = None
                if sidecar is not None and not wrong:
                    task = self._task(name, inputs)
                    future = chosen.submit(_verified, self.folder, sidecar, ledger, task)
                under_way.append((sidecar, wrong, future))
                if len(under_way) >= most:
                    yield _ended(*under_way.popleft())
            while under_way:
                yield _ended(*under_way.popleft())

    def _sidecar(self, name: str) -> Checked:
        """The sidecar of an entry, and the findings about its name and files."""
        self.known.add(f"{name}.json")
        try:
            sidecar = read_sidecar(self.folder / f"{name}.json")
        except CrossfieldError as error:
            return None, [of_error(error, f"{name}.json")]
        self.known |= {file["name"] for file in sidecar["files"]}
        wrong = list(self._listed(f"{name}.json", sidecar["files"]))
        if sidecar["name"] != name:
            wrong.append(Finding(f"{name}.json", f"states that it is about {sidecar['name']}"))
        return sidecar, wrong

    def _listed(self, by: str, files: list[dict[str, Any]]) -> Iterator[Finding]:
        """Listed files that are missing or have another size or checksum."""
        for file in files:
            name = file["name"]
            if not PLAIN.fullmatch(name):
                yield Finding(by, f"names {name[:60]!r}, which is no plain file name")
            elif name not in self.present:
                yield Finding(name, f"is missing, but {by} lists it", FETCH)
            elif ((path := self.folder / name).stat().st_size, sha256_of(path)) != (
                file["bytes"],
                file["sha256"],
            ):
                yield Finding(name, f"is not the file that {by} lists")

    def _ledger(self, ledger: Ledger, library: Library) -> Iterator[Finding]:
        """Records and certificates of other libraries, and missing or damaged files of the ledger."""
        for record in ledger.records:
            if record.entry not in library.document["sha256"]:
                yield Finding(LEDGER, f"has a record of {record.entry}, which is not in the library")
            if record.point is not None:
                self.known.add(record.point)
                try:
                    ledger.field(record)
                except CrossfieldError as error:
                    yield of_error(error, record.point)
        instances = {entry.rpartition("_")[0] for entry in library.document["entries"]}
        for each in ledger.certificates:
            self.known.add(each.file)
            if each.instance not in instances:
                yield Finding(LEDGER, f"has a certificate of {each.instance}, which is not in the library")
            try:
                ledger.content(each.file, each.sha256)
            except CrossfieldError as error:
                yield of_error(error, each.file)

    def _instances(self, sidecars: list[dict[str, Any]], inputs: Inputs) -> Iterator[Finding]:
        """Findings about each instance, its document and its fields."""
        self.progress("instances")
        plans = {each.recipe.name: each for each in inputs.plans}
        wanted = {sidecar["instance"]["file"]: sidecar["instance"] for sidecar in sidecars}
        for file, instance in sorted(wanted.items()):
            stem = file.removesuffix(".instance.json")
            name = about_file(stem)
            self.known |= {name, file}
            try:
                about = read_about(self.folder / name)
                self.known |= {each["name"] for each in about["files"]}
                lost = list(self._listed(name, about["files"]))
                yield from lost
                if "certificates" in about:
                    self.known.add(CERTIFICATES)
                    if CERTIFICATES not in self.present:
                        yield Finding(CERTIFICATES, "is missing, which checks certificates", FETCH)
                if about["instance"] != instance:
                    yield Finding(name, "is about another instance than the sidecars of its entries")
                elif not lost and stem in plans:
                    yield from instance_findings(self.folder, about, inputs.preparation(plans[stem]))
            except CrossfieldError as error:
                yield of_error(error, Path(error.file or name).name)


def _verified(folder: Path, sidecar: dict[str, Any], ledger: Ledger, task: Entry | None) -> list[Finding]:
    """Findings about an entry, even if its sidecar has impossible values."""
    found: list[Finding] = []
    try:
        found.extend(verify_entry(folder, sidecar, ledger, task))
    except (ArithmeticError, LookupError, ValueError):  # values that the schema allows
        found.append(Finding(f"{sidecar['name']}.json", "holds values that no entry can have"))
    return found


def _ended(
    sidecar: dict[str, Any] | None, wrong: list[Finding], future: Future[list[Finding]] | None
) -> Checked:
    return sidecar, [*wrong, *(future.result() if future else [])]
