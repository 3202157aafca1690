"""The files of an entry: models in every format, the best known point, and the sidecar last."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ....models.errors import InputError, UnsupportedByFormatError
from ....models.field.file import read_field
from ....models.formulations.problem import Problem
from ....models.instance.file import read_instance
from ....models.instance.instance import Instance
from ....models.proof.certificate import read_certificate
from ....models.storage import temporary_folder
from ...bundle.manifest import ENTRY_FORMAT, nonzero_jumps
from ...bundle.starts import Start, complete_start
from ...formats.registry import Written, write
from ...solutions.readers.ampl import write_ampl_sol
from ...writing.curvature import probtype
from ...writing.nl_order import NlOrder
from ...writing.records import number_text
from ..documents.citation import REFERENCES
from ..documents.documents import VERSION, document_bytes, tightened_by
from ..documents.statistics import density, problem_counts, problem_curvature, tangent_bound
from ..ledger.grades import (
    best_runs,
    difficulty,
    entry_status,
    is_proven,
    is_refuted,
    relative_gap,
    shown_runs,
)
from ..ledger.ledger import Record
from ..ledger.points import METHOD, BestPoint, KnownField, best_point, complete_point, finder
from ..plan.equivalence import equivalent_entries, format_notes
from ..plan.problems import formulate_entry
from ..plan.recipe import EntryRecipe, entry_name
from .instance_files import Files

_SOLVED: Final = 0  # AMPL's solve code
_NOT_PROVEN: Final = 100  # AMPL's solve code of a solution that may not be the optimum
_TANGENT: Final = "tangent at the point"
_OF_INSTANCE: Final = ("family", "title", "rung", "generator", "source", "instance")
_OF_SKETCH: Final = ("origin", "added")  # absent if not stated
_OF_RUN: Final = ("solver", "version", "bound", "status", "seconds", "threads")


@dataclass(frozen=True, eq=False)
class EntryTask:
    """Everything that the files of an entry depend on, for any process, and its digest.

    about, files: document and files of its instance. records, fields: of all entries of the instance in the
    ledger. relatives: its plain entries.
    """

    recipe: EntryRecipe
    about: dict[str, Any]
    files: Files
    records: tuple[Record, ...]
    fields: tuple[KnownField, ...]
    relatives: tuple[str, ...]
    sha256: str

    @property
    def name(self) -> str:
        """Name of the entry."""
        return self.recipe.name

    @property
    def certificate(self) -> dict[str, Any] | None:
        """The facts about the certificate in the norm that the entry minimises; None without one."""
        facts: dict[str, Any] | None = self.about.get("certificates", {}).get(str(self.recipe.norm))
        return facts


def make_entry(task: EntryTask) -> Files:
    """Make the files of an entry; return their contents by name, the sidecar last.

    Raises InputError for a bound that the best point contradicts.
    """
    with temporary_folder() as folder:
        instance, known = _read_known_fields(task, folder)
        recipe = task.recipe
        problem = formulate_entry(instance, recipe.formulation, recipe.facet, known["baseline"].field.p)
        certified = None
        if recipe.tightened and task.certificate is not None:
            certificate = read_certificate(folder / task.certificate["file"], on=instance)
            problem, certified = tightened_by(certificate, problem), certificate.field
        written, refused = write_models(
            problem, recipe.name, recipe.formats, folder, compress=recipe.compress
        )
        sent = [field for field in task.fields if field.field.instance.sha256 == instance.sha256]
        best = best_point(problem, [*known.values(), *sent], certified)
        results = _results(task, best)
        listed = [
            _file_facts(name, model.format, "", format_notes(problem, model.format))
            for model in written
            for name in model.files
        ]
        listed += _write_points(task, best, folder, proven=results["status"] == "optimal")
        sidecar = _sidecar(task, best, listed, refused, results)
        contents = {facts["name"]: (folder / facts["name"]).read_bytes() for facts in listed}
        return contents | {f"{task.name}.json": document_bytes(sidecar)}


def _read_known_fields(task: EntryTask, folder: Path) -> tuple[Instance, dict[str, KnownField]]:
    """The instance and its known fields by role, read from files in a temporary folder."""
    for name, data in task.files.items():
        (folder / name).write_bytes(data)
    known = {
        role: KnownField.of(read_field(folder / facts["file"]), facts)
        for role, facts in task.about["fields"].items()
    }
    return read_instance(folder / task.about["instance"]["file"]), known


def write_models(
    problem: Problem, name: str, formats: Collection[str], folder: Path, *, compress: bool
) -> tuple[list[Written], dict[str, str]]:
    """Write the model files of an entry; return what was written, and why the other formats are refused."""
    written, refused = [], {}
    for suffix in formats:
        try:
            written.append(write(problem, folder / f"{name}.{suffix}{'.gz' if compress else ''}"))
        except UnsupportedByFormatError as error:
            refused[suffix] = str(error)
    return written, refused


def _write_points(
    task: EntryTask, best: BestPoint, folder: Path, *, proven: bool
) -> Iterator[dict[str, Any]]:
    """Write the best point in MIPLIB's format, and in AMPL's for a .nl; yield the facts of both files."""
    path = folder / f"{task.name}.sol"
    path.write_bytes(b"".join(_miplib_lines(best)))
    notes = ["columns as in the .mps and .lp; those at 0 are left out"]
    yield _file_facts(path.name, "sol", "miplib", notes)
    if "nl" in task.recipe.formats:
        layout = NlOrder(best.problem)
        path = folder / f"{task.name}.nl.sol"
        message = f"{best.known.solver}: objective {number_text(best.objective)}"
        code = _SOLVED if proven else _NOT_PROVEN
        point, rows = best.point[layout.order], best.problem.n_rows
        write_ampl_sol(path, message, point, rows, code, stamp=best.problem.stamp)
        yield _file_facts(path.name, "sol", "ampl", ["columns in the order of the .nl and its .col"])


def _miplib_lines(best: BestPoint) -> Iterator[bytes]:
    """The lines of a .sol file in MIPLIB's format, with the columns of LP and MPS."""
    problem = complete_start(best.problem, best.known.field).problem
    start = Start(problem, complete_point(problem, best.known.field))
    yield f"=obj= {number_text(start.objective)}\n".encode()
    yield from start.lines(zeros=False)


