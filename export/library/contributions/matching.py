"""Submitted files by kind, each solution with the log of its run, and their entries in a library."""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Literal

from ....models.array_archive import ArrayArchive, Expected
from ....models.errors import CrossfieldError, InputError, InstanceError, SolutionError
from ....models.field import file as fields
from ....models.formulations.problem import Problem
from ....models.input_limits import MAX_HEAD, MAX_LOG
from ....models.proof import check_certificate
from ....models.storage import read_bytes
from ...formats.registry import FORMATS
from ...solutions.logs.registry import LOG_READERS
from ...solutions.logs.run_log import RunLog
from ...solutions.readers.registry import READERS, read_raw
from ...solutions.readers.text import HEAD, RawSolution, with_unix_ends
from ...solutions.solution import read_solution
from ..documents.documents import Library, problem_of
from ..ledger import ledger
from .run_record import LogFile, RunFacts

Kind = Literal["solution", "log", "field", "certificate", "ledger"]

_JSON: Final[dict[str, Kind]] = {fields.FORMAT: "field", ledger.FORMAT: "ledger"}
_ENTRY: Final = re.compile(r"cf_[a-z0-9_]+")
_ADDED: Final = 4  # columns that solvers add to those of the model
_LISTED: Final = 4  # entries named in a message


def kinds_of(path: Path) -> set[Kind]:
    """Return the kinds of a file: none for an unknown kind, and two for BARON's, a solution and a log."""
    data = read_bytes(path)
    if path.suffix.lower() == ".rawfield":
        return {"field"}
    if data.startswith(b"PK"):
        return {"certificate" if _is_certificate(data) else "field"}
    head = _unpacked_head(data)
    if head.lstrip().startswith(b"{"):
        return _json_kinds(data)
    found: set[Kind] = {"solution"} if any(each.recognises(head) for each in READERS) else set()
    text = data[:MAX_LOG].decode("utf-8-sig", "replace").replace("\r\n", "\n")
    return found | ({"log"} if any(each.start.search(text) for each in LOG_READERS) else set())


def _is_certificate(data: bytes) -> bool:
    with suppress(InstanceError):
        head = ArrayArchive(data).arrays({"head": Expected(1, MAX_HEAD, "u")})["head"].tobytes()
        return check_certificate.FORMAT.encode() in head
    return False


def _json_kinds(data: bytes) -> set[Kind]:
    with suppress(ValueError, RecursionError):
        stated = json.loads(data).get("format")
        if isinstance(stated, str) and stated in _JSON:
            return {_JSON[stated]}
    return set()


def _unpacked_head(data: bytes) -> bytes:
    if data.startswith(b"\x1f\x8b"):
        with suppress(OSError, EOFError, zlib.error):
            data = zlib.decompressobj(zlib.MAX_WBITS | 16).decompress(data, HEAD)
    return with_unix_ends(data[:HEAD].removeprefix(b"\xef\xbb\xbf"))


@dataclass(frozen=True)
class Source:
    """A submitted file, or the solution and the log of one run. listed: not only found in a folder."""

    kind: Kind | Literal["bound", ""]
    path: Path | None = None
    log: Path | None = None
    listed: bool = True
    error: CrossfieldError | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """The solution and the log, or the one file."""
        return tuple(dict.fromkeys(each for each in (self.path, self.log) if each is not None))

    @property
    def name(self) -> str:
        """Names of the files, for messages."""
        return " and ".join(each.name for each in self.files) or "the bound"


