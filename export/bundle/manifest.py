"""The manifest of a set of files: it describes them, and reads a solution with the instance beside it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...models.documents import read_document
from ...models.errors import CrossfieldError, InstanceError, naming
from ...models.formulations.problem import Problem, formulate
from ...models.formulations.windows import Windows
from ...models.instance.domain import Ints
from ...models.instance.file import read_instance, write_instance
from ...models.instance.instance import Instance
from ...models.storage import write_bytes
from ..formats.registry import Written, program_version
from ..solvers_table import smallest_problem, suitabilities
from ..writing.canonical import CanonicalForm

FORMAT: Final = "crossfield-manifest"
ENTRY_FORMAT: Final = "crossfield-library-entry"
"""Format of the sidecars of a library, which describe a problem too."""
VERSION: Final = 1
LARGE: Final = 1 << 16
"""Instances of more pixels are written as .npz instead of JSON."""


@dataclass(frozen=True)
class Manifest:
    """A set of files: its checked document and its path."""

    document: dict[str, Any]
    path: Path

    def __repr__(self) -> str:
        formats = ", ".join(dict.fromkeys(file["format"] for file in self.document["files"]))
        return f"<Manifest {self.path}: {self.formulation} in {formats}>"

    @property
    def formulation(self) -> str:
        """Name of the formulation."""
        return str(self.document["formulation"])

    @property
    def folder(self) -> Path:
        """The folder of the set."""
        return self.path.parent

    def moved_to(self, folder: str | Path) -> Manifest:
        """The manifest after its set has moved to another folder."""
        return Manifest(self.document, Path(folder) / self.path.name)

    def problem(self) -> Problem:
        """The problem that the files hold. Raises InputError, InstanceError, FormulationError."""
        windows = Windows.of_document(self.document["windows"]) if "windows" in self.document else None
        problem = described_problem(self.document, self.path, lambda _: windows)
        if self.document["columns"] != _column_blocks(problem):
            raise InstanceError(
                "lists columns in another order than they have today; export again", file=self.path
            )
        return problem

    def problems_by_format(self, problem: Problem) -> dict[str, Problem]:
        """The problem in each format, as its files hold it: the same, or with its products lifted."""
        return {
            file["format"]: problem.lifted if file["lifted"] else problem for file in self.document["files"]
        }


def described_problem(
    document: dict[str, Any], path: Path, windows_of: Callable[[Instance], Windows | None]
) -> Problem:
    """The problem that a manifest or the sidecar of an entry describes, on the instance beside it.

    path: of the document. windows_of: narrower windows of the problem on its instance. Raises InputError,
    InstanceError for another instance or problem, and FormulationError.
    """
    file = path.parent / document["instance"]["file"]
    instance = read_instance(file)
    if instance.sha256 != document["instance"]["sha256"]:
        raise InstanceError(
            f"is another instance than the one that {path.name} was written for; write both again", file=file
        )
    with naming(path):
        jumps = _jumps_of_list(document["jumps"], instance)
        problem = formulate(instance, document["formulation"], p=jumps, **document["options"])
        problem = replace(problem, windows=windows_of(instance))
        if problem.sha256 not in (document.get("sha256"), document.get("problem_sha256")):
            raise InstanceError("does not fit its own instance, options and jumps; write it again")
    return problem


def read_manifest(path: str | Path) -> Manifest:
    """Read a manifest, with which `read_solution` reads answers back.

    Parameters
    ----------
    path
        A .manifest.json file.

    Raises
    ------
    InputError
        If the file cannot be read.
    InstanceError
        If it breaks its schema.

    """
    remedy = "give the .manifest.json that export wrote"
    document = read_document(Path(path), FORMAT, VERSION, "manifest", __package__, remedy=remedy)
    return Manifest(document, Path(path))


def write_manifest(
    problem: Problem, written: list[Written], refused: dict[str, str], folder: Path, stem: str
) -> Manifest:
    """Write manifest and instance for the files of a problem; return the manifest. Raises OutputError.

    refused: reasons by format. stem: of the manifest's name.
    """
    write_instance(problem.instance, folder / instance_file(problem.instance))
    return _write_document(manifest_document(problem, written, refused), folder, stem)


def add_to_manifest(problem: Problem, written: Written, folder: Path, earlier_folder: Path) -> Manifest:
    """Write manifest and instance for a problem just written in one format; return the manifest.

    Files of the same problem that a manifest in the earlier folder lists stay listed. Raises OutputError.
    """
    document = manifest_document(problem, [written], {})
    try:
        earlier = read_manifest(manifest_path(earlier_folder, file_stem(problem))).document
    except CrossfieldError:
        earlier = {"sha256": ""}
    if earlier["sha256"] == problem.sha256:
        others = [file for file in earlier["files"] if file["name"] not in written.files]
        document |= {"files": others + document["files"], "refused": earlier["refused"]}
    write_instance(problem.instance, folder / instance_file(problem.instance))
    return _write_document(document, folder, file_stem(problem))


def _write_document(document: dict[str, Any], folder: Path, stem: str) -> Manifest:
    path = write_bytes(manifest_path(folder, stem), (json.dumps(document, indent=1) + "\n").encode())
    return Manifest(document, path)


def manifest_path(folder: Path, stem: str) -> Path:
    """The path of the manifest of a problem."""
    return folder / f"{stem}.manifest.json"


def file_stem(problem: Problem) -> str:
    """The name of a problem's files without suffixes."""
    return f"{problem.instance.name}.{problem.name}"


