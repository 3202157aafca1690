"""Checking an entry of a library against its problem, formulated again from the instance: facts, model files, points, bounds.

Model files are written again and compared with what is in the library, unpacked; the best known point is read by the readers of solution
files and evaluated, and, by the checker that ships with every library, against the .mps and the instance without any rounding.
"""

from __future__ import annotations

import gzip
import tempfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any, Final

from ...models.errors import CrossfieldError, UnsupportedByFormatError
from ...models.problem import Problem
from ..formats import FORMATS, generator, write
from ..solution import Solution, read_solution
from .check_point import BadInputError, check
from .counts import counts, curvature, probtype, ranges
from .ledger import Ledger
from .points import complete_point
from .sidecar import is_proven, problem_of, relative_gap

BUILD: Final = "build the library again"
FEASIBLE: Final = 1e-8
"""The greatest violation of a point that a library takes."""
SAME: Final = 1e-9
"""Objectives this close, relative to their size or absolute, are the same."""
_BLOCK: Final = 1 << 20


@dataclass(frozen=True)
class Finding:
    """Something that is wrong with a library: in which file, what, and what helps."""

    file: str
    what: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.file}: {self.what}; {self.remedy}"


def of_error(error: CrossfieldError, file: str) -> Finding:
    """An error about a file as a finding; its message names what is wrong and what helps."""
    message = str(error).removeprefix(f"{error.file}: ")
    what, _, remedy = message.partition("; ")
    return Finding(file, what, remedy) if remedy and "; " not in remedy else Finding(file, message, BUILD)


def close(first: float, second: float) -> bool:
    """Whether two objectives are the same up to rounding."""
    try:
        return abs(first - second) <= SAME * max(1.0, abs(first), abs(second))
    except OverflowError:  # JSON may hold whole numbers beyond all doubles
        return False


def verify_entry(folder: Path, sidecar: dict[str, Any], ledger: Ledger) -> Iterator[Finding]:
    """What is wrong with an entry whose sidecar obeys its schema and whose files are those that it lists."""
    name = f"{sidecar['name']}.json"
    try:
        problem = problem_of(folder, sidecar)
    except CrossfieldError as error:
        yield of_error(error, Path(error.file or name).name)
        return
    yield from _facts(name, sidecar, problem)
    yield from _models(folder, sidecar, problem)
    if sidecar["best"] is not None:
        yield from _points(folder, sidecar, problem)
        yield from _exactly(folder, sidecar)
        yield from _unused(sidecar, problem, ledger)
    yield from _bounds(name, sidecar)


def _facts(name: str, sidecar: dict[str, Any], problem: Problem) -> Iterator[Finding]:
    """The sidecar tells of its problem what is so."""
    instance = problem.instance
    grid = {"pixels": instance.grid.size, "strokes": len(instance.theta), "pairs": len(instance.grid.first)}
    facts: dict[str, Any] = {
        "class": problem.problem_class,
        "convex": problem.convex,
        "probtype": probtype(problem),
        "counts": counts(problem),
        "curvature": curvature(problem),
        "ranges": ranges(problem),
        "instance": sidecar["instance"] | grid | {"sha256": instance.sha256},
    }
    for key, value in facts.items():
        if sidecar[key] != value:
            yield Finding(name, f"tells another {key} than its problem has", BUILD)


def _models(folder: Path, sidecar: dict[str, Any], problem: Problem) -> Iterator[Finding]:
    """The model files are what is written of the problem today, and what is refused is refused."""
    listed: dict[tuple[str, str], set[str]] = {}
    for file in sidecar["files"]:
        if file["format"] in FORMATS:
            listed.setdefault((file["format"], file["dialect"]), set()).add(file["name"])
    if listed and sidecar["generator"] != generator():
        made = f"was made by {sidecar['generator']}, so that {generator()} cannot write its files again to compare them"
        yield Finding(f"{sidecar['name']}.json", made, f"verify with {sidecar['generator']}")
        listed = {}
    for (kind, dialect), names in listed.items():
        with tempfile.TemporaryDirectory(prefix="crossfield-") as made:
            yield from _model(folder, names, problem, Path(made) / f"{sidecar['name']}.{kind}", dialect)


def _model(folder: Path, names: set[str], problem: Problem, path: Path, dialect: str) -> Iterator[Finding]:
    """The files of one format are those that are written again at a path."""
    try:
        written = write(problem, path, dialect=dialect)
    except UnsupportedByFormatError as error:
        yield Finding(min(names), f"cannot be: {error}", BUILD)
        return
    expected = {name: name if name in names else f"{name}.gz" for name in written.files}
    for name in sorted(names ^ set(expected.values())):
        yield Finding(name, f"is not what is written as {path.suffix} of this problem", BUILD)
    for name, held in expected.items():
        if held in names and not _same(path.with_name(name), folder / held):
            yield Finding(held, "does not hold the problem that its sidecar describes", BUILD)


