"""The processes behind the page: one for fields, surfaces and files each. The newest edit wins."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from typing import Any, Final

from ...models.errors import CrossfieldError
from ...models.processes.child import Child, KilledError
from ...models.processes.child_program import WorkerError
from ...models.processes.deadline import IsOver, never
from .session import OvertakenError
from .views import load_module

_KINDS: Final = ("fields", "surfaces", "files")
_MOST_TABS: Final = 100  # whose newest edits are remembered


class ClosedError(CrossfieldError):
    """Work that ended with the server."""


class Desk(AbstractContextManager["Desk"]):
    """Child processes that take one call at a time, and the newest edit of each page."""

    def __init__(self) -> None:
        """Create the processes; each starts with its first call."""
        self._children = {kind: Child(one_thread=True, remedy="choose a smaller size") for kind in _KINDS}
        self._closed = False
        self._threads = {kind: ThreadPoolExecutor(1) for kind in _KINDS}
        self._newest: OrderedDict[str, int] = OrderedDict()
        self._lock = threading.Lock()
        for kind in ("fields", "surfaces"):  # the first edit should not wait for imports
            self.submit(kind, load_module)

    def __exit__(self, *_: object) -> None:
        """End all processes."""
        self.close()

    def close(self) -> None:
        """End all processes, whatever they are doing; calls that wait for them fail."""
        self._closed = True
        for kind in _KINDS:
            self._children[kind].close()
            self._threads[kind].shutdown()

    def begin(self, page: str, edit: int) -> IsOver:
        """Note an edit of a page; return a function that states whether a newer one has replaced it."""
        with self._lock:
            self._newest[page] = max(edit, self._newest.pop(page, edit))
            while len(self._newest) > _MOST_TABS:
                self._newest.popitem(last=False)
        return lambda: self._newest.get(page, edit) != edit

    def submit(
        self, kind: str, work: Callable[..., Any], *arguments: Any, stop: IsOver = never
    ) -> Future[Any]:
        """The result of work in the process of a kind. It raises OvertakenError once `stop` returns True."""
        return self._threads[kind].submit(self._call, self._children[kind], work, arguments, stop)

    def _call(self, child: Child, work: Callable[..., Any], arguments: tuple[Any, ...], stop: IsOver) -> Any:
        if stop():
            raise OvertakenError("a newer edit replaced this one")
        try:
            return child.call(work, *arguments, stop=stop).value
        except KilledError as error:
            raise OvertakenError("a newer edit replaced this one") from error
        except WorkerError as error:
            if self._closed:
                raise ClosedError("the server was stopped; start `crossfield studio` again") from error
            raise
