"""Complete files or none: written under a temporary name beside the final one, then renamed.

Nothing replaces a file that crossfield has not written or that has changed since (written_files.py).
"""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import count
from pathlib import Path
from typing import IO, Final

if sys.platform != "win32":
    import fcntl

from .errors import CrossfieldError, InputError, OutputError
from .written_files import MARK, add_to_list, check_targets, is_unchanged, reason_of, sha256_of

_UNFINISHED: Final[set[Path]] = set()
_FULL: Final = {errno.ENOSPC, errno.EDQUOT}
_LONGEST: Final = 50  # characters of a name that a neighbour's name repeats, at most 200 of 255 bytes


@contextmanager
def replacing(
    path: str | Path, *, force: bool = False, sha256: Callable[[], str] | None = None
) -> Iterator[IO[bytes]]:
    """A binary stream to a temporary neighbour of `path` that replaces it on success.

    On any failure, Ctrl-C included, the neighbour is removed and the old file at `path` stays. Raises
    OutputError when the folder cannot be written or the disk is full. Unless forced, it also refuses a `path`
    with a file that crossfield has not written, or that has changed since.

    sha256: returns the hash of what was written, for callers that compute it themselves.
    """
    path = Path(path)
    check_targets(path.parent, [path.name], force=force)
    with _temporary_neighbour(path, lambda new: new.open("xb").close()) as temporary:
        try:
            with temporary.open("wb") as stream:
                yield stream
            check_targets(path.parent, [path.name], force=force)
            add_to_list(path.parent, {path.name: sha256() if sha256 else sha256_of(temporary)})
            temporary.replace(path)
        except OSError as error:
            raise OutputError(
                f"cannot be written: {reason_of(error)}; free some space or choose another folder", file=path
            ) from error


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder for the time of the block. Raises OutputError where the disk of temporary files is full."""
    with tempfile.TemporaryDirectory(prefix="crossfield-", ignore_cleanup_errors=True) as name:
        folder = Path(name).resolve()
        try:
            yield folder
        except OSError as error:
            # A copy names its source first; a stream that is written to has no name.
            written = Path(error.filename2 or error.filename or folder)
            if error.errno not in _FULL or not written.is_relative_to(folder):
                raise
            raise OutputError(
                f"has no room for temporary files ({reason_of(error)}); free some space, or set TMPDIR to "
                "another folder",
                file=tempfile.gettempdir(),
            ) from error


@dataclass(frozen=True)
class NewResults:
    """Results that `replace_results` installs at its end.

    path: the temporary folder to write them to. folder: where they go. kept: names of earlier files that stay
    as they are, whatever the temporary folder holds.
    """

    path: Path
    folder: Path
    kept: set[str] = field(default_factory=set)

    def set_aside(self) -> Path:
        """Give the temporary folder a visible name, so that its files do not take their places; return it."""
        names = (self.folder / f"new-results{number or ''}" for number in count())
        return self.path.rename(next(path for path in names if not os.path.lexists(path)))


@contextmanager
def replace_results(
    folder: str | Path, planned: Iterable[str], *, reads: Iterable[str | Path] = (), force: bool = False
) -> Iterator[NewResults]:
    """A temporary folder whose files take their places in `folder` together on success.

    At the same time, earlier files of the planned names are removed if they are neither replaced nor kept,
    and if they are unchanged since crossfield wrote them. On any failure, Ctrl-C included, all files stay.

    folder: created if it does not exist. planned: names, relative to it, of all files that may be written, in
    the order in which they appear. reads: files that the same call reads; they are never replaced, even if
    forced. force: whether to replace files that crossfield has not written or that have changed since.

    Raises OutputError at the beginning, for files in the way, with their names and remedies, and for a folder
    that cannot be written; and at the end, for files that came into the way during the work. The new ones
    then stay in a folder that the message names.
    """
    existed, folder, order, reads = os.path.lexists(folder), make_folder(folder), [*planned], tuple(reads)
    check_targets(folder, order, reads=reads, force=force)
    with ExitStack() as stack:
        if not existed:
            stack.callback(_remove_if_empty, folder)
        temporary = stack.enter_context(_temporary_neighbour(folder / "results", Path.mkdir))
        new = NewResults(temporary, folder)
        try:
            yield new
        except CrossfieldError as error:  # the user knows the files by their names in the folder
            error.args = tuple(str(text).replace(str(temporary), str(folder)) for text in error.args)
            raise
        if not temporary.exists():
            return
        paths = sorted(
            path for path in temporary.rglob("*") if path.is_file() and not MARK.fullmatch(path.name)
        )
        staged: dict[str, Path | None] = {path.relative_to(temporary).as_posix(): path for path in paths}
        others = [name for name in staged if name not in order]
        steps = {name: staged.get(name) for name in others + order if name not in new.kept}
        steps = {name: path for name, path in steps.items() if path or is_unchanged(folder / name)}
        try:
            check_targets(folder, steps, reads=reads, force=force)
            _install(steps, folder)
        except OutputError as error:
            raise OutputError(f"{error}; the new files are in {new.set_aside()}") from error


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


def _install(steps: dict[str, Path | None], folder: Path) -> None:
    """Move files to their names in a folder, and remove those of names without a file.

    All are listed before one appears. Ctrl-C waits until all are done. Raises OutputError.
    """
    digests: dict[Path, dict[str, str]] = {}
    for name, path in steps.items():
        if path is not None:
            target = folder / name
            digests.setdefault(make_folder(target.parent), {})[target.name] = sha256_of(path)
    try:
        for place, written in digests.items():
            add_to_list(place, written)
        interrupt: KeyboardInterrupt | None = None
        while steps:
            try:
                _move_first(steps, folder)
            except KeyboardInterrupt as error:
                interrupt = error
    except OSError as error:
        raise OutputError(
            f"cannot be written: {reason_of(error)}; choose another folder", file=folder
        ) from error
    if interrupt is not None:
        raise interrupt


def _move_first(steps: dict[str, Path | None], folder: Path) -> None:
    """Take the first of the steps of `_install`; it may have been interrupted before."""
    name, path = next(iter(steps.items()))
    if path is None:
        (folder / name).unlink(missing_ok=True)
    elif path.exists():
        path.replace(folder / name)
    del steps[name]


@contextmanager
def _temporary_neighbour(path: Path, create: Callable[[Path], object]) -> Iterator[Path]:
    """A new temporary file or folder beside `path`, removed at the end unless it was renamed.

    A lock shows other processes that it is in use. Raises OutputError when it cannot be created.
    """
    temporary, lock = neighbour(path), None
    try:
        try:
            remove_dead(path.parent)
            while lock is None:
                temporary = neighbour(path)
                _UNFINISHED.add(temporary)
                create(temporary)
                with suppress(BlockingIOError, FileNotFoundError):  # another process took it for a dead one
                    lock = _lock(temporary)
        except OSError as error:
            raise OutputError(
                f"cannot be written: {reason_of(error)}; choose another folder", file=path
            ) from error
        yield temporary
    finally:
        _remove(temporary)
        if lock is not None and lock >= 0:
            os.close(lock)
        _UNFINISHED.discard(temporary)


def _lock(temporary: Path) -> int:
    """Descriptor that locks a temporary file or folder until it is closed or its process ends.

    -1 on systems and disks without locks. Raises BlockingIOError if it is locked, FileNotFoundError if it is
    removed.
    """
    if sys.platform == "win32":
        return -1
    else:  # noqa: RET505 - see models/processes/process_groups.py
        descriptor = os.open(temporary, os.O_RDONLY | os.O_NOFOLLOW)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            temporary.lstat()
        except OSError as error:
            os.close(descriptor)
            if isinstance(error, BlockingIOError | FileNotFoundError):
                raise
            return -1
        return descriptor


def remove_unfinished() -> None:
    """Remove the temporary files that this process still has when it ends early.

    Ctrl-C can come between two lines of the blocks above, where none of their handlers sees it.
    """
    for path in tuple(_UNFINISHED):
        _remove(path)


def _remove(path: Path) -> None:
    """Remove a temporary file or folder, if it is there."""
    with suppress(OSError):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def neighbour(path: Path) -> Path:
    """A new name in the folder of `path`, used by nobody else."""
    return path.with_name(f".{path.name[:_LONGEST]}.crossfield-{secrets.token_hex(8)}.part")


@lru_cache(maxsize=1024)
def remove_dead(folder: Path) -> None:
    """Remove temporary files of this user's killed processes from a folder, once per process and folder.

    Their locks ended with their processes, which may have run in other containers. No write needs the
    removal, because names are never used twice. Raises OSError when the folder cannot be listed.
    """
    if sys.platform != "win32":
        for path in folder.iterdir():
            with suppress(OSError):
                if not MARK.fullmatch(path.name) or path.lstat().st_uid != os.geteuid():
                    continue
                lock = _lock(path)
                if lock >= 0:
                    _remove(path)
                    os.close(lock)


def write_bytes(path: str | Path, data: bytes, *, force: bool = False) -> Path:
    """Write `data` and return the path. Raises OutputError, as `replacing`."""
    with replacing(path, force=force) as stream:
        stream.write(data)
    return Path(path)


def require_suffix(path: Path, *allowed: str) -> None:
    """Raise InputError for a file with none of the allowed suffixes."""
    if path.suffix.lower() not in allowed:
        has = f"the suffix {path.suffix!r}" if path.suffix else "no suffix"
        raise InputError(f"has {has}, which selects no format; choose one of {', '.join(allowed)}", file=path)


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
        raise InputError(f"cannot be read: {reason_of(error)}", file=path) from error


def make_folder(path: str | Path) -> Path:
    """Create the folder with its parents if it is missing, and return it. Raises OutputError."""
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise OutputError(
            f"cannot be created: {reason_of(error)}; choose another folder", file=path
        ) from error
    return path
