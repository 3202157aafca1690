"""Messages between a process and its children, and the error that names how a child failed."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import IO, Any, NamedTuple

from ..errors import CrossfieldError


class WorkerError(CrossfieldError):
    """A child process ended early, or a task, result or error cannot be sent to or from it."""


class Task(NamedTuple):
    """A pickled function with its arguments, and the file for its output, or None."""

    work: bytes
    log: Path | None


class Stop(NamedTuple):
    """A request to end the current work with its present result."""


def send(value: Any, stream: IO[bytes]) -> None:
    """Write a value to a pipe at once."""
    stream.write(pickle.dumps(value))
    stream.flush()


def reason(error: Exception) -> str:
    """Name and message of an error of any kind."""
    return f"{type(error).__name__}: {error}"
