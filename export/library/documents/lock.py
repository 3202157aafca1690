"""Lock on the folder of a library, which ends with the process that holds it.

The operating system locks the file `.lock` in the folder, so a crash leaves no lock behind. The file names
its holder, who removes it. The next process takes over the file of a process that crashed.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Final

from filelock import FileLock, Timeout

from ....models.errors import OutputError, shortened
from ....models.processes.deadline import Progress, silent

LOCK: Final = ".lock"
PATIENCE: Final = 600.0  # seconds that a process waits for another one to end


@contextmanager
def library_lock(folder: Path, action: str, progress: Progress = silent) -> Iterator[None]:
    """Lock a library. Raises OutputError after PATIENCE seconds, or for a folder that cannot be written.

    action: shown to processes that wait.
    """
    path = folder / LOCK
    lock = FileLock(path, timeout=PATIENCE, poll_interval=0.1)
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
        with suppress(OSError):  # Windows refuses to write a locked file
            path.write_text(f"{action}, process {os.getpid()} on {socket.gethostname()}", "utf-8")
        yield
    finally:
        # Before the release, because waiting processes check that the file they locked still has its name.
        with suppress(OSError):
            path.unlink()
        lock.release()


def library_lock_if_writable(
    folder: Path, action: str, progress: Progress = silent
) -> AbstractContextManager[None]:
    """Lock a folder for reading, unless it cannot be written."""
    return library_lock(folder, action, progress) if os.access(folder, os.W_OK) else nullcontext()


def _holder(path: Path) -> str:
    with suppress(OSError):
        return shortened(path.read_bytes()[:300].decode("utf-8", "replace"), 200) or "another process"
    return "another process"