def instance_file(instance: Instance) -> str:
    """The name of the instance's file beside a manifest."""
    return f"{instance.name}.instance.{'npz' if instance.domain.size > LARGE else 'json'}"


def manifest_document(problem: Problem, written: list[Written], refused: dict[str, str]) -> dict[str, Any]:
    """The document of a problem's files. refused: reasons by format."""
    instance, formulation = problem.instance, problem.formulation
    form = CanonicalForm(problem)
    tightening: dict[str, Any] = {"limited": problem.limited} if problem.limited else {}
    if problem.windows is not None:  # and the sentence about it in the files' headers
        tightening |= {"tightened": problem.tightened, "windows": problem.windows.document()}
    files = [
        {"name": name, "format": entry.format, "lifted": entry.lifted, **facts}
        for entry in written
        for name, facts in entry.files.items()
    ]
    return {
        "format": FORMAT,
        "version": VERSION,
        "generator": program_version(),
        "instance": {
            "file": instance_file(instance),
            "name": instance.name,
            "gauge": instance.gauge,
            "sha256": instance.sha256,
        },
        "formulation": formulation.name,
        "paper": formulation.declaration.paper,
        "options": formulation.options.document,
        "class": problem.problem_class,
        "convex": problem.is_convex,
        "counts": {
            "columns": problem.n_columns,
            "binary": sum(block.count for block in form.blocks("binary")),
            "integer": sum(block.count for block in form.blocks("integer")),
            "rows": problem.n_rows,
            f"{instance.domain.kind}s": instance.domain.size,
            "pairs": len(instance.domain.first),
            f"stroke_{instance.domain.kind}s": len(instance.theta),
        },
        "columns": _column_blocks(problem),
        "rows": [
            {"name": row.family.tag, "over": row.family.over, "count": row.count, "paper": row.family.paper}
            for row in problem.rows
        ],
        "jumps": nonzero_jumps(problem),
        **tightening,
        "sha256": problem.sha256,
        "files": files,
        "refused": refused,
        "solvers": {
            name: taking._asdict() for name, taking in suitabilities(smallest_problem(formulation)).items()
        },
    }


def _column_blocks(problem: Problem) -> list[dict[str, Any]]:
    """Blocks of columns in order, for the document."""
    return [
        {"name": block.name, "over": block.over, "first": block.offset, "count": block.count}
        for block in problem.blocks.values()
    ]


def nonzero_jumps(problem: Problem) -> list[list[int]] | None:
    """[pair, jump] of every pair whose jump is data and not zero; None where jumps are variables."""
    if problem.jumps is None:
        return None
    at = np.nonzero(problem.jumps)[0]
    listed: list[list[int]] = np.stack([at, problem.jumps[at]], axis=1).tolist()
    return listed


def _jumps_of_list(listed: list[list[int]] | None, instance: Instance) -> Ints | None:
    """The jumps that `nonzero_jumps` listed. Raises InstanceError for an unknown pair."""
    if listed is None:
        return None
    jumps = np.zeros(len(instance.domain.first), dtype=np.int32)
    pairs, values = np.array(listed, dtype=np.int64).reshape(-1, 2).T
    if (pairs >= len(jumps)).any():
        raise InstanceError("lists a jump of a pair that the instance does not have; write it again")
    jumps[pairs] = values
    return jumps
