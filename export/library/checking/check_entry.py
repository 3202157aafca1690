"""Checks of an entry and of its runs.

The entry is made again and compared with the library. Its best known point is read from its files and
evaluated, and checked exactly against the .mps and the instance by the checker that every library contains.
"""

from __future__ import annotations

import gzip
import json
import os
import zlib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ....models.errors import CrossfieldError
from ....models.formulations.problem import Problem
from ....models.storage import read_bytes
from ...formats.registry import FORMATS, generator
from ...solutions.solution import Solution, read_solution
from ..building.entry_task import Entry, make_entry
from ..building.instance_task import Files, Preparation, files_of
from ..documents.check_point import BadInputError, check
from ..documents.documents import about_file, problem_of
from ..ledger.given import given_of
from ..ledger.ledger import FILE as LEDGER
from ..ledger.ledger import Ledger
from ..ledger.points import METHOD, Provenance, complete_point, ours
from ..ledger.standing import FEASIBLE, close
from ..plan.sources import instance_from

BUILD: Final = "build the library again"
_APART: Final = {"best", "files"}  # keys of a sidecar that are compared part by part
_AGAIN: Final = "restore it, or submit the run again"


@dataclass(frozen=True)
class Finding:
    """A defect of a library: file, description and remedy."""

    file: str
    what: str
    remedy: str = BUILD

    def __str__(self) -> str:
        return f"{self.file}: {self.what}; {self.remedy}"


def of_error(error: CrossfieldError, file: str) -> Finding:
    """Return an error about a file as a finding; its message names defect and remedy."""
    message = str(error).removeprefix(f"{error.file}: ")
    what, _, remedy = message.partition("; ")
    return Finding(file, what, remedy) if remedy and "; " not in remedy else Finding(file, message)


def verify_entry(
    folder: Path, sidecar: dict[str, Any], ledger: Ledger, task: Entry | None
) -> Iterator[Finding]:
    """Yield findings about an entry with a valid sidecar and all its files; task: None for damaged inputs."""
    name = f"{sidecar['name']}.json"
    try:
        problem = problem_of(folder, sidecar)
    except CrossfieldError as error:
        yield of_error(error, Path(error.file or name).name)
        return
    if sidecar["generator"] != generator():
        made = f"was made by {sidecar['generator']}, so {generator()} cannot make it again to compare it"
        yield Finding(name, made, f"verify with {sidecar['generator']}")
    elif task is not None:
        try:
            yield from entry_findings(folder, sidecar, task)
        except CrossfieldError as error:
            yield of_error(error, Path(error.file or name).name)
    yield from _points(folder, sidecar, problem)
    yield from _exactly(folder, sidecar)
    yield from _kept(sidecar["name"], problem, ledger)


def _points(folder: Path, sidecar: dict[str, Any], problem: Problem) -> Iterator[Finding]:
    """Findings in the files of the best known point: unreadable, or another objective than stated."""
    best, listed = sidecar["best"], {file["name"] for file in sidecar["files"]}
    for key in ("point", "nl_point"):
        name = best[key]
        if name is None:
            continue
        if name not in listed:
            yield Finding(f"{sidecar['name']}.json", f"names {name} as a point and does not list it")
            continue
        try:
            solution = read_solution(folder / name, problem)
        except CrossfieldError as error:
            yield of_error(error, name)
            continue
        yield from (Finding(name, what) for what in _differences(best, solution))


def _differences(best: dict[str, Any], solution: Solution) -> Iterator[str]:
    """Differences between a point that was read and the statements of its sidecar."""
    if solution.objective is None or solution.violation is None:
        yield "holds no point"
        return
    if not close(solution.objective, best["objective"]):
        yield f"has objective {solution.objective!r}, but its sidecar states {best['objective']!r}"
    if solution.reported is not None and not close(solution.reported, best["objective"]):
        yield f"claims objective {solution.reported!r}, but its sidecar states {best['objective']!r}"
    found = solution.violation
    if found.worst > FEASIBLE:
        yield f"is not feasible: worst violation {found.worst:.3g}"
    elif not close(max(found.rows, found.bounds), best["violation"]) or not close(
        found.integrality, best["integrality"]
    ):
        yield "has other violations than its sidecar states"
    if not close(solution.field.energy().total, best["energy_2norm"]):
        yield (
            f"is of a field of energy {solution.field.energy().total!r}, "
            f"but its sidecar states {best['energy_2norm']!r}"
        )


def _exactly(folder: Path, sidecar: dict[str, Any]) -> Iterator[Finding]:
    """Findings of the exact checker, against the .mps and, where possible, the instance."""
    best, point = sidecar["best"], folder / sidecar["best"]["point"]
    models = [(file["name"], best["objective"]) for file in sidecar["files"] if file["format"] == "mps"]
    if sidecar["jumps"] is None:
        models.append((sidecar["instance"]["file"], best["energy_2norm"]))
    for model, stated in models:
        try:
            found = check(str(folder / model), str(point))
        except BadInputError as error:
            yield Finding(
                point.name, f"the checker refuses it: {str(error).removeprefix(f'{folder}{os.sep}')}"
            )
            continue
        if float(found.worst) > FEASIBLE:
            yield Finding(
                point.name, f"is not feasible against {model}: worst violation {float(found.worst):.3g}"
            )
        if not close(float(found.objective), stated):
            yield Finding(
                point.name,
                f"has {float(found.objective)!r} against {model}, but its sidecar states {stated!r}",
            )


def _kept(entry: str, problem: Problem, ledger: Ledger) -> Iterator[Finding]:
    """A false objective of the field that the ledger keeps for an entry."""
    record = ledger.with_point(entry)
    if record is None or record.primal is None or record.problem_sha256 != problem.sha256:
        return
    with suppress(CrossfieldError):  # reported with the ledger
        if not close(problem.objective_value(complete_point(problem, ledger.field(record))), record.primal):
            yield Finding(LEDGER, f"states another objective of {record.point} than it has", _AGAIN)


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
    known |= {ours(METHOD)} if task.recipe.tightened else set()
    return known | {each.provenance for each in task.submitted}


def instance_findings(folder: Path, about: dict[str, Any], task: Preparation) -> Iterator[Finding]:
    """Yield differences between the document of an instance and the one made from its recipe and fields.

    Raises CrossfieldError for a damaged field or certificate.
    """
    name, instance = about_file(task.name), instance_from(task.recipe)
    if about["instance"]["sha256"] != instance.sha256:
        yield Finding(about["instance"]["file"], "is not the instance that follows from the specification")
        return
    own = task.given or given_of(folder, about)
    made = json.loads(files_of(replace(task, given=own), instance)[name])
    given = {} if task.given is None else {"given": task.given.sha256}
    made |= {"recipe_sha256": task.sha256, "given": None} | given
    for key in (
        dict.fromkeys((*made, *about)) if about["generator"] == generator() else ("fields", "certificates")
    ):
        if not same(about.get(key), made.get(key)):
            yield Finding(name, f"states another {key} than follows from the specification and its fields")
    if "given" in about:
        return
    known = {each.provenance for each in task.submitted}
    known |= {each.provenance for each in task.evidence}
    known |= set(map(ours, ("greedy", "search", "two stages", METHOD)))
    for role, facts in about["fields"].items():
        found = Provenance.of(facts)
        by_highs = (found.solver, found.seconds, found.by) == ("HiGHS", None, None)  # of any version
        if found not in known and not by_highs:
            yield Finding(name, f"names a finder of its field {role} whom the ledger does not know")
