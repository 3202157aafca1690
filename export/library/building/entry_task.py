"""The task of each entry: model files in every format, the best known point, and the sidecar last.

`Inputs` collects the inputs of these tasks, for building and verifying alike.
"""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from ....models.errors import InputError, UnsupportedByFormatError
from ....models.field.file import read_field
from ....models.formulations.catalogue import FORMULATIONS
from ....models.formulations.problem import Problem, formulate
from ....models.instance.file import read_instance
from ....models.instance.grid import Ints
from ....models.instance.instance import Instance
from ....models.proof.certificate import read_certificate
from ....models.storage import read_bytes
from ...bundle.starts import Start, start_of
from ...formats.nl import Layout
from ...formats.registry import Written, generator, write
from ...solutions.readers.ampl import write_ampl_sol
from ...writing.curvature import probtype
from ...writing.records import number
from ..documents.citation import REFERENCES
from ..documents.documents import FORMAT, VERSION, as_bytes, listed_jumps, tightened_by
from ..documents.statistics import counts, curvature, density, tangent_bound
from ..ledger.given import NO_POINTS, Points
from ..ledger.ledger import FILE as LEDGER
from ..ledger.ledger import Ledger, Record
from ..ledger.points import METHOD, Best, Known, Provenance, best_point, complete_point, ours
from ..ledger.standing import (
    best_of_each,
    contradicts,
    cut,
    difficulty,
    is_proven,
    relative_gap,
    runs_of,
    standing,
)
from ..plan.equivalence import equivalent, notes_of
from ..plan.recipe import EntryRecipe, InstancePlan, digest, entry_name
from .instance_task import Evidence, Files, Preparation, Submitted

_TANGENT = "tangent at the point"
_SOLVED, _NOT_PROVEN = 0, 100  # AMPL's solve codes: solved; solved, but not for sure


@dataclass(frozen=True)
class Entry:
    """The task of an entry: its recipe, and the document and files of its instance.

    records, submitted: of all entries of the instance in the ledger; relatives: its plain entries.
    """

    recipe: EntryRecipe
    about: dict[str, Any]
    files: Files
    records: tuple[Record, ...] = ()
    submitted: tuple[Submitted, ...] = ()
    relatives: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the entry."""
        return self.recipe.name

    @property
    def sha256(self) -> str:
        """Digest of everything that its files depend on."""
        submitted = [hashlib.sha256(each.data).hexdigest() for each in self.submitted]
        records = [asdict(record) for record in self.records]
        recipe = self.recipe.document()
        return digest([generator(), recipe, self.about, records, submitted, self.relatives])

    @property
    def certificate(self) -> dict[str, Any] | None:
        """The facts about the certificate in the norm that the entry minimises; None without one."""
        found: dict[str, Any] | None = self.about.get("certificates", {}).get(str(self.recipe.norm))
        return found


def make_entry(task: Entry) -> Files:
    """Return the files of an entry, the sidecar last."""
    with tempfile.TemporaryDirectory(prefix="crossfield-") as temporary:
        made = Path(temporary)
        instance, known = _read(task, made)
        problem = formulated(instance, task.recipe.formulation, task.recipe.facet, known["baseline"].field.p)
        certified = None
        if task.recipe.tightened and task.certificate is not None:
            certificate = read_certificate(made / task.certificate["file"], on=instance)
            problem, certified = tightened_by(certificate, problem), certificate.field
        written, refused = write_models(problem, task.recipe, made)
        listed = _models(problem, written)
        best = best_point(problem, list(known.values()), certified)
        records = _records(task, best, instance)
        bounds = _bounds(task, best, records)
        results = _results(task, best, records, bounds)
        listed += _points(task, best, made, proven=results["status"] == "optimal")
        document = _sidecar(task, best, listed, refused) | results | _context(task, problem)
        files = {each["name"]: (made / each["name"]).read_bytes() for each in listed}
        return files | {f"{task.name}.json": as_bytes(document)}


def _read(task: Entry, folder: Path) -> tuple[Instance, dict[str, Known]]:
    """The instance and its known fields by role."""
    for name, data in task.files.items():
        (folder / name).write_bytes(data)
    known = {
        role: Known(read_field(folder / facts["file"]), Provenance.of(facts))
        for role, facts in task.about["fields"].items()
    }
    instance = read_instance(folder / task.about["instance"]["file"])
    for place, each in enumerate(task.submitted):
        submitted = each.known()
        if submitted.field.instance.sha256 == instance.sha256:
            known[f"submitted {place}"] = submitted
    return instance, known


def formulated(instance: Instance, formulation: str, facet: str, jumps: Ints | None) -> Problem:
    """Return the problem of an entry. jumps: fixed ones, which only `qp-fixed` has."""
    recipe = FORMULATIONS[formulation]
    options = {"facet": facet} if "facet" in recipe.settable else {}
    return formulate(instance, formulation, p=jumps if recipe.fixed else None, **options)


def write_models(problem: Problem, recipe: EntryRecipe, folder: Path) -> tuple[list[Written], dict[str, str]]:
    """Write the model files of an entry; return what was written, and why the other formats are refused."""
    written, refused = [], {}
    for name in recipe.formats:
        path = folder / f"{recipe.name}.{name}{'.gz' if recipe.compress else ''}"
        try:
            written.append(write(problem, path))
        except UnsupportedByFormatError as error:
            refused[name] = str(error)
    return written, refused


def _models(problem: Problem, written: list[Written]) -> list[dict[str, Any]]:
    """Facts of model files for a sidecar."""
    return [
        {
            "name": name,
            "format": each.format,
            "dialect": each.dialect,
            **facts,
            "notes": notes_of(problem, each.format),
        }
        for each in written
        for name, facts in each.files.items()
    ]


def _points(task: Entry, best: Best, folder: Path, *, proven: bool) -> list[dict[str, Any]]:
    """Facts of the files of the best point in the folder: in MIPLIB's format, and in AMPL's for a .nl."""
    path = folder / f"{task.name}.sol"
    path.write_bytes(b"".join(_miplib(best)))
    listed = [_listed(path, "miplib", ["columns as in the .mps and .lp; those at 0 are left out"])]
    if "nl" in task.recipe.formats:
        layout = Layout(best.problem)
        path = folder / f"{task.name}.nl.sol"
        message = f"{best.known.provenance.solver}: objective {number(best.objective)}"
        code = _SOLVED if proven else _NOT_PROVEN
        point, rows = best.point[layout.order], best.problem.n_rows
        write_ampl_sol(path, message, point, rows, code, stamp=best.problem.stamp)
        listed.append(_listed(path, "ampl", ["columns in the order of the .nl and its .col"]))
    return listed


def _miplib(best: Best) -> Iterator[bytes]:
    """The lines of a .sol file in MIPLIB's format, with the columns of LP and MPS."""
    held = start_of(best.problem, best.known.field).problem
    start = Start(held, complete_point(held, best.known.field))
    yield f"=obj= {number(start.objective)}\n".encode()
    yield from start.lines(zeros=False)


