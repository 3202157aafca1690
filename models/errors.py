"""The one family of errors; every message names the place and the remedy in one line."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

LONGEST: Final = 1000
"""Characters of a message, its file aside."""
QUOTED: Final = 80
"""Characters of a text from a file inside of a message."""
_HEAD: Final = (
    0.7  # part of a shortened text that is its beginning; the rest is its end, where the remedy stands
)


def printable(text: str) -> str:
    """The text on one line, safe for a terminal: invisible characters as their escapes."""
    line = " ".join(text.split())
    return line if line.isprintable() else "".join(map(_visible, line))


def _visible(character: str) -> str:
    if character == " " or unicodedata.category(character)[0] not in "CZ":
        return character
    return character.encode("unicode_escape").decode("ascii")


def shortened(text: object, most: int = QUOTED) -> str:
    """A text from a file for a message: printable, its middle left out beyond `most` characters."""
    try:
        whole = str(text)
    except ValueError:  # a whole number of more digits than Python writes
        whole = "a number of thousands of digits"
    beyond = len(whole) > 2 * most  # do not make megabytes printable to show a line of them
    line = printable(whole[:most] + "..." + whole[-most:] if beyond else whole)
    head = int(_HEAD * most)
    return line if len(line) <= most else f"{line[:head]} ... {line[head + 5 - most :]}"


class CrossfieldError(Exception):
    """Base of all errors that crossfield raises on purpose."""

    def __init__(self, message: str, *, file: str | Path | None = None) -> None:
        """Keep the message on one line that is safe to print, led by the file it is about."""
        line = shortened(message, LONGEST)
        super().__init__(f"{printable(str(file))}: {line}" if file is not None else line)
        self.file = file

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the message as it stands: the constructor would shorten it again, file included."""
        return _unpickled, (type(self), self.args), self.__dict__


def _unpickled(kind: type[CrossfieldError], args: tuple[str, ...]) -> CrossfieldError:
    error = kind.__new__(kind)
    error.args = args
    return error


@contextmanager
def naming(file: str | Path) -> Iterator[None]:
    """Nothing; errors of crossfield that name no file meanwhile come out naming this one."""
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


class NoStrokeError(InputError, InstanceError):
    """No pixel or no stroke of a sketch is left: its mask misses them, or the grid is too coarse for it."""


class FormulationError(CrossfieldError):
    """An unknown formulation, or an option that the formulation does not have."""


class UnsupportedByFormatError(CrossfieldError):
    """A format that cannot carry a formulation; raised before a byte is written."""


class SolverError(CrossfieldError):
    """A solver that failed on a file, or that had too little time."""


class MissingSolverError(SolverError):
    """A solver that is not installed."""


class UnsupportedBySolverError(SolverError):
    """A solver that does not take problems of this class."""


class SolutionError(CrossfieldError):
    """A solution file that is malformed, empty, or of another problem."""


class OutputError(CrossfieldError):
    """A file or folder that cannot be written."""
