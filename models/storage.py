"""Files that are there whole or not at all: written beside, then renamed."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from .errors import InputError, OutputError


@contextmanager
def replacing(path: str | Path) -> Iterator[IO[bytes]]:
    """A binary stream to a temporary neighbour of `path` that takes its place on success.

    On any failure, Ctrl-C included, the neighbour is removed and what stood at `path` stays.
    Raises OutputError when the folder cannot be written or the disk is full.
    """
    path = Path(path)
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
    except OSError as error:
        raise OutputError(f"cannot be written: {_reason(error)}; choose another folder", file=path) from error
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream:
            yield stream
        temporary.chmod(0o644)
        temporary.replace(path)
    except OSError as error:
        raise OutputError(
            f"cannot be written: {_reason(error)}; free some space or choose another folder", file=path
        ) from error
    finally:
        temporary.unlink(missing_ok=True)


def write_bytes(path: str | Path, data: bytes) -> Path:
    """The path, now holding `data`. Raises OutputError."""
    with replacing(path) as stream:
        stream.write(data)
    return Path(path)


def read_bytes(path: str | Path) -> bytes:
    """The whole content of a file. Raises InputError when it is missing, a folder, or unreadable."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {_reason(error)}", file=path) from error


def make_folder(path: str | Path) -> Path:
    """The folder, made with its parents when it was not there. Raises OutputError."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot be made: {_reason(error)}; choose another folder", file=path) from error
    return Path(path)


def sha256_of(path: str | Path) -> str:
    """The SHA-256 of a file as 64 hexadecimal digits."""
    with Path(path).open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _reason(error: OSError) -> str:
    return (error.strerror or str(error)).lower()
