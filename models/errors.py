"""The one family of errors; every message names the place and the remedy in one line."""

from __future__ import annotations

from pathlib import Path


class CrossfieldError(Exception):
    """Base of all errors that crossfield raises on purpose."""

    def __init__(self, message: str, *, file: str | Path | None = None) -> None:
        """Keep the message on one line, led by the file it is about."""
        line = " ".join(message.split())
        super().__init__(f"{file}: {line}" if file is not None else line)
        self.file = file


class InputError(CrossfieldError):
    """A sketch, picture, mask or option that cannot be used."""


class InstanceError(CrossfieldError):
    """An instance or an instance file that breaks the rules of its format."""


class FormulationError(CrossfieldError):
    """An unknown formulation, or an option that the formulation does not have."""


class UnsupportedByFormatError(CrossfieldError):
    """A format that cannot carry a formulation; raised before a byte is written."""


class SolverError(CrossfieldError):
    """A solver that failed on a file."""


class MissingSolverError(SolverError):
    """A solver that is not installed."""


class UnsupportedBySolverError(SolverError):
    """A solver that does not take problems of this class."""


class SolutionError(CrossfieldError):
    """A solution file that is malformed, empty, or of another problem."""


class OutputError(CrossfieldError):
    """A file or folder that cannot be written."""
