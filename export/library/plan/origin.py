"""What a specification states: where a sketch comes from, and what a release of the library is called.

Nothing is supposed where nothing is stated: a sketch without a licence has none that a library could tell.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from datetime import date
from typing import Any, Final

from ....models.errors import InputError


@dataclass(frozen=True)
class Origin:
    """Who made a sketch, its licence (an SPDX identifier at best) and where it is from; empty: not stated."""

    author: str = ""
    license: str = ""
    source: str = ""

    @classmethod
    def of(cls, table: dict[str, Any]) -> Origin:
        """The origin that the table of a sketch states."""
        return cls(*(table.get(key, "") for key in cls.__dataclass_fields__))

    def document(self) -> dict[str, str]:
        """What is stated, by key."""
        return {key: value for key, value in asdict(self).items() if value}


NOTHING_STATED: Final = Origin()


@dataclass(frozen=True)
class Release:
    """A state of a library that is to be cited. date: as 2026-11-22; authors: names as they are cited."""

    version: str
    date: str
    authors: tuple[str, ...]

    @classmethod
    def of(cls, table: dict[str, Any]) -> Release:
        """The release that a table states. Raises InputError for a day that no calendar has."""
        return cls(table["version"], day(table["date"], "release.date"), tuple(table["authors"]))

    def document(self) -> dict[str, Any]:
        """The release as a table of a specification."""
        return {"version": self.version, "date": self.date, "authors": list(self.authors)}


def day(text: str, place: str) -> str:
    """The day, which is in the calendar. Raises InputError."""
    try:
        return date.fromisoformat(text).isoformat()
    except ValueError as error:
        raise InputError(f"{place}: {text!r} is no day; write one as 2026-11-22") from error
