"""Submitted files and their kinds."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ....models.array_archive import ArrayArchive, ExpectedArray
from ....models.errors import CrossfieldError, InputError, InstanceError
from ....models.field import file as fields
from ....models.input_limits import MAX_HEAD
from ....models.proof import check_certificate
from ....models.storage import read_bytes
from ...solutions.readers.registry import head_of, recognising_readers

FileKind = Literal["solution", "field", "certificate", ""]
"""FileKind of a file; empty if unknown."""


@dataclass(frozen=True)
class SubmittedFile:
    """A submitted file. listed: named by itself, not only found in a folder; error: why it cannot be read."""

    path: Path
    kind: FileKind
    listed: bool = True
    error: CrossfieldError | None = None


def find_submitted_files(files: Sequence[str | Path]) -> list[SubmittedFile]:
    """Return files and the files in folders with their kinds. Raises InputError if there are none."""
    files_found = [_submitted_file(path, listed) for path, listed in _expand_folders(files)]
    if not files_found:
        raise InputError("there is nothing to submit; give files")
    return files_found


def _expand_folders(files: Iterable[str | Path]) -> Iterator[tuple[Path, bool]]:
    """The files with those in folders, and whether each was listed by itself."""
    for path in map(Path, files):
        if path.is_dir():
            inside = (file for file in sorted(path.rglob("*")) if not file.name.startswith("."))
            yield from ((file, False) for file in inside if file.is_file())
        else:
            yield path, True


def _submitted_file(path: Path, listed: bool) -> SubmittedFile:
    try:
        return SubmittedFile(path, kind_of(path), listed)
    except CrossfieldError as error:
        return SubmittedFile(path, "", error=error)


def kind_of(path: Path) -> FileKind:
    """Return the kind of a file, from its content."""
    data = read_bytes(path)
    if path.suffix.lower() == ".rawfield":
        return "field"
    if data.startswith(b"PK"):
        return "certificate" if _is_certificate(data) else "field"
    head = head_of(data)
    if head.lstrip().startswith(b"{"):
        return "field" if _is_field(data) else ""
    return "solution" if recognising_readers(head) else ""


def _is_certificate(data: bytes) -> bool:
    with suppress(InstanceError):
        head = ArrayArchive(data).arrays({"head": ExpectedArray(1, MAX_HEAD, "u")})["head"].tobytes()
        return any(known.encode() in head for known in check_certificate.CHECKERS)
    return False


def _is_field(data: bytes) -> bool:
    with suppress(ValueError, RecursionError):
        return bool(json.loads(data).get("format") == fields.FORMAT)
    return False
