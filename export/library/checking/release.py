"""Release of a library as one verified archive, with its checksum in a second file.

Order, times, owners and modes are fixed: the same library gives the same bytes, except under another zlib.
"""

from __future__ import annotations

import gzip
import re
import tarfile
from pathlib import Path
from typing import Any, Final

from ....models.errors import InputError, OutputError
from ....models.processes.deadline import Progress, silent
from ....models.storage import make_folder, read_bytes, replacing, sha256_of, write_bytes
from ..building.index import SUMS
from ..documents.documents import read_library
from ..documents.lock import unchanged
from .check_library import findings_in

_SUFFIX: Final = ".tar.gz"
_SECONDS: Final = 315532800  # of every file: the beginning of 1980 in Unix time


def release_library(
    folder: str | Path, output: str | Path, *, jobs: int = 1, progress: Progress = silent
) -> dict[str, Any]:
    """Verify a library and write its release as a .tar.gz, with its checksum in a second file.

    Returns the archive (`file`), its `sha256`, and the number of `files` in it. Raises InputError for another
    suffix, without a version, and for a defective library; OutputError.
    """
    folder, output = Path(folder), Path(output)
    if not output.name.lower().endswith(_SUFFIX):
        raise InputError(f"is no name of a release; let it end in {_SUFFIX}", file=output)
    if output.resolve().is_relative_to(folder.resolve()):
        raise OutputError("lies inside the library, whose files are its own; choose another", file=output)
    with unchanged(folder, "a release of the library", progress):
        stated = read_library(folder).document["release"]
        if "version" not in stated:
            raise InputError(
                "states no version and no day; write [release] into its specification and build it again",
                file=folder,
            )
        found = list(findings_in(folder, jobs=jobs, progress=progress))
        if found:
            more = f" ({len(found) - 1} more)" if found[1:] else ""
            raise InputError(
                f"does not verify, so it is not released: {found[0]}{more}; see `crossfield library verify`",
                file=folder,
            )
        names = sorted([SUMS, *(line[66:] for line in read_bytes(folder / SUMS).decode().splitlines())])
        progress(f"{len(names)} files")
        make_folder(output.parent)
        _pack(folder, names, f"{slug(stated['title'])}-{slug(stated['version'])}", output)
    sha256 = sha256_of(output)
    write_bytes(output.with_name(f"{output.name}.sha256"), f"{sha256}  {output.name}\n".encode())
    return {"file": str(output), "sha256": sha256, "files": len(names)}


def slug(text: str) -> str:
    """Return at most 60 letters, digits and points of a text, in lower case, joined by hyphens."""
    return re.sub(r"[^a-z0-9.]+", "-", text.lower()).strip("-.")[:60] or "library"


def _pack(folder: Path, names: list[str], top: str, output: Path) -> None:
    with (
        replacing(output) as stream,
        gzip.GzipFile("", "wb", 9, stream, mtime=0) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.USTAR_FORMAT) as archive,
    ):
        for name in names:
            archive.add(folder / name, f"{top}/{name}", filter=_of_nobody)


def _of_nobody(entry: tarfile.TarInfo) -> tarfile.TarInfo:
    entry.uid = entry.gid = 0
    entry.uname = entry.gname = ""
    entry.mode, entry.mtime = 0o644, _SECONDS
    return entry
