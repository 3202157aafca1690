"""Safe unpacking of libraries: folders, and archives (.zip, .tar, .tar.gz/bz2/xz) of them.

All members are checked before a byte is written. An archive may hold plain files and folders alone, with
short names inside its own folder that differ in more than case, and no more than fits its size. Its files are
then written to a temporary folder, which is removed afterwards. docs/files.md lists what is accepted.
"""

from __future__ import annotations

import bz2
import gzip
import lzma
import stat
import tempfile
import unicodedata
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Final, cast

from ....models.errors import InputError, OutputError, shortened
from .tar_stream import Kind, Member, members

MOST_FILES: Final = 200_000
MOST_BYTES: Final = 1 << 36
LEAST_LIMIT: Final = 1 << 28
"""Bytes that any archive may unpack to; beyond, a limit of RATIO times its size holds."""
RATIO: Final = 100
"""Text files of models pack 10 to 50 times; a small archive that claims much more is a trap."""
MOST_ENTRY: Final = 256
"""Bytes of an entry in the directory of a .zip, on average."""
MOST_NAME: Final = 1000
"""Characters of a name, its folders included."""
MOST_PART: Final = 255
"""Bytes of a part of a name, as file systems allow."""
MOST_DEPTH: Final = 16
"""Folders inside of each other."""

_PACKED: Final[dict[bytes, Callable[..., Any]]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\x00": lzma.open,
}
_DAMAGED: Final = "is no archive, or damaged or cut off; fetch it again"
_TOO_MUCH: Final = "unpacks to unreasonably much for its size; do not unpack it"
_DAMAGE: Final = (
    EOFError,
    ValueError,
    RuntimeError,  # an encrypted .zip
    NotImplementedError,
    zlib.error,
    lzma.LZMAError,
    zipfile.BadZipFile,
)


@contextmanager
def opened(path: str | Path) -> Iterator[Path]:
    """Yield the folder of a library: the path itself, or a temporary folder with an archive's content.

    Raises InputError when there is nothing at the path, and for an archive that is damaged, unpacks outside
    of its folder, holds links or is unreasonably large; then nothing was written.
    """
    path = Path(path)
    if path.is_dir():
        yield path
        return
    if not path.is_file():
        raise InputError("there is no such folder or archive; give a library", file=path)
    with tempfile.TemporaryDirectory(prefix="crossfield-") as name:
        folder = Path(name)
        try:
            _unpack(path, folder)
        except InputError as error:
            raise InputError(str(error), file=path) from error
        except OSError as error:
            if error.errno is None:  # gzip
                raise InputError(_DAMAGED, file=path) from error
            raise OutputError(f"cannot be unpacked: {error.strerror}; free some space", file=path) from error
        except _DAMAGE as error:
            raise InputError(_DAMAGED, file=path) from error
        yield _inner(folder)


def _inner(folder: Path) -> Path:
    """The folder itself, or the only one in it when it holds nothing else."""
    held = list(folder.iterdir())
    return held[0] if len(held) == 1 and held[0].is_dir() else folder


def _unpack(path: Path, folder: Path) -> None:
    limit = min(max(LEAST_LIMIT, RATIO * path.stat().st_size), MOST_BYTES)
    for _ in _checked(path, limit):
        pass
    for member, place in _checked(path, limit):
        _write(member, folder / place)


def _write(member: Member, path: Path) -> None:
    folder = path if member.kind == "folder" else path.parent
    folder.mkdir(parents=True, exist_ok=True)
    if member.kind == "file":
        with path.open("xb") as file:
            for chunk in member.chunks():
                file.write(chunk)


def _checked(path: Path, limit: int) -> Iterator[tuple[Member, str]]:
    """The members of an archive and their places, while they can be written safely. Raises InputError."""
    names = _Names()
    total = 0
    for count, member in enumerate(_members(path, limit), 1):
        place = _place(member)
        total += member.size
        if total > limit or count > MOST_FILES:
            raise InputError(_TOO_MUCH)
        names.add(place, is_folder=member.kind == "folder")
        yield member, place