def _file_facts(name: str, file_format: str, dialect: str, notes: list[str]) -> dict[str, Any]:
    return {"name": name, "format": file_format, "dialect": dialect, "notes": notes}


def _results(task: EntryTask, best: BestPoint) -> dict[str, Any]:
    """The dual bounds, status, gap, runs and grade of an entry."""
    records = _records(task, best)
    bounds = _bounds(task, best, records)
    status = entry_status(best.objective, bounds, records, task.name)
    bound = max((facts["bound"] for facts in bounds), default=None)
    tangents = [facts["bound"] for facts in bounds if facts["solver"] == finder(_TANGENT)[0]]
    tangent = any(is_proven(best.objective, value) for value in tangents)
    runs = [record for record in records if record.entry == task.name]
    return {
        "bounds": bounds,
        "bound": bound,
        "status": status["status"],
        "gap": None if bound is None else relative_gap(best.objective, bound),
        "runs": shown_runs(records, task.name, best.objective),
        "density": density(best.problem.instance),
        "difficulty": difficulty(status["status"], best.objective, runs, tangent=tangent),
    } | status


def _records(task: EntryTask, best: BestPoint) -> list[Record]:
    """The records about this problem and those with the same optimum, without bounds that the point refutes.

    The point is feasible to more digits than a solver keeps its rows.
    """
    problems = {task.name: best.problem.sha256}
    for relative in equivalent_entries(task.recipe, task.relatives):
        if relative["entry"] is not None:
            instance, jumps = best.problem.instance, best.known.field.p
            problem = formulate_entry(instance, relative["formulation"], "hull", jumps)
            problems[relative["entry"]] = problem.sha256
    return [
        replace(record, bound=None) if is_refuted(record.bound or -math.inf, best.objective) else record
        for record in task.records
        if problems.get(record.entry) == record.problem_sha256
    ]


def _bounds(task: EntryTask, best: BestPoint, records: list[Record]) -> list[dict[str, Any]]:
    """The best dual bound of each solver for this optimum, and the bounds of tangent and certificate.

    A bound is at most the best objective. Raises InputError if the point contradicts a computed one.
    """
    bounds, name = [], task.name
    for record in best_runs((record for record in records if record.bound is not None), name):
        via = None if record.entry == name else record.entry
        bounds.append({key: getattr(record, key) for key in _OF_RUN} | {"via": via})
    tangent = tangent_bound(best.problem, best.point)
    if tangent is not None:
        bounds.append(_computed_bound(_TANGENT, tangent))
    if task.certificate is not None:
        facts = {"certificate": task.certificate["file"]}
        bounds.append(_computed_bound(METHOD, task.certificate["bound"]) | facts)
    for facts in bounds:
        bound = float(facts["bound"])
        if is_refuted(bound, best.objective):
            raise InputError(
                f"has the bound {bound!r} of {name} by {facts['solver']}, but there is a feasible point of "
                f"{best.objective!r}; that bound is wrong, build again without it",
                file=facts.get("certificate"),
            )
        facts["bound"] = min(bound, best.objective)
    return bounds


def _computed_bound(method: str, bound: float) -> dict[str, Any]:
    solver, version = finder(method)
    facts = {"solver": solver, "version": version, "bound": bound, "status": "computed"}
    return facts | {"seconds": None, "threads": None, "via": None}


def _sidecar(
    task: EntryTask,
    best: BestPoint,
    listed: list[dict[str, Any]],
    refused: dict[str, str],
    results: dict[str, Any],
) -> dict[str, Any]:
    """The sidecar of an entry. listed: facts about its files; refused: other formats, and the reasons."""
    problem, about, recipe = best.problem, task.about, task.recipe
    violation = problem.violation(best.point)
    points = {file["dialect"]: file["name"] for file in listed if file["format"] == "sol"}
    tightened = {}
    if problem.windows is not None and task.certificate is not None:
        plain = entry_name(recipe.instance, recipe.formulation, recipe.facet)
        facts = {"certificate": task.certificate["file"], "plain": plain, "windows": problem.tightened}
        tightened = {"tightened": facts}
    return {
        "format": ENTRY_FORMAT,
        "version": VERSION,
        "name": task.name,
        **{key: about[key] for key in (*_OF_INSTANCE, *_OF_SKETCH) if key in about},
        "formulation": problem.name,
        "paper": problem.formulation.declaration.paper,
        "options": problem.formulation.options.document,
        "jumps": nonzero_jumps(problem),
        **tightened,
        "problem_sha256": problem.sha256,
        "class": problem.problem_class,
        "probtype": probtype(problem),
        "convex": problem.is_convex,
        "counts": problem_counts(problem),
        "curvature": problem_curvature(problem),
        "files": listed,
        "refused": refused,
        "best": {
            "objective": best.objective,
            "violation": max(violation.rows, violation.bounds),
            "integrality": violation.integrality,
            "point": points["miplib"],
            "nl_point": points.get("ampl"),
            **best.known.origin,
            "energy_2norm": best.known.field.energy().total,
        },
        **results,
        "equivalent": equivalent_entries(recipe, task.relatives),
        "licence": about.get("origin", {}).get("license"),
        "references": list(REFERENCES),
        "recipe_sha256": task.sha256,
    }
