"""The number of threads of BLAS, which is a setting of the whole process."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any, Final

from threadpoolctl import OpenBLASController, ThreadpoolController

_LOCK: Final = threading.Lock()
_HELD: Final[list[Any]] = []  # the limit of BLAS, once for each context that is open


@contextmanager
def one_thread() -> Iterator[None]:
    """Context, and decorator, that limits BLAS to one thread: faster on tiny blocks, with constant sums.

    Contexts may be nested, and several threads may be inside at once. The number of threads of BLAS is a
    setting of the whole process: it returns to its old value when the last context ends.
    """
    with _LOCK:
        if _HELD:
            _HELD.append(_HELD[0])
        else:
            with _any_thread_may_set():
                _HELD.append(_libraries().limit(limits=1, user_api="blas"))
    try:
        yield
    finally:
        with _LOCK:
            held = _HELD.pop()
            if not _HELD:
                with _any_thread_may_set():
                    held.restore_original_limits()


@contextmanager
def _any_thread_may_set() -> Iterator[None]:
    """Context in which threadpoolctl lets this thread set the number of threads of OpenBLAS."""
    # Since version 3.8 it ignores all threads but the first, and another may be the last to leave.
    release = getattr(OpenBLASController, "clear_controlling_thread", None)
    if release is None:
        yield
        return
    release(force=True)
    try:
        yield
    finally:
        release(force=True)


@cache
def _libraries() -> ThreadpoolController:
    """The libraries of this process that run threads; looking for them takes milliseconds."""
    return ThreadpoolController()