def _listed(path: Path, dialect: str, notes: list[str]) -> dict[str, Any]:
    data = path.read_bytes()
    facts = {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    return {"name": path.name, "format": "sol", "dialect": dialect, **facts, "notes": notes}


def _bounds(task: Entry, best: Best, records: list[Record]) -> list[dict[str, Any]]:
    """The best dual bound of each solver for this optimum, and the bounds of tangent and certificate.

    A bound is at most the best objective. Raises InputError if the point contradicts it.
    """
    found, name = [], task.name
    stated = ("solver", "version", "bound", "status", "seconds", "threads")
    for record in best_of_each((each for each in records if each.bound is not None), name):
        via = None if record.entry == name else record.entry
        found.append({key: getattr(record, key) for key in stated} | {"via": via})
    tangent = tangent_bound(best.problem, best.point)
    certificate = task.certificate
    if tangent is not None:
        found.append(_computed(_TANGENT, tangent))
    if certificate is not None:
        found.append(_computed(METHOD, certificate["bound"]) | {"certificate": certificate["file"]})
    for each in found:
        bound = float(each["bound"])
        if contradicts(bound, best.objective):
            remedy = "build again without it" if each["status"] == "computed" else "take its record out"
            raise InputError(
                f"has the bound {bound!r} of {each['via'] or name} by {each['solver']}, "
                f"but {name} has a feasible point of {best.objective!r}; that bound is wrong, {remedy}",
                file=each.get("certificate", LEDGER),
            )
        each["bound"] = cut(bound, best.objective)
    return found


def _records(task: Entry, best: Best, instance: Instance) -> list[Record]:
    """The records about this problem and those with the same optimum."""
    shas = {task.name: best.problem.sha256}
    for each in equivalent(task.recipe, task.relatives):
        if each["entry"] is not None:
            other = formulated(instance, each["formulation"], "hull", best.known.field.p)
            shas[each["entry"]] = other.sha256
    return [each for each in task.records if shas.get(each.entry) == each.problem_sha256]


def _computed(method: str, bound: float) -> dict[str, Any]:
    mine = ours(method)
    found = {"solver": mine.solver, "version": mine.version, "bound": bound, "status": "computed"}
    return found | {"seconds": None, "threads": None, "via": None}


def _results(task: Entry, best: Best, records: list[Record], bounds: list[dict[str, Any]]) -> dict[str, Any]:
    """Dual bounds, status, gap, runs and grade of the entry."""
    facts = standing(best.objective, bounds, records, task.name)
    bound = max((each["bound"] for each in bounds), default=None)
    gap = None if bound is None else relative_gap(best.objective, bound)
    tangents = [each["bound"] for each in bounds if each["solver"] == ours(_TANGENT).solver]
    tangent = any(is_proven(best.objective, each) for each in tangents)
    runs = [each for each in records if each.entry == task.name]
    return {
        "bounds": bounds,
        "bound": bound,
        "status": facts["status"],
        "gap": gap,
        "runs": runs_of(records, task.name, best.objective),
        "density": density(best.problem.instance),
        "difficulty": difficulty(facts["status"], best.objective, runs, tangent=tangent),
    } | facts


def _sidecar(
    task: Entry, best: Best, listed: list[dict[str, Any]], refused: dict[str, str]
) -> dict[str, Any]:
    problem, about = best.problem, task.about
    inherited = {key: about[key] for key in ("family", "title", "rung", "generator", "source", "instance")}
    inherited |= {key: about[key] for key in ("origin", "added", "split") if key in about}
    facts = best.facts()
    named = {each["dialect"]: each["name"] for each in listed if each["format"] == "sol"}
    numbers = {key: facts.pop(key) for key in ("objective", "violation", "integrality")}
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": task.name,
        **inherited,
        "formulation": problem.name,
        "paper": problem.formulation.paper,
        "options": asdict(problem.formulation.options),
        "jumps": listed_jumps(problem),
        **_tightening(task, problem),
        "problem_sha256": problem.sha256,
        "class": problem.problem_class,
        "probtype": probtype(problem),
        "convex": problem.convex,
        "counts": counts(problem),
        "curvature": curvature(problem),
        "files": listed,
        "refused": refused,
        "best": {**numbers, "point": named["miplib"], "nl_point": named.get("ampl"), **facts},
    }


