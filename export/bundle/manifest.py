"""Sets of files: one problem in several formats, with its instance and a manifest.

    bottle_n024.instance.json (or .npz)              the instance, once per folder
    bottle_n024.milp-mccormick.{nl,row,col,gms,lp,mps}
    bottle_n024.milp-mccormick.manifest.json         describes them; reads a solution, with the instance

Names come only from the instance and the formulation, so that a later export replaces an earlier one.
"""

from __future__ import annotations

import gc
import json
from collections import deque
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...models.arguments import check_arguments
from ...models.errors import (
    CrossfieldError,
    FormulationError,
    InputError,
    InstanceError,
    UnsupportedByFormatError,
)
from ...models.field.field import CrossField
from ...models.formulations.catalogue import FORMULATIONS, declaration_of, declare
from ...models.formulations.declaration import Declaration, Formulation, Options
from ...models.formulations.problem import Problem, formulate, with_products_lifted, with_windows
from ...models.formulations.windows import Windows
from ...models.instance.file import read_document, read_instance, write_instance
from ...models.instance.grid import Ints
from ...models.instance.instance import Instance
from ...models.processes.deadline import Progress, silent
from ...models.processes.process_pool import check_jobs
from ...models.storage import make_folder, write_bytes
from ..formats.registry import DEFAULTS, FORMATS, Written, carried, generator, write
from ..solvers_table import smallest, takers
from ..writing.canonical import Canonical
from .starts import write_starts

FORMAT: Final = "crossfield-manifest"
VERSION: Final = 1
LARGE: Final = 1 << 16
"""Instances of more pixels are written as .npz instead of JSON."""


@dataclass(frozen=True)
class Manifest:
    """A set of files: its checked document and its path."""

    document: dict[str, Any]
    path: Path

    @property
    def formulation(self) -> str:
        """Name of the formulation."""
        return str(self.document["formulation"])

    @property
    def folder(self) -> Path:
        """The folder of the set."""
        return self.path.parent

    def instance(self) -> Instance:
        """The instance next to the manifest. Raises InputError, and InstanceError for another instance."""
        path = self.folder / self.document["instance"]["file"]
        instance = read_instance(path)
        if instance.sha256 != self.document["instance"]["sha256"]:
            raise InstanceError(
                "is another instance than the one the manifest was written for; export again", file=path
            )
        return instance

    def problem(self) -> Problem:
        """The problem that the files hold. Raises InputError, InstanceError, FormulationError."""
        instance = self.instance()
        try:
            problem = _narrowed(
                formulate(instance, self.formulation, p=self._jumps(instance), **self.document["options"]),
                self._windows,
            )
        except FormulationError as error:
            raise FormulationError(str(error), file=self.path) from error
        if problem.sha256 != self.document["sha256"]:
            raise InstanceError(
                "does not fit its own instance, options and jumps; export again", file=self.path
            )
        if self.document["columns"] != _columns(problem):
            raise InstanceError(
                "lists columns in another order than they have today; export again", file=self.path
            )
        return problem

    def held(self, problem: Problem) -> dict[str, Problem]:
        """The problem in each format, as its files hold it: the same, or with its products lifted."""
        return {
            file["format"]: with_products_lifted(problem) if file["lifted"] else problem
            for file in self.document["files"]
        }

    @property
    def _windows(self) -> Windows | None:
        return Windows.of_document(self.document["windows"]) if "windows" in self.document else None

    def _jumps(self, instance: Instance) -> Ints | None:
        if self.document["jumps"] is None:
            return None
        jumps = np.zeros(len(instance.grid.first), dtype=np.int32)
        listed = np.array(self.document["jumps"], dtype=np.int64).reshape(-1, 2)
        if (listed[:, 0] >= len(jumps)).any():
            raise InstanceError(
                "lists a jump of a pair that the instance does not have; export again", file=self.path
            )
        jumps[listed[:, 0]] = listed[:, 1]
        return jumps


