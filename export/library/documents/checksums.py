"""SHA256SUMS of a library: the one list of checksums, with all other files."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

from ....models.errors import InputError
from ....models.storage import read_bytes, sha256_of, write_bytes

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
                "fetch it again, or build the library again",
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
