"""Messages between a process and its children, and requests of the parent to stop the work in a child."""

from __future__ import annotations

import pickle
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Final, NamedTuple

from ..errors import CrossfieldError

_STOP: Final = threading.Event()
_HOOKS: Final[list[Callable[[], object]]] = []
_LOCK: Final = threading.Lock()


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


def stopped() -> bool:
    """Return whether the parent has requested a stop of the current work."""
    return _STOP.is_set()


@contextmanager
def on_stop(hook: Callable[[], object]) -> Iterator[None]:
    """Call `hook` from another thread at each request to stop, and at once if one has arrived already."""
    with _LOCK:
        _HOOKS.append(hook)
        late = _STOP.is_set()
    try:
        if late:
            hook()
        yield
    finally:
        with _LOCK:
            _HOOKS.remove(hook)


def ask_to_stop() -> None:
    """Record that the parent requests a stop, and call the hooks."""
    with _LOCK:
        _STOP.set()
        hooks = tuple(_HOOKS)
    for hook in hooks:
        hook()


def begin() -> None:
    """Forget requests to stop earlier work."""
    _STOP.clear()