@check_arguments
def read_manifest(path: str | Path) -> Manifest:
    """Read a manifest, with which `read_solution` reads answers back.

    Parameters
    ----------
    path
        A .manifest.json file.

    Returns
    -------
    Manifest
        The manifest.

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


@check_arguments
def write_problem(
    problem: Problem,
    folder: str | Path,
    *,
    formats: Iterable[str] = DEFAULTS,
    start: CrossField | None = None,
    dialects: dict[str, str] | None = None,
    compress: bool = False,
    jobs: int = 1,
) -> Manifest:
    """Write one problem in several formats, with its instance and manifest.

    Parameters
    ----------
    problem
        The problem.
    folder
        Folder to write to; created if it does not exist.
    formats
        Names of formats. Those that cannot carry the problem are listed in the manifest as refused.
    start, dialects, compress, jobs
        As for `write_all`.

    Returns
    -------
    Manifest
        The manifest.

    Raises
    ------
    UnsupportedByFormatError
        If no file can be written because the formats hold none of the problems.
    InputError
        For an unknown format, and for a problem that no manifest records: with columns fixed one by one, or
        with products lifted beforehand.
    OutputError
        If a file cannot be written.

    """
    if not is_recordable(problem):
        what = f"{problem.name} with columns fixed or products lifted"
        raise InputError(f"a manifest cannot record {what}; write it as a single file")
    formats = tuple(formats)
    _check_formats(formats, dialects or {}, [problem.formulation])
    return _write_sets([problem], folder, formats, start, dialects or {}, compress=compress, jobs=jobs)[0]


@check_arguments
def write_all(
    instance: Instance,
    folder: str | Path,
    *,
    formulations: Iterable[str] = tuple(FORMULATIONS),
    formats: Iterable[str] = DEFAULTS,
    start: CrossField | None = None,
    jumps_of: CrossField | None = None,
    windows: Windows | None = None,
    options: dict[str, Any] | None = None,
    dialects: dict[str, str] | None = None,
    compress: bool = False,
    jobs: int = 1,
    progress: Progress = silent,
) -> list[Manifest]:
    """Write formulations of an instance in every format that carries them.

    Parameters
    ----------
    instance
        The instance.
    folder
        Folder to write to; created if it does not exist.
    formulations
        Names of formulations; all by default.
    formats
        Names of formats; nl, gms, lp and mps by default.
    start
        A field for starting points, also in separate files, and for the jumps of `qp-fixed`.
    jumps_of
        A field for the jumps of `qp-fixed` only.
    windows
        Narrower windows of alpha and beta and ranges of jumps, for all formulations.
    options
        `facet`, `stroke_norm`, `beta_norm` and `relax`, each used where a formulation has it.
    dialects
        By format: `text` or `binary` for nl.
    compress
        Whether to write model files as .gz.
    jobs
        Number of files that are written in parallel.
    progress
        Receives the name of each formulation.

    Returns
    -------
    list of Manifest
        One manifest per formulation.

    Raises
    ------
    UnsupportedByFormatError
        If no file can be written because the formats hold none of the problems.
    InputError
        For an unknown format.
    FormulationError
        For an unknown formulation.
    InstanceError
        For a start on another instance.
    OutputError
        If a file cannot be written.

    """
    options = options or {}
    declarations = [declaration_of(name) for name in formulations]

    def chosen(declaration: Declaration) -> dict[str, Any]:
        unfit = {*Options.__dataclass_fields__} - declaration.settable
        return {key: value for key, value in options.items() if key not in unfit}

    def formulated(declaration: Declaration) -> Problem:
        jumps = fixed_jumps(instance, declaration.name, jumps_of or start)
        return _narrowed(formulate(instance, declaration.name, p=jumps, **chosen(declaration)), windows)

    formats = tuple(formats)
    _check_formats(formats, dialects or {}, [declare(each.name, **chosen(each)) for each in declarations])
    problems = (formulated(declaration) for declaration in declarations)
    return _write_sets(
        problems, folder, formats, start, dialects or {}, compress=compress, jobs=jobs, progress=progress
    )


def _check_formats(
    formats: tuple[str, ...], dialects: dict[str, str], formulations: list[Formulation]
) -> None:
    """Check the names of formats, and that one of them holds one of the formulations."""
    for name in (*formats, *dialects):
        if name not in FORMATS:
            raise InputError(f"there is no format {name!r}; choose one of {', '.join(FORMATS)}")
    reasons = []
    for problem in map(smallest, formulations):
        for name in formats:
            try:
                carried(problem, FORMATS[name])
            except UnsupportedByFormatError as error:
                reasons.append(str(error))
            else:
                return
    if reasons:
        raise UnsupportedByFormatError(f"nothing can be written: {', and '.join(reasons)}")


def _write_sets(
    problems: Iterable[Problem],
    folder: str | Path,
    formats: tuple[str, ...],
    start: CrossField | None,
    dialects: dict[str, str],
    *,
    compress: bool,
    jobs: int,
    progress: Progress = silent,
) -> list[Manifest]:
    """Write problems by several threads, for NumPy, zlib and hashlib run in parallel; return the manifests.

    Memory holds one problem more than there are jobs: the next one is computed while the others are written.
    After a failure or Ctrl-C no further file is started. Files in progress are finished, so that every
    existing file is complete.
    """
    folder = Path(folder)
    with ThreadPoolExecutor(check_jobs(jobs)) as pool:
        make_folder(folder)

        def begin(problem: Problem) -> dict[str, Future[Written]]:
            problem.complete()  # threads share the problem
            stem = folder / _stem(problem)
            paths = {name: f"{stem}{FORMATS[name].suffix}{'.gz' if compress else ''}" for name in formats}
            return {
                name: pool.submit(
                    write,
                    problem,
                    path,
                    dialect=dialects.get(name),
                    start=start if FORMATS[name].starts else None,
                )
                for name, path in paths.items()
            }

        def finish() -> None:
            """Finish the oldest problem and release it."""
            problem, files = waiting.popleft()
            progress(problem.name)
            manifests.append(_finished(problem, files, folder, start))
            large = problem.instance.grid.size > LARGE
            del problem, files
            if large:  # it is in a cycle with its families, and the collector counts objects, not their bytes
                gc.collect()

        waiting: deque[tuple[Problem, dict[str, Future[Written]]]] = deque()
        manifests: list[Manifest] = []
        try:
            for problem in problems:
                waiting.append((problem, begin(problem)))
                del problem
                while len(waiting) > jobs:
                    finish()
            while waiting:
                finish()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return manifests


def _finished(
    problem: Problem, files: dict[str, Future[Written]], folder: Path, start: CrossField | None
) -> Manifest:
    """Wait for the files of a problem, write its starts and its manifest, and return the manifest."""
    written: list[Written] = []
    refused: dict[str, str] = {}
    for name, file in files.items():
        try:
            written.append(file.result())
        except UnsupportedByFormatError as error:
            refused[name] = str(error)
    if start is not None:
        write_starts(problem, start, folder, _stem(problem))
    return record_set(problem, written, refused, folder, _stem(problem))


def is_recordable(problem: Problem) -> bool:
    """Whether formulation, options, jumps and windows determine a problem; nothing is fixed or lifted."""
    plain = formulate(problem.instance, problem.name, p=problem.jumps, **asdict(problem.formulation.options))
    return _narrowed(plain, problem.windows).sha256 == problem.sha256


def write_manifest(problem: Problem, written: Written, folder: Path) -> Manifest:
    """Write manifest and instance for a problem just written in one format; return the manifest.

    Files of the same problem that an existing manifest lists stay listed. Raises OutputError.
    """
    document, path = _document(problem, folder, [written], {}), _path(folder, _stem(problem))
    try:
        earlier = read_manifest(path).document
    except CrossfieldError:
        earlier = {"sha256": ""}
    if earlier["sha256"] == problem.sha256:
        others = [file for file in earlier["files"] if file["name"] not in written.files]
        document |= {"files": others + document["files"], "refused": earlier["refused"]}
    return _write_document(document, path)


def record_set(
    problem: Problem, written: list[Written], refused: dict[str, str], folder: Path, stem: str
) -> Manifest:
    """Write manifest and instance for the files of a problem; return the manifest. Raises OutputError.

    refused: reasons by format. stem: of the manifest's name.
    """
    return _write_document(_document(problem, folder, written, refused), _path(folder, stem))


def _stem(problem: Problem) -> str:
    return f"{problem.instance.name}.{problem.name}"


def _path(folder: Path, stem: str) -> Path:
    return folder / f"{stem}.manifest.json"


def _write_document(document: dict[str, Any], path: Path) -> Manifest:
    write_bytes(path, (json.dumps(document, indent=1) + "\n").encode())
    return Manifest(document, path)


def _narrowed(problem: Problem, windows: Windows | None) -> Problem:
    return problem if windows is None else with_windows(problem, windows)


def fixed_jumps(instance: Instance, name: str, start: CrossField | None) -> Ints | None:
    """The jumps that a formulation takes as data; None if they are variables. Raises FormulationError.

    They come from `start`, by default from the first field. All code that writes or solves a formulation by
    its name calls this function, so that its files and its solutions belong to one problem.
    """
    if not declaration_of(name).fixed:
        return None
    from ...models.search.starts import first_field

    return (start or first_field(instance)).p


def _instance_file(instance: Instance, folder: Path) -> str:
    """Name of the instance's file in the folder, written unless the same instance is there."""
    name = f"{instance.name}.instance.{'npz' if instance.grid.size > LARGE else 'json'}"
    try:
        unchanged = (folder / name).exists() and read_instance(folder / name).sha256 == instance.sha256
    except CrossfieldError:
        unchanged = False
    if not unchanged:
        write_instance(instance, folder / name)
    return name


