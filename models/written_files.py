"""The list of files that crossfield wrote into a folder, which decides what it may replace there.

Each folder has its own list, `.crossfield.sha256`, with a line `<SHA-256>  <name>` per written file, as
`sha256sum` writes it. A line is added before the file appears, so a killed process leaves no file that looks
like the user's. A file counts as crossfield's while its present content is listed under its present name.
Names are only looked up: a damaged or forged list can never point to other files.
"""

from __future__ import annotations

import errno
import hashlib
import mmap
import os
import re
import stat
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

from .errors import OutputError

LIST: Final = ".crossfield.sha256"
MARK: Final = re.compile(r"\..*\.crossfield-[0-9a-f]{16}\.part", re.DOTALL)
"""Names of temporary files and folders (storage.py). What lies in one of the folders is on no list."""
FORCE: Final = "--force (force=True in Python)"
_HEAD: Final = (
    b"# Files that crossfield wrote here: it replaces and removes no others, and none that have changed.\n"
)
_NAMED: Final = 5  # files in the way that a message names
_PLAIN: Final = sum(getattr(os, flag, 0) for flag in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
"""Flags to open no link, and to wait for no pipe."""


def sha256_of(path: str | Path) -> str:
    """The SHA-256 of a file as 64 hexadecimal digits."""
    with Path(path).open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def add_to_list(folder: Path, written: Mapping[str, str]) -> None:
    """Add files to the list of a folder, unless it is temporary. written: SHA-256 by name. Raises OSError."""
    if _is_temporary(folder):
        return
    lines = b"".join(
        _line(name, digest)
        for name, digest in written.items()
        if not ((folder / name).exists() and _is_listed(folder, name, digest))
    )
    flags = os.O_RDWR | os.O_APPEND | _PLAIN
    try:
        descriptor = os.open(folder / LIST, flags)
    except FileNotFoundError:
        descriptor = os.open(folder / LIST, flags | os.O_CREAT)
        # Whoever may write to the folder may add to its list.
        (folder / LIST).chmod(0o644 | folder.stat().st_mode & 0o022)
    try:
        # One write, so that two processes do not mix their lines. A full disk may have cut the last one.
        before = b"" if os.fstat(descriptor).st_size else _HEAD
        if not before and os.lseek(descriptor, -1, os.SEEK_END) and os.read(descriptor, 1) != b"\n":
            before = b"\n"
        if os.write(descriptor, before + lines) < len(before + lines):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    finally:
        os.close(descriptor)


def is_unchanged(path: Path) -> bool:
    """Whether crossfield wrote this file under this name, and its content is still the same.

    False for links, folders and files that cannot be read, and without a readable list.
    """
    try:
        return stat.S_ISREG(path.lstat().st_mode) and _is_listed(path.parent, path.name, sha256_of(path))
    except OSError:
        return False


def _is_listed(folder: Path, name: str, digest: str) -> bool:
    """Whether the list of a folder has this content of a file; False without a readable list."""
    try:
        with (
            open(os.open(folder / LIST, os.O_RDONLY | _PLAIN), "rb") as stream,  # noqa: PTH123
            mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as listed,
        ):
            return listed.rfind(b"\n" + _line(name, digest)) >= 0  # the last writing is the likely one
    except (OSError, ValueError):  # an empty list cannot be mapped
        return False


def check_targets(
    folder: Path, names: Iterable[str], *, reads: Iterable[str | Path] = (), force: bool = False
) -> None:
    """Raise OutputError unless crossfield may write or remove these files of a folder.

    reads: files that the same call reads; they are never replaced. force: whether other files that crossfield
    has not written, or that have changed since, may be replaced.
    """
    names = list(dict.fromkeys(names))
    for parent in {(folder / name).parent for name in names}:
        if _exists(parent) and not parent.is_dir():
            raise OutputError("is no folder; choose another folder", file=parent)
    present = [name for name in names if _exists(folder / name)]
    read = [path.stat() for path in map(Path, reads) if path.exists()]
    for name in present:
        target = folder / name
        if target.exists() and any(os.path.samestat(target.stat(), status) for status in read):
            raise OutputError(
                "is read by the same command, which never replaces it; choose another folder or name",
                file=target,
            )
        if target.is_dir():
            raise OutputError("is a folder; choose another folder or name", file=target)
    if force or _is_temporary(folder):
        return
    others = [name for name in present if not is_unchanged(folder / name)]
    if not others:
        return
    remedy = f"choose another folder or name, or replace with {FORCE}"
    if len(others) == 1:
        raise OutputError(
            f"is not crossfield's, or has changed since it was written; {remedy}", file=folder / others[0]
        )
    more = f" and {len(others) - _NAMED} more" if len(others) > _NAMED else ""
    raise OutputError(
        f"has files that are not crossfield's, or have changed since they were written: "
        f"{', '.join(others[:_NAMED])}{more}; {remedy}",
        file=folder,
    )


def kept_notice(name: str, was: str, now: str) -> str:
    """A line about a better result that stays."""
    return f"kept the earlier {name} ({was}; now {now}); replace it with {FORCE}"


def _exists(path: Path) -> bool:
    """Whether there is a file, folder or link. Raises OutputError for a name that none can have."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except (OSError, ValueError) as error:  # too long, or with a null byte
        raise OutputError(f"cannot be written: {reason_of(error)}; choose another name", file=path) from error
    return True


def reason_of(error: OSError | ValueError) -> str:
    """The system's words for an error of a file, without number and name."""
    return (getattr(error, "strerror", None) or str(error)).lower()


def _is_temporary(folder: Path) -> bool:
    """Whether a folder is a temporary one, or inside of one."""
    return any(map(MARK.fullmatch, folder.absolute().parts))


def _line(name: str, digest: str) -> bytes:
    """The line of a file; a name with a backslash or the end of a line is escaped as `sha256sum` does."""
    escaped = name.replace("\\", "\\\\").replace("\n", "\\n").replace("\r", "\\r")
    return os.fsencode(f"{chr(92) if escaped != name else ''}{digest}  {escaped}\n")
