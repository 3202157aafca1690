"""Lock on the folder of a library, which needs no file and ends with the process that holds it."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ....models.processes.deadline import Progress, silent


@contextmanager
def library_lock(folder: Path, action: str, progress: Progress = silent) -> Iterator[None]:
    """Let one process at a time work on a library; others wait.

    action: shown by a process that waits. Windows, and some file systems, have no locks on folders.
    """
    if sys.platform == "win32":
        yield
    else:
        import fcntl

        descriptor = os.open(folder, os.O_RDONLY)
        try:
            with suppress(OSError):
                try:
                    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    progress(f"{action} waits for another process, which is at work on {folder}")
                    fcntl.flock(descriptor, fcntl.LOCK_EX)
            yield
        finally:
            with suppress(OSError):  # in child processes, too, which have the descriptor
                fcntl.flock(descriptor, fcntl.LOCK_UN)
            os.close(descriptor)