def _document(
    problem: Problem, folder: Path, written: list[Written], refused: dict[str, str]
) -> dict[str, Any]:
    instance, formulation, options = problem.instance, problem.formulation, problem.formulation.options
    form = Canonical(problem)
    tightening = {}
    if problem.windows is not None:  # and the sentence about it in the files' headers
        tightening = {"tightened": problem.tightened, "windows": problem.windows.document()}
    files = [
        {"name": name, "format": entry.format, "dialect": entry.dialect, "lifted": entry.lifted, **facts}
        for entry in written
        for name, facts in entry.files.items()
    ]
    return {
        "format": FORMAT,
        "version": VERSION,
        "generator": generator(),
        "instance": {
            "file": _instance_file(instance, folder),
            "name": instance.name,
            "gauge": instance.gauge,
            "sha256": instance.sha256,
        },
        "formulation": formulation.name,
        "paper": formulation.paper,
        "options": asdict(options),
        "class": problem.problem_class,
        "convex": problem.convex,
        "counts": {
            "columns": problem.n_columns,
            "binary": sum(block.count for block in form.blocks("binary")),
            "integer": sum(block.count for block in form.blocks("integer")),
            "rows": problem.n_rows,
            "pixels": instance.grid.size,
            "pairs": len(instance.grid.first),
            "stroke_pixels": len(instance.theta),
        },
        "columns": _columns(problem),
        "rows": [
            {"name": row.family.tag, "over": row.family.over, "count": row.count, "paper": row.family.paper}
            for row in problem.rows
        ],
        "jumps": _nonzero(problem),
        **tightening,
        "sha256": problem.sha256,
        "files": files,
        "refused": refused,
        "solvers": {name: taking._asdict() for name, taking in takers(smallest(formulation)).items()},
    }


def _columns(problem: Problem) -> list[dict[str, Any]]:
    """Blocks of columns in order, for the document."""
    return [
        {"name": block.name, "over": block.over, "first": block.offset, "count": block.count}
        for block in problem.blocks.values()
    ]


def _nonzero(problem: Problem) -> list[list[int]] | None:
    """[pair, jump] of every pair whose jump is data and not zero; None where jumps are variables."""
    if problem.jumps is None:
        return None
    at = np.nonzero(problem.jumps)[0]
    listed: list[list[int]] = np.stack([at, problem.jumps[at]], axis=1).tolist()
    return listed