def _tightening(task: Entry, problem: Problem) -> dict[str, Any]:
    """The certificate of a tightened entry, and its plain entry; empty for others."""
    if problem.windows is None or task.certificate is None:
        return {}
    file, recipe = task.certificate["file"], task.recipe
    return {
        "tightened": {
            "certificate": file,
            "sha256": hashlib.sha256(task.files[file]).hexdigest(),
            "plain": entry_name(recipe.instance, recipe.formulation, recipe.facet),
            "windows": problem.tightened,
        }
    }


def _context(task: Entry, problem: Problem) -> dict[str, Any]:
    formats = task.recipe.formats
    return {
        "transformations": [f".{name}: {note}" for name in formats for note in notes_of(problem, name)],
        "equivalent": equivalent(task.recipe, task.relatives),
        "licence": task.about.get("origin", {}).get("license"),
        "references": list(REFERENCES),
        "recipe_sha256": task.sha256,
    }


class Inputs:
    """Tasks of a library with these plans, this ledger and given points."""

    def __init__(self, ledger: Ledger, plans: Iterable[InstancePlan], points: Points = NO_POINTS) -> None:
        self.ledger, self.plans, self.points = ledger, tuple(plans), points

    def preparation(self, each: InstancePlan) -> Preparation:
        """Return the task of an instance. Raises InputError, InstanceError for a damaged file."""
        name = each.recipe.name
        return Preparation(each.recipe, self._submitted(each), self.points(name), self._certificates(name))

    def entries(self, each: InstancePlan, about: dict[str, Any], folder: Path) -> Iterator[Entry]:
        """Yield the tasks of its entries that can be made.

        Raises as `preparation`, and InputError for a missing file.
        """
        files = {facts["name"]: read_bytes(folder / facts["name"]) for facts in about["files"]}
        names, submitted = {entry.name for entry in each.entries}, self._submitted(each)
        records = tuple(record for record in self.ledger.records if record.entry in names)
        plain = tuple(entry.name for entry in each.entries if not entry.tightened)
        for recipe in each.entries:
            if not recipe.lacks(about):
                yield Entry(recipe, about, files, records, submitted, plain)

    def _submitted(self, each: InstancePlan) -> tuple[Submitted, ...]:
        """The fields that the ledger keeps for the entries of an instance."""
        records = (self.ledger.with_point(entry.name) for entry in each.entries)
        return tuple(self._submission(record) for record in records if record is not None)

    def _submission(self, record: Record) -> Submitted:
        self.ledger.field(record)  # an error here names the file
        provenance = Provenance(record.solver, record.version, record.seconds, record.by)
        return Submitted(self.ledger.content(str(record.point), record.point_sha256), provenance)

    def _certificates(self, instance: str) -> tuple[Evidence, ...]:
        """The certificates that the ledger keeps for an instance."""
        return tuple(
            Evidence(
                kept.file,
                self.ledger.content(kept.file, kept.sha256),
                kept.instance_sha256,
                replace(ours(METHOD), by=kept.by),
            )
            for kept in self.ledger.certificates
            if kept.instance == instance
        )
