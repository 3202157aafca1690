"""Release of a library as one verified archive, with its checksum in a second file.

Order, times, owners and modes are fixed: the same library gives the same bytes, except under another zlib.
"""

from __future__ import annotations

import gzip
import io
import tarfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final

from ....models.errors import InputError, OutputError
from ....models.processes.deadline import Progress, silent
from ....models.storage import make_folder, read_bytes, replacing, sha256_of, write_bytes
from ..building.index import SUMS
from ..documents.citation import slug
from ..documents.documents import Library, read_library
from ..documents.lock import unchanged
from .check_library import findings_in

_SUFFIX: Final = ".tar.gz"
_SECONDS: Final = 315532800  # of every file: the beginning of 1980 in Unix time
_MODE: Final = 0o644
_LEVEL: Final = 9
_LONGEST: Final = 60  # characters of a folder's name that come from the title


@dataclass(frozen=True)
class Frozen:
    """A written release: its archive, the SHA-256, and the number of files in it."""

    file: Path
    sha256: str
    files: int


def release_library(
    folder: str | Path, output: str | Path, *, jobs: int = 1, progress: Progress = silent
) -> Frozen:
    """Verify a library and write its release as a .tar.gz, with its checksum in a second file.

    Raises InputError for another suffix, without a version, and for a defective library; OutputError.
    """
    folder, output = Path(folder), Path(output)
    if not output.name.lower().endswith(_SUFFIX):
        raise InputError(f"is no name of a release; let it end in {_SUFFIX}", file=output)
    if output.resolve().is_relative_to(folder.resolve()):
        raise OutputError("lies inside the library, whose files are its own; choose another", file=output)
    with unchanged(folder, "a release of the library", progress):
        top = _top(read_library(folder))
        found = list(findings_in(folder, jobs=jobs, progress=progress))
        if found:
            more = f" ({len(found) - 1} more)" if found[1:] else ""
            raise InputError(
                f"does not verify, so it is not released: {found[0]}{more}; see `crossfield library verify`",
                file=folder,
            )
        names = [SUMS, *(line[66:] for line in read_bytes(folder / SUMS).decode().splitlines())]
        progress(f"{len(names)} files")
        make_folder(output.parent)
        with replacing(output) as stream:
            _pack(stream, ((f"{top}/{name}", read_bytes(folder / name)) for name in sorted(names)))
    frozen = Frozen(output, sha256_of(output), len(names))
    write_bytes(output.with_name(f"{output.name}.sha256"), f"{frozen.sha256}  {output.name}\n".encode())
    return frozen


def _top(library: Library) -> str:
    """Name of the folder in the archive: title and version."""
    stated = library.document["release"]
    if "version" not in stated:
        raise InputError(
            "states no version and no day; write [release] into its specification and build it again",
            file=library.folder,
        )
    return f"{slug(stated['title'])[:_LONGEST]}-{slug(stated['version'])[:_LONGEST]}"


def _pack(stream: IO[bytes], members: Iterable[tuple[str, bytes]]) -> None:
    with (
        gzip.GzipFile("", "wb", _LEVEL, stream, mtime=0) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.USTAR_FORMAT) as archive,
    ):
        for name, data in members:
            entry = tarfile.TarInfo(name)
            entry.size, entry.mode, entry.mtime = len(data), _MODE, _SECONDS
            archive.addfile(entry, io.BytesIO(data))
