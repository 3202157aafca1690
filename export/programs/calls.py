"""Calls into the module of a program; they run in a child process, which imports that module only."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ...models.errors import CrossfieldError
from .protocol import FailedError


def call(program: str, step: str, *arguments: Any) -> Any:
    """Call a function of a program's module: `version`, `read`, `evaluate` or `solve` (see protocol.py).

    Raises the module's own errors, and FailedError for errors of the program's interface.
    """
    try:
        return getattr(import_module(f"{__package__}.{program}"), step)(*arguments)
    except CrossfieldError:
        raise
    except Exception as error:
        raise FailedError(f"{type(error).__name__}: {error}") from error
