"""What a library should say, made again from its sources and compared with what it says.

Only what was searched for is taken from the library: the fields of each instance, and the records of the
ledger. All else follows from these.
"""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from ....models.instance.file import read_instance
from ....models.storage import read_bytes
from ...formats.registry import FORMATS
from ..building.entry_task import Entry, make_entry
from ..building.instance_task import Files, Preparation, source_of, stated_of
from ..ledger.certificates import METHOD
from ..ledger.points import Provenance, ours
from .finding import Finding, close

_FROM_EACH_OTHER: Final = {"best", "bound", "gap", "files"}
"""Keys of a sidecar that are compared elsewhere: with points, with each other, file by file."""


def entry_findings(folder: Path, sidecar: dict[str, Any], task: Entry) -> Iterator[Finding]:
    """Where an entry's files differ from what its task makes today. Raises CrossfieldError without a task."""
    files, name = make_entry(task), f"{task.name}.json"
    made = json.loads(files[name])
    yield from _models(folder, sidecar, files)
    for key in dict.fromkeys((*made, *sidecar)):
        if key not in _FROM_EACH_OTHER and not same(sidecar.get(key), made.get(key)):
            yield Finding(name, f"tells another {key} than follows from its instance and the ledger")
    if _described(sidecar["files"]) != _described(made["files"]):
        yield Finding(name, "tells other files, or other things of them, than are made of its problem")
    for key in ("point", "nl_point"):
        if sidecar["best"][key] != made["best"][key]:
            yield Finding(name, f"names another {key} than is made of its problem")
    if not close(sidecar["best"]["objective"], made["best"]["objective"]):
        yield Finding(name, "does not tell the best of the known points")
    if Provenance.of(sidecar["best"]) not in _known(task):
        yield Finding(name, "says that somebody found its point who found none of the known fields")


def same(told: Any, made: Any) -> bool:
    """Whether two values of JSON are the same, numbers up to rounding."""
    if isinstance(made, dict):
        return (
            isinstance(told, dict)
            and told.keys() == made.keys()
            and all(same(told[key], made[key]) for key in made)
        )
    if isinstance(made, list):
        return isinstance(told, list) and len(told) == len(made) and all(map(same, told, made))
    if isinstance(made, float) and isinstance(told, int | float) and not isinstance(told, bool):
        return close(told, made)
    return type(told) is type(made) and bool(told == made)


def _models(folder: Path, sidecar: dict[str, Any], made: Files) -> Iterator[Finding]:
    """The model files are what is written of the problem today."""
    for file in sidecar["files"]:
        name = file["name"]
        if file["format"] not in FORMATS:
            continue
        if name not in made:
            yield Finding(name, f"is not what is written as .{file['format']} of this problem")
        elif _content(made[name], name) != _content(read_bytes(folder / name), name):
            yield Finding(name, "does not hold the problem that its sidecar describes")


def _content(data: bytes, name: str) -> bytes | None:
    """Bytes of a file, unpacked; None when it is damaged."""
    try:
        return gzip.decompress(data) if name.endswith(".gz") else data
    except (OSError, EOFError, zlib.error):
        return None


def _described(files: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """What is said of files, but for what their bytes decide."""
    return [{key: file[key] for key in file if key not in {"bytes", "sha256"}} for file in files]


def _known(task: Entry) -> set[Provenance]:
    """Who found the fields that are known of an entry's instance."""
    return {Provenance.of(facts) for facts in task.about["fields"].values()} | {
        each.provenance for each in task.submitted
    }


def instance_findings(folder: Path, name: str, about: dict[str, Any], task: Preparation) -> Iterator[Finding]:
    """Where what is said of an instance differs from its recipe, its fields aside."""
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
            yield Finding(name, f"tells another {key} than follows from the specification")
    known = {each.provenance for each in task.submitted}
    known |= {task.evidence.provenance} if task.evidence else set()
    for role, facts in about["fields"].items():
        found = Provenance.of(facts)
        if "given" not in about and found not in known and not _is_of_a_build(found):
            yield Finding(name, f"says that somebody found its field {role} of whom the ledger knows nothing")


def _is_of_a_build(found: Provenance) -> bool:
    """Whether a field is one that a build finds itself; the version of HiGHS is that of whoever built."""
    by_highs = (found.solver, found.seconds, found.by) == ("HiGHS", None, None)
    return by_highs or found in map(ours, _METHODS)


_METHODS: Final = ("greedy", "search", "two stages", METHOD)
