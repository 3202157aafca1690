"""Libraries as they are handed around: a folder, or an archive (.zip, .tar, .tar.gz/bz2/xz) of one.

An archive is looked through before a byte of it is written: it may hold plain files and folders alone, inside
its own folder, and no more than fits its size. Then it is unpacked into a temporary folder that is gone
afterwards.
"""

from __future__ import annotations

import bz2
import gzip
import lzma
import stat
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import IO, Any, Final, cast

from ....models.errors import InputError, OutputError

MOST_FILES: Final = 200_000
MOST_BYTES: Final = 1 << 36
LEAST_LIMIT: Final = 1 << 28
"""Bytes that any archive may unpack to; beyond, a limit of RATIO times its size holds."""
RATIO: Final = 100
"""Text files of models pack 10 to 50 times; a small archive that claims much more is a trap."""

_PACKED: Final[dict[bytes, Callable[..., Any]]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\x00": lzma.open,
}
_DAMAGED: Final = "is no archive, or damaged or cut off; fetch it again"
_DAMAGE: Final = (
    EOFError,
    ValueError,
    RuntimeError,  # an encrypted .zip
    NotImplementedError,
    zlib.error,
    lzma.LZMAError,
    tarfile.TarError,
    zipfile.BadZipFile,
)


@contextmanager
def opened(path: str | Path) -> Iterator[Path]:
    """The folder of a library: the path itself, or a temporary folder that holds what an archive holds.

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
    if _head(path).startswith(b"PK"):
        with zipfile.ZipFile(path) as archive:
            _check(
                ((entry.filename, _is_plain(entry), entry.file_size) for entry in archive.infolist()), limit
            )
            for entry in archive.infolist():
                archive.extract(entry, folder)
        return
    with _tar(path, limit) as tar:
        _check(((entry.name, entry.isreg() or entry.isdir(), entry.size) for entry in tar), limit)
    with _tar(path, limit) as tar:
        tar.extractall(folder, filter="data")


def _is_plain(entry: zipfile.ZipInfo) -> bool:
    """Whether a member of a .zip is a file or a folder, by its Unix mode (the upper half)."""
    return stat.S_IFMT(entry.external_attr >> 16) in {0, stat.S_IFREG, stat.S_IFDIR}


def _check(members: Iterable[tuple[str, bool, int]], limit: int) -> None:
    """Nothing, when all members (name, plain, bytes) can be unpacked safely. Raises InputError."""
    names: set[PurePosixPath] = set()
    total = 0
    for name, plain, size in members:
        place = PurePosixPath(name)
        if place.is_absolute() or ".." in place.parts or not name.isprintable() or set(name) & set("\\:"):
            raise InputError(f"holds {name[:60]!r}, which would lie outside of its folder; do not unpack it")
        if not plain:
            raise InputError(f"holds {name[:60]!r}, a link or a device; do not unpack it")
        if place in names and place.parts:
            raise InputError(f"holds {name[:60]!r} twice; make the archive again")
        names.add(place)
        total += size
        if total > limit or len(names) > MOST_FILES:
            raise InputError("unpacks to unreasonably much for its size; do not unpack it")


@contextmanager
def _tar(path: Path, limit: int) -> Iterator[tarfile.TarFile]:
    """A .tar as a stream, unpacked by what it begins with; it gives its members and their headers alone."""
    head = _head(path)
    unpack = next((function for magic, function in _PACKED.items() if head.startswith(magic)), None)
    with (
        path.open("rb") as raw,
        unpack(raw) if unpack else raw as stream,
        tarfile.open(fileobj=cast("IO[bytes]", _Limited(stream, 2 * limit)), mode="r|") as tar,
    ):
        yield tar


def _head(path: Path) -> bytes:
    with path.open("rb") as raw:
        return raw.read(6)


class _Limited:
    """A stream that refuses to give more than a number of bytes."""

    def __init__(self, stream: IO[bytes], limit: int) -> None:
        self._stream, self._left = stream, limit

    def read(self, size: int) -> bytes:
        """The next bytes. Raises InputError beyond the limit."""
        self._left -= size
        if self._left < 0:
            raise InputError("unpacks to unreasonably much for its size; do not unpack it")
        return self._stream.read(size)