def _place(member: Member) -> str:
    """The place of a member inside the archive's folder; empty for the folder itself. Raises InputError."""
    name = member.name
    parts = [part for part in name[: MOST_NAME + 1].split("/") if part not in ("", ".")]
    if name.startswith("/") or ".." in parts or not name.isprintable() or set(name) & set("\\:"):
        raise InputError(f"holds {name[:60]!r}, which would lie outside of its folder; do not unpack it")
    longest = max((len(part.encode()) for part in parts), default=0)
    if len(name) > MOST_NAME or longest > MOST_PART or len(parts) > MOST_DEPTH:
        raise InputError(f"holds a name of unreasonable length, {shortened(name)!r}; do not unpack it")
    if member.kind == "other" or (member.kind == "file" and not parts):
        raise InputError(f"holds {name[:60]!r}, which is neither a file nor a folder; do not unpack it")
    return "/".join(parts)


class _Names:
    """The names of an archive so far, no two of which differ in case alone."""

    def __init__(self) -> None:
        self._held: dict[str, tuple[str, bool]] = {}
        self._members: set[str] = set()

    def add(self, place: str, *, is_folder: bool) -> None:
        """Add a member and the folders above it. Raises InputError for a name that is taken."""
        if place in self._members:
            raise InputError(f"holds {place[:60]!r} twice; make the archive again")
        if place:
            self._members.add(place)
        while place and self._is_new(place, is_folder=is_folder):
            place, is_folder = place.rpartition("/")[0], True

    def _is_new(self, place: str, *, is_folder: bool) -> bool:
        """Whether the name is new to file systems that ignore case. Raises InputError for a similar one."""
        folded = unicodedata.normalize("NFKC", place.casefold())
        if folded not in self._held:
            self._held[folded] = (place, is_folder)
            return True
        if self._held[folded] != (place, is_folder):
            raise InputError(f"holds {place[:60]!r} twice; make the archive again")
        return False


def _members(path: Path, limit: int) -> Iterator[Member]:
    """The members of a .zip, or of a .tar as a stream, unpacked by what it begins with."""
    head = _head(path)
    if head.startswith(b"PK"):
        yield from _of_zip(path, limit)
        return
    unpack = next((function for magic, function in _PACKED.items() if head.startswith(magic)), None)
    with path.open("rb") as raw, unpack(raw) if unpack else raw as stream:
        yield from members(cast("IO[bytes]", _Limited(stream, 2 * limit)))


def _of_zip(path: Path, limit: int) -> Iterator[Member]:
    """The members of a .zip. On opening one, zipfile compares its name with the directory."""
    with path.open("rb") as raw:
        limited = _Limited(raw, MOST_FILES * MOST_ENTRY)
        with zipfile.ZipFile(cast("IO[bytes]", limited)) as archive:
            entries = archive.infolist()
            if archive.comment or min((entry.header_offset for entry in entries), default=0):
                raise InputError("holds something before or after its files; make the archive again")
            limited.left = 2 * limit
            for entry in entries:
                with archive.open(entry) as stream:
                    yield Member(entry.orig_filename, _kind(entry), entry.file_size, stream)


def _kind(entry: zipfile.ZipInfo) -> Kind:
    """Whether a member of a .zip is a file or a folder, by its name and its Unix mode (the upper half)."""
    mode = stat.S_IFMT(entry.external_attr >> 16)
    if entry.orig_filename.endswith("/"):
        return "folder" if mode in {0, stat.S_IFDIR} and not entry.file_size else "other"
    return "file" if mode in {0, stat.S_IFREG} else "other"


def _head(path: Path) -> bytes:
    with path.open("rb") as raw:
        return raw.read(6)


class _Limited:
    """A stream that returns at most a number of bytes in total."""

    def __init__(self, stream: IO[bytes], limit: int) -> None:
        self._stream, self.left = stream, limit
        self.seek, self.tell, self.seekable = stream.seek, stream.tell, stream.seekable

    def read(self, size: int = -1) -> bytes:
        """Return the next bytes. Raises InputError beyond the limit."""
        data = self._stream.read(self.left + 1 if size < 0 else min(size, self.left + 1))
        self.left -= len(data)
        if self.left < 0:
            raise InputError(_TOO_MUCH)
        return data
