"""Verification of a library: it is built again from its own inputs, and every file is compared.

Inputs are the specification in library.json, the ledger, and the fields and certificates of the library,
which replace every search. Points are also checked by the exact program that every library contains.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ....models.errors import CrossfieldError, InputError
from ....models.input_limits import MAX_SOLUTION
from ....models.packed import unpack
from ....models.processes.deadline import Progress, silent
from ....models.storage import read_bytes, temporary_folder
from ....models.written_files import LIST
from ...formats.registry import program_version
from ..documents.check_point import BadInputError, check
from ..documents.checksums import SUMS, is_intact, read_checksums
from ..documents.documents import INDEX, Library, existing_folder, read_library
from ..documents.lock import library_lock
from ..ledger.grades import ACCEPTED_VIOLATION
from ..ledger.known_points import all_points_of
from ..ledger.ledger import LEDGER, read_ledger
from .build import build_locked, has_unbuilt_records
from .executor import open_tasks

BUILD: Final = "build the library again"
_FETCH: Final = f"fetch it again, or {BUILD}"
_INTERRUPTED: Final = f"after an interrupted solve {BUILD}; otherwise fetch it again"
_REMOVE: Final = "remove it"


@dataclass(frozen=True, order=True)
class Defect:
    """A defect of a library: file, description and remedy."""

    file: str
    what: str
    remedy: str = BUILD

    @classmethod
    def of(cls, error: CrossfieldError, file: str) -> Defect:
        """Return an error about a file, whose message names defect and remedy."""
        name = Path(error.file).name if error.file else file
        message = str(error).removeprefix(f"{error.file}: ")
        reason, _, remedy = message.rpartition("; ")
        return cls(name, reason, remedy) if reason else cls(name, message)

    def __str__(self) -> str:
        return f"{self.file}: {self.what}; {self.remedy}"


def verify_library(folder: str | Path, *, jobs: int = 1, progress: Progress = silent) -> list[Defect]:
    """Return the defects of a library in a folder, which no build changes during the work.

    Raises InputError without a library.
    """
    folder = existing_folder(folder)
    if not (folder / INDEX).is_file() and not (folder / SUMS).is_file():
        raise InputError("is no library: it has neither library.json nor SHA256SUMS", file=folder)
    with library_lock(folder, "a verification of the library", progress):
        progress("files and checksums")
        defects = [*_find_misplaced_files(folder), *_find_damaged_files(folder)]
        named = {defect.file for defect in defects}
        return [*defects, *sorted(_find_differences(folder, named, jobs, progress))]


def _file_names(folder: Path) -> set[str]:
    """The names of the files that a library may have."""
    return {
        path.name
        for path in folder.iterdir()
        if path.is_file() and not path.is_symlink() and path.suffix != ".part" and path.name != LIST
    }


def _find_misplaced_files(folder: Path) -> Iterator[Defect]:
    """Links, folders and temporary files."""
    for path in sorted(folder.iterdir()):
        if path.is_symlink() or not path.is_file():
            kind = "a link" if path.is_symlink() else "a folder, or no plain file"
            yield Defect(path.name, f"is {kind}; a library is flat and holds files alone", _REMOVE)
        elif path.suffix == ".part":
            yield Defect(path.name, "was left by a build that was stopped")


def _find_damaged_files(folder: Path) -> Iterator[Defect]:
    """Files that are missing, differ from SHA256SUMS, or are not in it."""
    try:
        sums = read_checksums(folder)
    except CrossfieldError as error:
        yield Defect.of(error, SUMS) if (folder / SUMS).exists() else Defect(SUMS, "is missing", _FETCH)
        return
    present = _file_names(folder)
    for name in sums:
        if name not in present:
            yield Defect(name, "is missing", _FETCH)
        elif not is_intact(folder, name, sums):
            remedy = _INTERRUPTED if name == LEDGER else f"{_FETCH} with --force"
            yield Defect(name, "has another SHA-256 than SHA256SUMS states", remedy)
    of_ledger: list[str] = []
    with suppress(CrossfieldError):  # a damaged ledger is found by the build
        of_ledger = read_ledger(folder).files
    for name in sorted(present - sums.keys() - {SUMS}):
        yield Defect(name, "is not in SHA256SUMS", BUILD if name in of_ledger else f"{_REMOVE}, or {BUILD}")


def _find_differences(
    folder: Path, named: Collection[str], jobs: int, progress: Progress
) -> Iterator[Defect]:
    """Files that a build does not make or makes otherwise, and wrong points; not those named before."""
    if not (folder / INDEX).is_file():
        if INDEX not in named:
            yield Defect(INDEX, "is missing", _FETCH)
        return
    try:
        library = read_library(folder)
        stated = library.document["generator"]
        if stated != program_version():
            reason = f"was made by {stated}, so {program_version()} cannot make it again to compare it"
            yield Defect(INDEX, reason, f"verify with {stated}")
            return
        with temporary_folder() as again:
            ledger, points = read_ledger(folder), all_points_of(library)
            rebuilt = build_locked(library.spec, again, ledger, points, jobs=jobs, progress=progress)
            yield from (Defect.of(error, name) for name, error in rebuilt.failed.items())
            present, built = _file_names(folder), _file_names(again)
            remedy = BUILD if has_unbuilt_records(library) else f"{_REMOVE}, and {BUILD}"
            named_above = {name for name in present if name.startswith(tuple(rebuilt.failed))}
            for name in (present | built) - {SUMS, *named} - named_above:
                if name not in built:
                    yield Defect(name, "belongs to nothing in the library", _REMOVE)
                elif name not in present:
                    yield Defect(name, "is missing", _FETCH)
                elif _read_unpacked(folder / name) != _read_unpacked(again / name):
                    yield Defect(name, "is not what a build makes", remedy)
            progress("points")
            yield from _find_wrong_points(folder, rebuilt, named, jobs)
    except CrossfieldError as error:
        defect = Defect.of(error, INDEX)
        if defect.file not in named or (folder / defect.file).exists():  # else it is named as missing
            yield defect


def _read_unpacked(path: Path) -> bytes:
    """The bytes of a file, unpacked, because versions of zlib pack differently; as they are if damaged."""
    data = read_bytes(path, MAX_SOLUTION)
    with suppress(InputError):
        return unpack(data, MAX_SOLUTION)
    return data


def _find_wrong_points(folder: Path, library: Library, named: Collection[str], jobs: int) -> list[Defect]:
    """Best known points that are not feasible in their .mps; damaged files are not checked."""
    defects: list[Defect] = []
    with open_tasks(jobs) as tasks:
        for sidecar in library.entries:
            point = sidecar["best"]["point"]
            models = [file["name"] for file in sidecar["files"] if file["format"] == "mps"]
            intact = [model for model in models if not {point, model} & set(named)]
            tasks.add(_check_point, (folder, point, intact), defects.extend)
        tasks.run()
    return defects


def _check_point(task: tuple[Path, str, list[str]]) -> list[Defect]:
    """Check a point against models; return its defects."""
    folder, point, models = task
    defects = []
    for model in models:
        try:
            result = check(str(folder / model), str(folder / point))
        except BadInputError as error:
            reason = str(error).replace(f"{folder}{os.sep}", "")
            defects.append(Defect(point, f"the checker refuses it: {reason}"))
            continue
        if result.worst > ACCEPTED_VIOLATION:
            reason = f"is not feasible against {model}: worst violation {float(result.worst):.3g}"
            defects.append(Defect(point, reason))
        if not result.agrees:
            defects.append(Defect(point, f"claims another objective than it has against {model}"))
    return defects
