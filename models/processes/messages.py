"""Messages between a process and its children, and the errors that name how a child failed."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import IO, Any, NamedTuple

from ..errors import CrossfieldError


class WorkerError(CrossfieldError):
    """A child process that died, or work that could not be sent to it or back."""


class Call(NamedTuple):
    """A function and its arguments, pickled; the function's name; the file for what it prints, or None."""

    work: bytes
    name: str
    log: Path | None


class Stop(NamedTuple):
    """A request to end the work at hand with what it has."""


class Raised:
    """An exception that the work raised."""

    def __init__(self, error: Exception, trace: str = "") -> None:
        """Keep the error and the text of its traceback."""
        self.error, self.trace = error, trace

    def again(self) -> Exception:
        """Return the error, with the child's traceback as a note."""
        if self.trace:
            self.error.add_note(self.trace)
        return self.error


def send(value: Any, stream: IO[bytes]) -> None:
    """Pickle a value into a pipe."""
    stream.write(pickle.dumps(value))
    stream.flush()
