"""SHA256SUMS of a library: the one list of checksums, with all other files."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

from ....models.errors import CrossfieldError, InputError
from ....models.storage import read_bytes, write_bytes
from ....models.written_files import LIST, add_to_list, check_targets, sha256_of
from .documents import read_library

SUMS: Final = "SHA256SUMS"
_LINE: Final = re.compile(r"([0-9a-f]{64})  ([A-Za-z0-9][A-Za-z0-9_.-]*)")


def read_checksums(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of every file by name. Raises InputError for a missing list and for a bad line."""
    sums: dict[str, str] = {}
    for number, line in enumerate(read_bytes(folder / SUMS).decode("utf-8", "replace").splitlines(), 1):
        match = _LINE.fullmatch(line)
        if match is None or match[2] in sums:
            raise InputError(
                f"line {number} is no checksum of a plain file name, or repeats one; "
                "fetch it again, or build the library again with --force",
                file=folder / SUMS,
            )
        sums[match[2]] = match[1]
    return sums


def write_checksums(folder: Path, names: Iterable[str]) -> None:
    """Write the list of these files. Raises InputError for a missing file, OutputError."""
    lines = (f"{sha256_of(folder / name)}  {name}\n" for name in sorted(names))
    write_bytes(folder / SUMS, "".join(lines).encode())


def is_intact(folder: Path, name: str, sums: Mapping[str, str]) -> bool:
    """Whether a file is there and has its checksum, if there is one: a build lists its files at its end."""
    path = folder / name
    return path.is_file() and (name not in sums or sha256_of(path) == sums[name])


def claim_targets(
    folder: Path, stems: Collection[str], names: Collection[str] = (), *, force: bool = False
) -> None:
    """Raise OutputError for files of the user in the way of new ones; if forced, they may be replaced.

    stems: of names in the way, up to their first dots; names: others in the way. Files of a library that was
    copied without the list of crossfield's files are known by SHA256SUMS.
    """
    sums: dict[str, str] = {}
    with suppress(CrossfieldError):  # none without a library
        sums = read_checksums(read_library(folder).folder)
    if sums and not (folder / LIST).exists():
        add_to_list(folder, {**sums, SUMS: sha256_of(folder / SUMS)})
    changed = [
        path.name
        for path in folder.iterdir()
        if (path.name in names or path.name.partition(".")[0] in stems)
        and not (path.name in sums and is_intact(folder, path.name, sums))
    ]
    check_targets(folder, changed, force=force)
    if force and changed:
        add_to_list(folder, {name: sha256_of(folder / name) for name in changed})
