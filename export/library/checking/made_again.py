"""Comparison of a library with its documents rebuilt from its specification, fields and ledger."""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from ....models.instance.file import read_instance
from ....models.storage import read_bytes
from ...formats.registry import FORMATS
from ..building.entry_task import Entry, make_entry
from ..building.instance_task import Files, Preparation, source_of, stated_of
from ..ledger.points import METHOD, Provenance, ours
from .finding import Finding, close

_APART: Final = {"best", "files"}  # keys of a sidecar that are compared part by part


def entry_findings(folder: Path, sidecar: dict[str, Any], task: Entry) -> Iterator[Finding]:
    """Yield differences between an entry's files and those that its task makes. Raises CrossfieldError."""
    files, name = make_entry(task), f"{task.name}.json"
    made = json.loads(files[name])
    yield from _models(folder, sidecar, files)
    for key in dict.fromkeys((*made, *sidecar)):
        if key not in _APART and not same(sidecar.get(key), made.get(key)):
            yield Finding(name, f"states another {key} than follows from its instance and the ledger")
    if _described(sidecar["files"]) != _described(made["files"]):
        yield Finding(name, "states other files, or other facts about them, than its problem has")
    for key in ("point", "nl_point"):
        if sidecar["best"][key] != made["best"][key]:
            yield Finding(name, f"names another {key} than its problem has")
    if not close(sidecar["best"]["objective"], made["best"]["objective"]):
        yield Finding(name, "does not state the best of the known points")
    if Provenance.of(sidecar["best"]) not in _known(task):
        yield Finding(name, "names a finder of its point who found none of the known fields")


def same(stated: Any, made: Any) -> bool:
    """Whether two values of JSON are the same, numbers up to rounding."""
    if isinstance(made, dict):
        return (
            isinstance(stated, dict)
            and stated.keys() == made.keys()
            and all(same(stated[key], made[key]) for key in made)
        )
    if isinstance(made, list):
        return isinstance(stated, list) and len(stated) == len(made) and all(map(same, stated, made))
    if isinstance(made, float) and isinstance(stated, int | float) and not isinstance(stated, bool):
        return close(stated, made)
    return type(stated) is type(made) and bool(stated == made)


def _models(folder: Path, sidecar: dict[str, Any], made: Files) -> Iterator[Finding]:
    """Model files that differ from those written of the problem today."""
    for file in sidecar["files"]:
        name = file["name"]
        if file["format"] not in FORMATS:
            continue
        if name not in made:
            yield Finding(name, f"differs from the .{file['format']} of this problem")
        elif _content(made[name], name) != _content(read_bytes(folder / name), name):
            yield Finding(name, "does not hold the problem that its sidecar describes")


def _content(data: bytes, name: str) -> bytes | None:
    """Bytes of a file, unpacked; None if it is damaged."""
    with suppress(OSError, EOFError, zlib.error):
        return gzip.decompress(data) if name.endswith(".gz") else data
    return None


def _described(files: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The descriptions of files without size and checksum."""
    return [{key: file[key] for key in file if key not in {"bytes", "sha256"}} for file in files]


def _known(task: Entry) -> set[Provenance]:
    """The provenances of the known fields of an entry's instance."""
    known = {Provenance.of(facts) for facts in task.about["fields"].values()}
    return known | {each.provenance for each in task.submitted}


def instance_findings(folder: Path, name: str, about: dict[str, Any], task: Preparation) -> Iterator[Finding]:
    """Yield statements about an instance that do not follow from its recipe, except fields."""
    recipe = task.recipe
    instance = read_instance(folder / about["instance"]["file"])
    expected = {
        "name": task.name,
        "family": recipe.sketch.name,
        "title": recipe.sketch.title,
        "rung": recipe.rung,
        "source": source_of(instance, recipe),
        "recipe_sha256": task.sha256,
        **dict.fromkeys(("origin", "added")),
        **stated_of(recipe),
    }
    for key, value in expected.items():
        if not same(about.get(key), value):
            yield Finding(name, f"states another {key} than follows from the specification")
    if "given" in about:
        return
    known = {each.provenance for each in task.submitted}
    known |= {task.evidence.provenance} if task.evidence else set()
    known |= set(map(ours, ("greedy", "search", "two stages", METHOD)))
    for role, facts in about["fields"].items():
        found = Provenance.of(facts)
        by_highs = (found.solver, found.seconds, found.by) == ("HiGHS", None, None)  # of any version
        if found not in known and not by_highs:
            yield Finding(name, f"names a finder of its field {role} whom the ledger does not know")
