"""Submitted files by kind, each solution with the log of its run."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from ....models.array_archive import ArrayArchive, ExpectedArray
from ....models.errors import CrossfieldError, InputError, InstanceError
from ....models.field import file as fields
from ....models.input_limits import MAX_HEAD, MAX_LOG
from ....models.proof import check_certificate
from ....models.storage import read_bytes
from ...solutions.logs.registry import LOG_READERS, read_log
from ...solutions.readers.registry import head_of, read_raw, recognised

Kind = Literal["solution", "log", "field", "certificate"]


@dataclass(frozen=True)
class Source:
    """A submitted file, or the solution and the log of one run.

    kind: empty if unknown. path: None for a log alone. listed: not only found in a folder.
    """

    kind: Kind | Literal[""]
    path: Path | None = None
    log: Path | None = None
    listed: bool = True
    error: CrossfieldError | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """The solution and the log, or the one file."""
        return tuple(dict.fromkeys(each for each in (self.path, self.log) if each is not None))


def sources_of(files: Sequence[str | Path]) -> list[Source]:
    """Return files by kind, solutions with their logs. Raises InputError if there are none."""
    found = [_source(path, listed) for path, listed in _expanded(files)]
    logs = {each.log.with_suffix(""): each.log for each in found if each.log and not each.path}
    paired = [
        replace(each, log=logs.get(each.path.with_suffix("")))
        if each.kind == "solution" and each.path and not each.log
        else each
        for each in found
    ]
    used = {each.log for each in paired if each.path}
    left = [each for each in paired if each.path or each.log not in used]
    if not left:
        raise InputError("there is nothing to submit; give files")
    return left


def _expanded(files: Iterable[str | Path]) -> Iterator[tuple[Path, bool]]:
    """The files with those in folders, and whether each was listed by itself."""
    for path in map(Path, files):
        if path.is_dir():
            inside = (each for each in sorted(path.rglob("*")) if not each.name.startswith("."))
            yield from ((each, False) for each in inside if each.is_file())
        else:
            yield path, True


def _source(path: Path, listed: bool) -> Source:
    try:
        kinds = kinds_of(path)
    except CrossfieldError as error:
        return Source("", path, error=error)
    if kinds == {"solution", "log"}:  # BARON's: which of both it is, depends on its content
        has_log = has_point = False
        with suppress(CrossfieldError):
            has_log = bool(read_log(path))
        with suppress(CrossfieldError):
            has_point = read_raw(path).has_point
        if has_point or not has_log:
            return Source("solution", path, path if has_log else None, listed)
        kinds = {"log"}
    kind: Kind | Literal[""] = next(iter(kinds), "")
    return Source("log", log=path, listed=listed) if kind == "log" else Source(kind, path, listed=listed)


def kinds_of(path: Path) -> set[Kind]:
    """Return the kinds of a file: none for an unknown kind, and two for BARON's, a solution and a log."""
    data = read_bytes(path)
    if path.suffix.lower() == ".rawfield":
        return {"field"}
    if data.startswith(b"PK"):
        return {"certificate" if _is_certificate(data) else "field"}
    head = head_of(data)
    if head.lstrip().startswith(b"{"):
        return {"field"} if _is_field(data) else set()
    found: set[Kind] = {"solution"} if recognised(head) else set()
    text = data[:MAX_LOG].decode("utf-8-sig", "replace").replace("\r\n", "\n")
    return found | ({"log"} if any(each.start.search(text) for each in LOG_READERS) else set())


def _is_certificate(data: bytes) -> bool:
    with suppress(InstanceError):
        head = ArrayArchive(data).arrays({"head": ExpectedArray(1, MAX_HEAD, "u")})["head"].tobytes()
        return check_certificate.FORMAT.encode() in head
    return False


def _is_field(data: bytes) -> bool:
    with suppress(ValueError, RecursionError):
        return bool(json.loads(data).get("format") == fields.FORMAT)
    return False
