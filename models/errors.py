"""The one family of errors; every message names the place and the remedy in one line."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

LONGEST: Final = 1000  # characters of a message, without the name of its file
QUOTED: Final = 80  # characters of a text from a file that a message quotes
_HEAD: Final = 0.7  # share of a shortened text from its beginning; the rest is its end with the remedy


def printable(text: str) -> str:
    """The text on one line, safe for a terminal: invisible characters become escapes."""
    line = " ".join(text.split())
    return line if line.isprintable() else "".join(map(_visible, line))


def _visible(character: str) -> str:
    if character == " " or unicodedata.category(character)[0] not in "CZ":
        return character
    return character.encode("unicode_escape").decode("ascii")


def shortened(text: object, most: int = QUOTED) -> str:
    """A printable text from a file for a message, without its middle where it exceeds `most` characters."""
    try:
        full = str(text)
    except ValueError:  # a whole number of more digits than Python writes
        full = "a number of thousands of digits"
    beyond = len(full) > 2 * most  # avoids making megabytes printable to show one line
    line = printable(full[:most] + "..." + full[-most:] if beyond else full)
    head = int(_HEAD * most)
    return line if len(line) <= most else f"{line[:head]} ... {line[head + 5 - most :]}"


def quote_line(line: bytes) -> str:
    """A line of a file in quotes, for a message."""
    return repr(shortened(line.decode("utf-8", "replace")))


class CrossfieldError(Exception):
    """Base of all errors that crossfield raises on purpose."""

    def __init__(self, message: str, *, file: str | Path | None = None) -> None:
        """Store the message on one safe line, preceded by the file that it concerns."""
        line = shortened(message, LONGEST)
        super().__init__(f"{printable(str(file))}: {line}" if file is not None else line)
        self.file = file

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the message unchanged: the constructor would shorten it again, file included."""
        return _rebuild_error, (type(self), self.args), self.__dict__


def _rebuild_error(kind: type[CrossfieldError], args: tuple[str, ...]) -> CrossfieldError:
    error = kind.__new__(kind)
    error.args = args
    return error


@contextmanager
def naming(file: str | Path) -> Iterator[None]:
    """Name this file in errors of crossfield raised in the block that name no file."""
    try:
        yield
    except CrossfieldError as error:
        if error.file is not None:
            raise
        raise type(error)(str(error), file=file) from error


class InputError(CrossfieldError):
    """A sketch, picture, mask or option that cannot be used."""


class InstanceError(CrossfieldError):
    """An instance or an instance file that breaks the rules of its format."""


class MeshError(InstanceError):
    """A mesh that is no oriented manifold of triangles."""


class DomainError(InstanceError):
    """A command for pixels with an instance on a mesh, or the reverse."""


class NoStrokeError(InputError, InstanceError):
    """A sketch without pixels or strokes: its mask misses them, or the grid is too coarse."""


class FormulationError(CrossfieldError):
    """An unknown formulation, or an option that it does not have."""


class UnsupportedByFormatError(CrossfieldError):
    """A format that cannot hold a formulation; raised before a byte is written."""


class SolverError(CrossfieldError):
    """A solver that failed on a file or had too little time."""


class MissingSolverError(SolverError):
    """A solver that is not installed, or does not accept its licence."""


class UnsupportedBySolverError(SolverError):
    """A solver that does not take problems of this class."""


class SolutionError(CrossfieldError):
    """A solution file that is malformed, empty or belongs to another problem."""


class OutputError(CrossfieldError):
    """A file or folder that cannot be written."""
