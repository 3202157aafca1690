"""Control of the work in a child process: requests of the parent to stop."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

_STOP: Final = threading.Event()
_HOOKS: Final[list[Callable[[], object]]] = []
_LOCK: Final = threading.Lock()


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
