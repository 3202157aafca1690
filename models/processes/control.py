"""Control of the work in a child process: whether the parent asked it to stop."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

_STOP: Final = threading.Event()
_HOOKS: Final[list[Callable[[], object]]] = []
_LOCK: Final = threading.Lock()


def stopped() -> bool:
    """Return whether the work at hand was asked to stop."""
    return _STOP.is_set()


@contextmanager
def on_stop(hook: Callable[[], object]) -> Iterator[None]:
    """Call `hook` from another thread each time the work is asked to stop, and at once if it was already."""
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
    """Note that the parent asks the work to stop, and call the hooks."""
    with _LOCK:
        _STOP.set()
        hooks = tuple(_HOOKS)
    for hook in hooks:
        hook()


def begin() -> None:
    """Forget requests to stop that were meant for earlier work."""
    _STOP.clear()