def sources_of(files: Sequence[str | Path], facts: RunFacts) -> list[Source]:
    """Return files by kind, solutions with their logs. Raises InputError for facts that do not fit them."""
    found = [_source(path, listed) for path, listed in _expanded(files)]
    logs = {each.path.with_suffix(""): each for each in found if each.kind == "log" and each.path}
    paired = []
    for each in found:
        log = logs.get(each.path.with_suffix("")) if each.kind == "solution" and each.path else None
        paired.append(replace(each, log=log.path) if log and each.log is None else each)
    used = {each.log for each in paired}
    left = [
        replace(each, path=None, log=each.path) if each.kind == "log" else each
        for each in paired
        if each.kind != "log" or each.path not in used
    ]
    if not files and facts.bound is not None:
        return [Source("bound")]
    if not left:
        raise InputError("there is nothing to submit; give files, or an entry and a bound")
    is_run = len(left) == 1 and left[0].kind not in ("field", "certificate", "ledger")
    if not is_run and (facts.bound, facts.status) != (None, None):
        raise InputError("a bound or status belongs to one run; submit the files of that run alone")
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
    if kinds != {"solution", "log"}:
        return Source(next(iter(kinds), ""), path, listed=listed)
    has_log = has_point = False
    with suppress(CrossfieldError):
        has_log = bool(LogFile.read(path))
    with suppress(CrossfieldError):
        has_point = read_raw(path).has_point
    if has_log and not has_point:
        return Source("log", path)
    return Source("solution", path, path if has_log else None)


class Entries:
    """The entries of a library with their problems, each formulated once."""

    def __init__(self, library: Library) -> None:
        self.library = library
        self._problems: dict[str, Problem] = {}

    def problem(self, sidecar: dict[str, Any]) -> Problem:
        """Return the problem of an entry. Raises as `problem_of`."""
        name = sidecar["name"]
        if name not in self._problems:
            self._problems[name] = problem_of(self.library, sidecar)
        return self._problems[name]

    def by_file_name(self, path: Path) -> str:
        """Return the longest name of an entry with which the file's name begins; empty if there is none."""
        names = self.library.document["entries"]
        return max((each for each in names if re.match(rf"{each}([._-]|$)", path.name)), key=len, default="")

    def by_stamp(self, stamps: Iterable[str]) -> str:
        """Return the only entry whose problem has one of the stamps; empty if there is none."""
        found = {self._stamps[stamp] for stamp in stamps if stamp in self._stamps}
        return found.pop() if len(found) == 1 else ""

    @cached_property
    def _stamps(self) -> dict[str, str]:
        return {self.problem(each).stamp: each["name"] for each in self.library.entries}

    def named_in(self, text: str) -> set[str]:
        """Return the entries that a text names."""
        return {name for name in _ENTRY.findall(text) if name in self.library.document["sha256"]}

    def of_log(self, log: RunLog, path: Path) -> str:
        """Return the entry of a log by its stamps, the names in it or the file's name; empty if unknown."""
        named = self.named_in(log.text)
        only = named.pop() if len(named) == 1 else ""
        return self.by_stamp(log.stamps) or only or self.by_file_name(path)

    def of_solution(self, raw: RawSolution, path: Path) -> str:
        """Return the entry of a solution by stamp, file name or columns. Raises SolutionError if unclear."""
        name = (self.by_stamp([raw.stamp]) if raw.stamp else "") or self.by_file_name(path)
        if name:
            return name
        fitting = [each["name"] for each in self.library.entries if self._fits(raw, path, each)]
        if len(fitting) == 1:
            return str(fitting[0])
        if not fitting:
            raise SolutionError("fits no entry of the library; name the entry if it should", file=path)
        listed = ", ".join(fitting[:_LISTED]) + (", ..." if len(fitting) > _LISTED else "")
        raise SolutionError(
            f"fits {len(fitting)} entries of the library ({listed}); name the entry", file=path
        )

    def _fits(self, raw: RawSolution, path: Path, sidecar: dict[str, Any]) -> bool:
        """Whether a solution has exactly the columns of one of an entry's model files."""
        if raw.names is None:
            return False
        counts, pairs = sidecar["counts"], sidecar["instance"]["pairs"]
        most = counts["variables"] + pairs + _ADDED  # the format may have lifted a product per pair
        least = 0 if raw.omits_zeros else counts["variables"]
        if not least <= len(raw.values) <= most:
            return False
        try:
            problem = self.problem(sidecar)
            found = read_solution(path, problem)
        except CrossfieldError:
            return False
        beyond = max(problem.objective_degree, problem.row_degree) > FORMATS["mps"].degree
        return found.unknown == 0 and (beyond or not found.problem.formulation.lifted)
