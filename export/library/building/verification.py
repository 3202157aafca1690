"""Verification of a library: it is built again from its own inputs, and every file is compared.

Inputs are the specification in library.json, the ledger, and the fields and certificates of the library,
which replace every search. Points are also checked by the exact program that every library contains.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
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
from ..ledger.known_points import points_of
from ..ledger.ledger import read_ledger
from .build import build_locked
from .executor import open_tasks

_REPAIR: Final = "fetch it again, or build the library again with --force"


@dataclass(frozen=True)
class Defect:
    """A defect of a library: file, and description with remedy."""

    file: str
    what: str

    @classmethod
    def of(cls, error: CrossfieldError, file: str) -> Defect:
        """Return an error about a file, by default the one that is named here."""
        fault = str(error).removeprefix(f"{error.file}: ")
        return cls(Path(error.file or file).name, fault if "; " in fault else f"{fault}; {_REPAIR}")

    def __str__(self) -> str:
        return f"{self.file}: {self.what}"


def verify_library(folder: str | Path, *, jobs: int = 1, progress: Progress = silent) -> list[Defect]:
    """Return the first defect of each file of a library, which no build changes during the work.

    Raises InputError without a library.
    """
    folder = existing_folder(folder)
    if not (folder / INDEX).is_file() and not (folder / SUMS).is_file():
        raise InputError("is no library: it has neither library.json nor SHA256SUMS", file=folder)
    defects: dict[str, Defect] = {}
    with library_lock(folder, "a verification of the library", progress):
        progress("files and checksums")
        for find in (_find_damaged_files(folder), _find_differences(folder, jobs, progress)):
            try:
                for defect in find:
                    defects.setdefault(defect.file, defect)
            except CrossfieldError as error:
                defect = Defect.of(error, INDEX)
                defects.setdefault(defect.file, defect)
    return list(defects.values())


def _file_names(folder: Path) -> set[str]:
    """The names of the files that a library may have."""
    return {
        path.name
        for path in folder.iterdir()
        if path.is_file() and not path.is_symlink() and path.suffix != ".part" and path.name != LIST
    }


def _find_damaged_files(folder: Path) -> Iterator[Defect]:
    """Files that are misplaced, missing, differ from SHA256SUMS, or are not in it."""
    present = _file_names(folder)
    for name in sorted({path.name for path in folder.iterdir()} - present - {LIST}):
        yield Defect(name, "is a folder, a link or a temporary file, which no library has; remove it")
    sums = read_checksums(folder)
    for name in sums:
        if name not in present:
            yield Defect(name, f"is missing; {_REPAIR}")
        elif not is_intact(folder, name, sums):
            yield Defect(name, f"has another SHA-256 than SHA256SUMS states; {_REPAIR}")
    for name in sorted(present - sums.keys() - {SUMS}):
        yield Defect(name, "is not in SHA256SUMS; build the library again, or remove it")


def _find_differences(folder: Path, jobs: int, progress: Progress) -> Iterator[Defect]:
    """Files that a build does not make or makes otherwise, and wrong points."""
    library = read_library(folder)
    stated = library.document["generator"]
    if stated != program_version():
        reason = f"was made by {stated}, so {program_version()} cannot make it again to compare it"
        yield Defect(INDEX, f"{reason}; verify with {stated}")
        return
    with temporary_folder() as again:
        ledger, points = read_ledger(folder), points_of(library, strict=True)
        rebuilt = build_locked(library.spec, again, ledger, points, jobs=jobs, progress=progress)
        yield from (Defect.of(error, name) for name, error in rebuilt.failed.items())
        present, built = _file_names(folder), _file_names(again)
        for name in sorted((present | built) - {SUMS}):
            if name not in present:
                yield Defect(name, f"is missing; {_REPAIR}")
            elif name in built and _read_unpacked(folder / name) != _read_unpacked(again / name):
                yield Defect(name, f"is not what a build makes; {_REPAIR}")
            elif name not in built and not name.startswith(tuple(rebuilt.failed)):
                yield Defect(name, "belongs to nothing in the library; remove it")
        progress("points")
        yield from _find_wrong_points(folder, rebuilt, jobs)


def _read_unpacked(path: Path) -> bytes:
    """The bytes of a file, unpacked, because versions of zlib pack differently; as they are if damaged."""
    data = read_bytes(path, MAX_SOLUTION)
    with suppress(InputError):
        return unpack(data, MAX_SOLUTION)
    return data


def _find_wrong_points(folder: Path, library: Library, jobs: int) -> list[Defect]:
    """Best known points that are not feasible in their .mps."""
    defects: list[Defect] = []
    with open_tasks(jobs) as tasks:
        for sidecar in library.entries:
            for model in (file["name"] for file in sidecar["files"] if file["format"] == "mps"):
                tasks.add(_check_point, (folder, sidecar["best"]["point"], model), defects.extend)
        tasks.run()
    return defects


def _check_point(task: tuple[Path, str, str]) -> list[Defect]:
    """The defects of a point against a model."""
    folder, point, model = task
    try:
        result = check(str(folder / model), str(folder / point))
    except BadInputError as error:
        reason = str(error).replace(f"{folder}{os.sep}", "")
        return [Defect(point, f"the checker refuses it: {reason}; {_REPAIR}")]
    if result.worst <= ACCEPTED_VIOLATION and result.agrees:
        return []
    values = f"worst violation {float(result.worst):.3g}, objective {float(result.objective)!r}"
    return [
        Defect(point, f"is not feasible against {model}, or claims another objective: {values}; {_REPAIR}")
    ]
