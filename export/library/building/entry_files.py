"""The files of an entry: models in every format, the best known point, and the sidecar last."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from ....models.errors import UnsupportedByFormatError
from ....models.field.file import read_field
from ....models.formulations.problem import Problem
from ....models.instance.file import read_instance
from ....models.instance.instance import Instance
from ....models.proof.certificate import read_certificate
from ....models.storage import temporary_folder
from ...bundle.starts import Start, complete_start
from ...formats.registry import Written, write
from ...solutions.readers.ampl import write_ampl_sol
from ...writing.nl_order import NlOrder
from ...writing.records import number_text
from ..documents.documents import document_bytes, tightened_by
from ..ledger.points import BestPoint, KnownField, Provenance, best_point, complete_point
from ..plan.equivalence import format_notes
from ..plan.problems import formulate_entry
from ..plan.recipe import EntryRecipe
from .entry_results import entry_results
from .sidecar import sidecar_of
from .tasks import EntryTask, Files

_SOLVED: Final = 0  # AMPL's solve code
_NOT_PROVEN: Final = 100  # AMPL's solve code of a solution that may not be the optimum


def make_entry(task: EntryTask) -> Files:
    """Make the files of an entry; return their contents by name, the sidecar last."""
    with temporary_folder() as folder:
        instance, known = _read_known_fields(task, folder)
        recipe, jumps = task.recipe, known["baseline"].field.p
        problem = formulate_entry(instance, recipe.formulation, recipe.facet, jumps)
        certified = None
        if recipe.tightened and task.certificate is not None:
            certificate = read_certificate(folder / task.certificate["file"], on=instance)
            problem, certified = tightened_by(certificate, problem), certificate.field
        written, refused = write_models(problem, recipe, folder)
        best = best_point(problem, list(known.values()), certified)
        results = entry_results(task, best)
        listed = [
            *_model_facts(problem, written),
            *_write_points(task, best, folder, proven=results["status"] == "optimal"),
        ]
        sidecar = sidecar_of(task, best, listed, refused, results)
        contents = {facts["name"]: (folder / facts["name"]).read_bytes() for facts in listed}
        return contents | {f"{task.name}.json": document_bytes(sidecar)}


def _read_known_fields(task: EntryTask, folder: Path) -> tuple[Instance, dict[str, KnownField]]:
    """The instance and its known fields by role, read from files in a temporary folder."""
    for name, data in task.files.items():
        (folder / name).write_bytes(data)
    known = {
        role: KnownField(read_field(folder / facts["file"]), Provenance.of(facts))
        for role, facts in task.about["fields"].items()
    }
    instance = read_instance(folder / task.about["instance"]["file"])
    for place, field in enumerate(task.fields):
        submitted = field.known()
        if submitted.field.instance.sha256 == instance.sha256:
            known[f"submitted {place}"] = submitted
    return instance, known


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


def _model_facts(problem: Problem, written: list[Written]) -> list[dict[str, Any]]:
    """Facts of model files for a sidecar."""
    return [
        _file_facts(name, model.format, model.dialect, format_notes(problem, model.format))
        for model in written
        for name in model.files
    ]


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
        message = f"{best.known.provenance.solver}: objective {number_text(best.objective)}"
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
