"""Ctrl-C, and child processes in groups of their own: starting and killing them on each system.

Ctrl-C on a terminal reaches the group in the foreground. A child in another group is controlled by the
process that started it. On Windows, `kill_group` ends the child but not its children.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, Final

if sys.platform == "win32":
    KILLED: Final = 1
else:
    KILLED: Final = -int(signal.SIGKILL)
"""Exit code of a killed process; on Windows other failures have it too."""


def start_group(command: Sequence[str], **options: Any) -> subprocess.Popen[Any]:
    """Child process in a group of its own. `options` are the options of `subprocess.Popen`."""
    if sys.platform == "win32":
        return subprocess.Popen(command, creationflags=subprocess.CREATE_NEW_PROCESS_GROUP, **options)
    else:  # noqa: RET505 - a type checker for Windows takes the lines after such a block for unreachable
        return subprocess.Popen(command, start_new_session=True, **options)


def kill_group(child: subprocess.Popen[Any]) -> None:
    """Kill a child of `start_group` with its group, even when the child itself has ended."""
    if sys.platform == "win32":
        child.kill()
    else:
        with suppress(ProcessLookupError, PermissionError):  # macOS denies it if only ended ones are left
            os.killpg(child.pid, signal.SIGKILL)


def describe_exit(code: int) -> str:
    """Description of an exit code: 'ended with code 3' or 'was killed by signal SIGSEGV'."""
    if code >= 0:
        return f"ended with code {code}"
    try:
        return f"was killed by signal {signal.Signals(-code).name}"
    except ValueError:  # a real-time signal
        return f"was killed by signal {-code}"


class _Presses:
    """The handler of Ctrl-C of all nested blocks of `catch_interrupts`."""

    def __init__(self) -> None:
        self._pressed = False

    def __call__(self, _number: int, _frame: Any) -> None:
        if self._pressed:
            raise KeyboardInterrupt
        self._pressed = True

    def is_pressed(self) -> bool:
        return self._pressed


def are_interrupts_caught() -> bool:
    """Whether a block of `catch_interrupts` decides what Ctrl-C ends, the second one included."""
    return isinstance(signal.getsignal(signal.SIGINT), _Presses)


@contextmanager
def catch_interrupts() -> Iterator[Callable[[], bool]]:
    """A function that returns whether Ctrl-C was pressed; a second Ctrl-C interrupts at once.

    A block inside another one has the same function, so Ctrl-C ends the work of both: a proof, and the search
    in it. Outside the main thread, and where signals are ignored already, it always returns False.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is signal.SIG_IGN:
        yield lambda: False
        return
    if isinstance(before, _Presses):
        yield before.is_pressed
        return
    presses = _Presses()
    signal.signal(signal.SIGINT, presses)
    try:
        yield presses.is_pressed
    finally:
        signal.signal(signal.SIGINT, before)
