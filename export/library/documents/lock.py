"""One process at a time at a library: a lock on its folder, which ends with the process that holds it.

The lock is a file `.lock` in the folder that the system locks for its holder (filelock: flock, on Windows
msvcrt), so that a crash leaves no lock behind; the file tells who holds it. It is removed by the holder, and
a file that a crash has left is taken over by the next one.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Final

from filelock import FileLock, Timeout

from ....models.errors import OutputError, shortened
from ....models.processes.progress import Progress, silent

FILE: Final = ".lock"
PATIENCE: Final = 600.0
"""Seconds that a process waits for another one to end."""
_TICK: Final = 0.1  # seconds between two looks


@contextmanager
def locked(folder: Path, action: str, progress: Progress = silent) -> Iterator[None]:
    """Nothing; meanwhile no other process changes or verifies the library in a folder.

    action: what is done, for others that wait. Raises OutputError when another one does not end within
    PATIENCE seconds, or the folder cannot be written.
    """
    path = folder / FILE
    lock = FileLock(path, timeout=PATIENCE, poll_interval=_TICK)
    try:
        try:
            lock.acquire(timeout=0)
        except Timeout:
            progress(f"{action} waits for {_holder(path)}, which is at work on {folder}")
            lock.acquire()
    except Timeout as error:
        raise OutputError(
            f"is held by {_holder(path)}; {action} waited {PATIENCE:g} s for it: "
            "run it again when that has ended",
            file=folder,
        ) from error
    except OSError as error:
        raise OutputError(
            f"cannot be written: {(error.strerror or str(error)).lower()}; choose another folder", file=folder
        ) from error
    try:
        with suppress(OSError):  # Windows lets nobody write a file that is locked
            path.write_text(f"{action}, process {os.getpid()} on {socket.gethostname()}", "utf-8")
        yield
    finally:
        # Before the release: those that wait look whether the file that they locked still has its name.
        with suppress(OSError):
            path.unlink()
        lock.release()


@contextmanager
def unchanged(folder: Path, action: str, progress: Progress = silent) -> Iterator[None]:
    """As `locked`, for who only reads; a folder that cannot be written is read without a lock."""
    with locked(folder, action, progress) if os.access(folder, os.W_OK) else nullcontext():
        yield


def _holder(path: Path) -> str:
    """Who holds a lock, in words."""
    try:
        told = path.read_bytes()[:300].decode("utf-8", "replace")
    except OSError:
        told = ""
    return shortened(told, 200) or "another process"
