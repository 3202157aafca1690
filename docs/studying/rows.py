"""A run and its row, and the CSV files with the rows.

A row is one line, flushed to the disk before the next run starts. After a kill, an incomplete line is cut
off when the file is read again, and that run is repeated.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

PARTS: Final = ("quality", "practice")
"""One file each."""
FAILED: Final = "failed"
PROOF: Final = "prove"


class Keyed:
    """A dataclass of what identifies a run."""

    @property
    def key(self) -> tuple[str, ...]:
        """Its values as text."""
        return tuple(text(getattr(self, part.name)) for part in fields(self))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Run(Keyed):
    """One run: one field from one instance.

    instance: its name (studying/instances.py). hidden: number of the hidden curve, -1 for none. noise:
    standard deviation in degrees of the noise on each stroke. way: the method. norm: of the energy, if the
    way has a choice. limit: seconds.
    """

    part: str
    instance: str
    size: int
    way: str
    norm: int = 2
    w_strokes: float = 1.0
    w_beta: float = 1e-6
    hidden: int = -1
    noise: float = 0.0
    limit: float = 0.0
    seed: int = 0


ASKED: Final = tuple(field.name for field in fields(Run))
FOUND: Final = (
    "version", "status", "objective", "bound", "energy_2", "energy_1", "error", "off", "seconds", "pixels",
    "pairs", "note", "machine", "load",
)  # fmt: skip
"""Results of a run. error: degrees to the hidden curve or the true field; off: to the strokes shown."""
COLUMNS: Final = ASKED + FOUND
NUMBERS: Final = frozenset(
    {"size", "norm", "w_strokes", "w_beta", "hidden", "noise", "limit", "seed", "objective", "bound"}
    | {"energy_2", "energy_1", "error", "off", "seconds", "pixels", "pairs", "load"}
)
Row = dict[str, Any]
Names = tuple[str, ...]
Table = tuple[tuple[str, ...], list[list[str]]]
"""Heads and cells of a table."""
DATA: Final = Path(__file__).resolve().parent / "data"


def text(value: Any) -> str:
    """A value in a file: eleven digits of a number, an empty text for None."""
    if value is None:
        return ""
    return f"{value:.11g}" if isinstance(value, float) else " ".join(str(value).split())


def number(cell: str) -> float | None:
    """A number of a file; None for an empty text."""
    return float(cell) if cell else None


class Rows:
    """The rows of a part, in a file that grows by whole lines."""

    def __init__(
        self, path: Path, asked: Names = ASKED, found: Names = FOUND, numbers: frozenset[str] = NUMBERS
    ) -> None:
        """Read the file, after cutting off an incomplete line. The names are of its columns."""
        self._path, self._asked, self._found, self._numbers = path, asked, found, numbers
        self.rows: list[Row] = []
        if path.exists():
            self._mend()
            self.rows = list(read(path, asked + found, numbers))
        self.done = {key_of(row, asked) for row in self.rows}

    def _mend(self) -> None:
        data = self._path.read_bytes()
        whole = data.rfind(b"\n") + 1
        if whole < len(data):
            with self._path.open("r+b") as file:
                file.truncate(whole)

    def append(self, run: Keyed, results: dict[str, Any]) -> None:
        """Add the row of a run; it is on the disk afterwards."""
        if run.key in self.done:
            raise ValueError(f"{run} has a row already")
        fresh = not self._path.exists() or not self._path.stat().st_size
        columns = self._asked + self._found
        line = [*run.key, *(text(results.get(name)) for name in self._found)]
        with self._path.open("a", newline="", encoding="utf-8") as file:
            file.write((_line(columns) if fresh else "") + _line(line))
            file.flush()
            os.fsync(file.fileno())
        self.done.add(run.key)
        self.rows.append(row_with_numbers(dict(zip(columns, line, strict=True)), self._numbers))


def _line(cells: tuple[str, ...] | list[str]) -> str:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerow(cells)
    return buffer.getvalue()


def read(path: Path, columns: Names = COLUMNS, numbers: frozenset[str] = NUMBERS) -> Iterator[Row]:
    """The rows of a file, with numbers as numbers; a last line without an end is ignored."""
    whole = path.read_bytes().rpartition(b"\n")[0].decode()
    head, *lines = csv.reader(io.StringIO(whole, newline="")) if whole else [columns]
    if tuple(head) != columns:
        raise ValueError(f"{path.name} has other columns than this study; move it away")
    for line in lines:
        yield row_with_numbers(dict(zip(columns, line, strict=True)), numbers)


def row_with_numbers(cells: dict[str, str], numbers: frozenset[str]) -> Row:
    """A row with its numbers as numbers."""
    return {name: number(value) if name in numbers else value for name, value in cells.items()}


def key_of(row: Row, asked: Names = ASKED) -> tuple[str, ...]:
    """The key of the run of a row."""
    return tuple(text(row[name]) for name in asked)


def tables(folder: Path) -> dict[str, Rows]:
    """The rows of every part in a folder, made where it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    return {part: Rows(folder / f"{part}.csv") for part in PARTS}