def _same(first: Path, second: Path) -> bool:
    """Whether two files have the same content, the second one unpacked."""
    try:
        with first.open("rb") as one, (gzip.open if second.suffix == ".gz" else open)(second, "rb") as other:
            pairs = zip_longest(iter(lambda: one.read(_BLOCK), b""), iter(lambda: other.read(_BLOCK), b""))
            return all(mine == theirs for mine, theirs in pairs)
    except (OSError, EOFError, zlib.error):
        return False


def _points(folder: Path, sidecar: dict[str, Any], problem: Problem) -> Iterator[Finding]:
    """The files of the best known point can be read and have the objective and the violations that the sidecar tells."""
    best, listed = sidecar["best"], {file["name"] for file in sidecar["files"]}
    for key in ("point", "nl_point"):
        name = best[key]
        if name is None:
            continue
        if name not in listed:
            yield Finding(f"{sidecar['name']}.json", f"names {name} as a point and does not list it", BUILD)
            continue
        try:
            solution = read_solution(folder / name, problem)
        except CrossfieldError as error:
            yield of_error(error, name)
            continue
        yield from (Finding(name, what, BUILD) for what in _differences(best, solution))


def _differences(best: dict[str, Any], solution: Solution) -> Iterator[str]:
    """In what a point that was read differs from what a sidecar tells of it."""
    if solution.objective is None or solution.violation is None:
        yield "holds no point"
        return
    if not close(solution.objective, best["objective"]):
        yield f"has objective {solution.objective!r}, but its sidecar tells {best['objective']!r}"
    if solution.reported is not None and not close(solution.reported, best["objective"]):
        yield f"claims objective {solution.reported!r}, but its sidecar tells {best['objective']!r}"
    if solution.violation.worst > FEASIBLE:
        yield f"is not feasible: worst violation {solution.violation.worst:.3g}"
    if not close(solution.field.energy().total, best["energy_2norm"]):
        yield f"is of a field of energy {solution.field.energy().total!r}, but its sidecar tells {best['energy_2norm']!r}"


def _exactly(folder: Path, sidecar: dict[str, Any]) -> Iterator[Finding]:
    """The checker finds the same without rounding: against the .mps, and where jumps are variables against the instance."""
    best, point = sidecar["best"], folder / sidecar["best"]["point"]
    models = [(file["name"], best["objective"]) for file in sidecar["files"] if file["format"] == "mps"]
    if sidecar["jumps"] is None:
        models.append((sidecar["instance"]["file"], best["energy_2norm"]))
    for model, told in models:
        try:
            found = check(str(folder / model), str(point))
        except BadInputError as error:
            yield Finding(
                point.name, f"the checker refuses it: {str(error).removeprefix(f'{folder}/')}", BUILD
            )
            continue
        if float(found.worst) > FEASIBLE:
            yield Finding(
                point.name,
                f"is not feasible against {model}: worst violation {float(found.worst):.3g}",
                BUILD,
            )
        if not close(float(found.objective), told):
            yield Finding(
                point.name,
                f"has {float(found.objective)!r} against {model}, but its sidecar tells {told!r}",
                BUILD,
            )


def _unused(sidecar: dict[str, Any], problem: Problem, ledger: Ledger) -> Iterator[Finding]:
    """No field of the ledger is better than the best known point: then the build after it was stopped."""
    record = ledger.with_point(sidecar["name"])
    if record is None or record.problem_sha256 != problem.sha256:
        return
    try:
        objective = problem.objective_value(complete_point(problem, ledger.field(record)))
    except CrossfieldError:
        return  # told with the ledger
    told = sidecar["best"]["objective"]
    if objective < told and not close(objective, told):
        yield Finding(
            f"{sidecar['name']}.json", f"tells a worse point than {record.point}, which the ledger has", BUILD
        )


def _bounds(name: str, sidecar: dict[str, Any]) -> Iterator[Finding]:
    """Bounds, status and gap follow from each other and from the best known point."""
    bounds = [each["bound"] for each in sidecar["bounds"] if each["bound"] is not None]
    bound = max(bounds, default=None)
    if sidecar["bound"] != bound:
        yield Finding(
            name, f"tells the bound {sidecar['bound']}, but the best of its bounds is {bound}", BUILD
        )
    if sidecar["best"] is None:
        return
    objective = sidecar["best"]["objective"]
    if bound is not None and bound - objective > slack(objective):
        yield Finding(
            name, f"has a dual bound {bound!r} above the objective {objective!r} of its point", BUILD
        )
    expected: tuple[str, float | None] = ("best known", None)
    if bound is not None:
        expected = "optimal" if is_proven(objective, bound) else "best known", relative_gap(objective, bound)
    if (sidecar["status"], sidecar["gap"]) != expected:
        yield Finding(name, "tells another status or gap than follows from its bounds and its point", BUILD)


def slack(objective: float) -> float:
    """How far a solver's bound may lie above the optimum by its own tolerances."""
    return 1e-6 * max(1.0, abs(objective))
