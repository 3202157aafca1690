"""Complete files or none: written to a temporary neighbour, then renamed."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
import socket
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import IO, Final

from .errors import InputError, OutputError

PART: Final = ".part"  # suffix of the names of temporary neighbours, which begin with a dot
_MARK: Final = re.compile(r"\..*\.([0-9a-f]{8})-(\d+)-[0-9a-f]+\.part", re.DOTALL)
_UNFINISHED: Final[set[Path]] = set()
_LONGEST: Final = 50  # characters of a name that a neighbour's name repeats, at most 200 of 255 bytes


@contextmanager
def replacing(path: str | Path) -> Iterator[IO[bytes]]:
    """A binary stream to a temporary neighbour of `path` that replaces it on success.

    On any failure, Ctrl-C included, the neighbour is removed and the old file at `path` stays.
    Raises OutputError when the folder cannot be written or the disk is full.
    """
    path = Path(path)
    temporary = neighbour(path)
    _UNFINISHED.add(temporary)
    try:
        try:
            remove_dead(path.parent)
            stream = temporary.open("xb")
        except OSError as error:
            raise OutputError(
                f"cannot be written: {_reason(error)}; choose another folder", file=path
            ) from error
        try:
            with stream:
                yield stream
            temporary.replace(path)
        except OSError as error:
            raise OutputError(
                f"cannot be written: {_reason(error)}; free some space or choose another folder", file=path
            ) from error
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise
    _UNFINISHED.discard(temporary)


@contextmanager
def replacing_files(folder: str | Path) -> Iterator[Path]:
    """A temporary folder, whose files replace those of `folder`, one after the other, on success.

    On any failure, Ctrl-C included, the old files stay. Raises OutputError when the folder cannot be written.
    """
    folder = make_folder(folder)
    temporary = neighbour(folder / "files")
    _UNFINISHED.add(temporary)
    try:
        try:
            remove_dead(folder)
            temporary.mkdir()
        except OSError as error:
            raise OutputError(
                f"cannot be written: {_reason(error)}; choose another folder", file=folder
            ) from error
        yield temporary
        for path in sorted(path for path in temporary.rglob("*") if path.is_file()):
            target = folder / path.relative_to(temporary)
            make_folder(target.parent)
            try:
                path.replace(target)
            except OSError as error:
                reason = f"cannot be replaced: {_reason(error)}; choose another folder"
                raise OutputError(reason, file=target) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def remove_unfinished() -> None:
    """Remove the temporary files that this process still has when it ends early.

    Ctrl-C can come between two lines of the blocks above, where none of their handlers sees it.
    """
    for path in tuple(_UNFINISHED):
        shutil.rmtree(path, ignore_errors=True)
        with suppress(OSError):
            path.unlink()


def remove_file(path: Path) -> None:
    """Remove a file, if there is one; a folder stays. Raises OutputError when that is impossible."""
    try:
        if not path.is_dir():
            path.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"cannot be removed: {_reason(error)}; choose another folder", file=path) from error


def neighbour(path: Path) -> Path:
    """A name in the folder of `path` that no other writer uses, because it contains machine and process."""
    return path.with_name(f".{path.name[:_LONGEST]}.{_machine()}-{os.getpid()}-{secrets.token_hex(4)}{PART}")


@lru_cache(maxsize=1024)
def remove_dead(folder: Path) -> None:
    """Remove temporary files of this user's killed processes from a folder, once per process and folder.

    Keeps files of processes whose state is unknown: on Windows, and for other machines. No write needs the
    removal, because names are never used twice. Raises OSError when the folder cannot be listed.
    """
    for path in folder.iterdir():
        mark = _MARK.fullmatch(path.name)
        if mark is None or mark[1] != _machine() or _lives(int(mark[2])):
            continue
        with suppress(OSError):
            status = path.lstat()
            if status.st_uid != os.geteuid():
                continue
            if stat.S_ISDIR(status.st_mode):
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink()


def _machine() -> str:
    """Eight digits for the name of this machine."""
    return hashlib.sha256(socket.gethostname().encode()).hexdigest()[:8]


def _lives(process: int) -> bool:
    """Whether a process may be running."""
    if os.name == "nt":  # signal 0 would end it there
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True
    return True


def write_bytes(path: str | Path, data: bytes) -> Path:
    """Write `data` and return the path. Raises OutputError."""
    with replacing(path) as stream:
        stream.write(data)
    return Path(path)


def read_bytes(path: str | Path, most: int | None = None, remedy: str = "give a smaller file") -> bytes:
    """The whole content of a file.

    Raises InputError when it is missing, a folder, unreadable, or has more than `most` bytes; `remedy` then
    completes the message. With `most` it must be a regular file, because only these report their length.
    """
    try:
        status = Path(path).stat()
        if most is not None and not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):
            raise InputError("cannot be read: is not a regular file", file=path)
        if most is not None and status.st_size > most:
            raise InputError(f"has {status.st_size} bytes; at most {most} are read, {remedy}", file=path)
        return Path(path).read_bytes()
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {_reason(error)}", file=path) from error


def make_folder(path: str | Path) -> Path:
    """Create the folder with its parents if it is missing, and return it. Raises OutputError."""
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot be created: {_reason(error)}; choose another folder", file=path) from error
    return path


def sha256_of(path: str | Path) -> str:
    """The SHA-256 of a file as 64 hexadecimal digits."""
    with Path(path).open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _reason(error: OSError | ValueError) -> str:
    return (getattr(error, "strerror", None) or str(error)).lower()
