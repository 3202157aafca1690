"""Functions that tests have called in child processes."""

import os
import time
from pathlib import Path

from crossfield.models.processes import child_program


def until_stopped(begun: Path) -> str:
    """Wait until the parent requests a stop."""
    begun.touch()
    while not child_program.is_stopped():
        time.sleep(0.01)
    return "stopped"


def deaf(begun: Path) -> None:
    """Work on, ignoring requests of the parent."""
    begun.touch()
    time.sleep(600)


def hooked(begun: Path) -> list[str]:
    """Calls of a hook after the parent requested a stop."""
    heard: list[str] = []
    with child_program.on_stop(lambda: heard.append("hook")):
        begun.touch()
        while not heard:
            time.sleep(0.01)
    return heard[:1]


def prints() -> None:
    """Print through Python and past it."""
    print("from Python")
    os.write(1, b"from C\n")
    os.write(2, b"an error\n")
