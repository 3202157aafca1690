"""Sets of files: problems in several formats, each with instance, starting points and manifest.

    bottle_n024.instance.json (or .npz)              the instance, once per folder
    bottle_n024.milp-mccormick.{nl,row,col,gms,lp,mps}
    bottle_n024.milp-mccormick.manifest.json         describes them; reads a solution, with the instance

Names come only from the instance and the formulation, so that a later export replaces an earlier one.
"""

from __future__ import annotations

import gc
from collections.abc import Iterable
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any, overload

from ...models.arguments import check_choice, check_flag
from ...models.errors import InputError, UnsupportedByFormatError
from ...models.field.field import CrossField
from ...models.formulations.catalogue import declaration_of
from ...models.formulations.choice import list_formulations
from ...models.formulations.declaration import Declaration, Options
from ...models.formulations.problem import Problem, formulate
from ...models.formulations.windows import Windows
from ...models.instance.domain import Ints
from ...models.instance.instance import Instance
from ...models.processes.deadline import Progress, silent
from ...models.storage import replace_results
from ..formats.registry import DEFAULTS, FORMATS, Written, file_names
from ..formats.registry import write as write_file
from .manifest import LARGE, Manifest, file_stem, instance_file, write_manifest
from .starts import STARTS, start_name, write_starts


@overload
def write(
    problem: Problem, path: str | Path, *, start: CrossField | None = None, force: bool = False
) -> Written: ...
@overload
def write(
    problem: Problem,
    path: str | Path,
    *,
    formats: Iterable[str],
    start: CrossField | None = None,
    compress: bool = False,
    force: bool = False,
) -> Manifest: ...
def write(
    problem: Problem,
    path: str | Path,
    *,
    formats: Iterable[str] | None = None,
    start: CrossField | None = None,
    compress: bool = False,
    force: bool = False,
) -> Written | Manifest:
    """Write a problem to a file, or in several formats to a folder. Equal problems give equal bytes.

    A .nl comes with a .row and a .col file, and a .mod with its .dat; the files appear together.

    Parameters
    ----------
    problem
        The problem.
    path
        File to write. Its suffix names the format, and a further `.gz` compresses it. With formats, a folder.
    formats
        Names of formats. The folder then also holds the instance, start files for each solver, and a
        manifest, which lists the formats that cannot carry the problem as refused.
    start
        A field whose point becomes the starting point. A single file must be of a format that has a place for
        one: nl, gms, qplib and bar.
    compress
        Whether to write model files as .gz; only with formats.
    force
        Whether to replace files that crossfield has not written or that have changed since.

    Returns
    -------
    Written or Manifest
        Of a file its format, the problem as it holds it, and size and SHA-256 by name; of a folder its
        manifest.

    Raises
    ------
    UnsupportedByFormatError
        If the format cannot carry the problem, or has no place for the start.
    InputError
        For an unknown suffix or format, for more pixels or faces than the memory holds, and, with formats,
        for a problem with columns fixed or products lifted, which no manifest records.
    OutputError
        If a file cannot be written, or if another one is in the way.

    """
    if formats is None:
        return write_file(problem, path, start=start, force=force)
    if not problem.is_recordable:
        changed = f"{problem.name} with columns fixed or products lifted"
        raise InputError(f"a manifest cannot record {changed}; write it as a single file")
    formats = tuple(formats)
    names = names_of_set(problem.instance, problem.name, formats, compress=compress)
    with replace_results(path, names, force=force) as new:
        manifest = _write_problem_files(problem, new.path, formats, start, compress=compress)
        _check_written([manifest])
    return manifest.moved_to(path)


def write_all(
    instance: Instance,
    folder: str | Path,
    *,
    formulations: Iterable[str] | None = None,
    formats: Iterable[str] = DEFAULTS,
    start: CrossField | None = None,
    jumps_of: CrossField | None = None,
    windows: Windows | None = None,
    options: dict[str, Any] | None = None,
    compress: bool = False,
    force: bool = False,
    progress: Progress = silent,
) -> list[Manifest]:
    """Write formulations of an instance in every format that carries them; one manifest for each.

    Parameters
    ----------
    instance
        The instance.
    folder
        Folder to write to; created if it does not exist.
    formulations
        Names of formulations; by default all that the instance can have.
    formats
        Names of formats; nl, gms, lp and mps by default.
    start
        A field for starting points, also in separate files, and for the jumps of `qp-fixed`.
    jumps_of
        A field for the jumps of `qp-fixed` only.
    windows
        Narrower windows of alpha and beta and ranges of jumps, for all formulations.
    options
        `facet`, `stroke_norm`, `beta_norm`, `relax` and `limits`, each used where a formulation has it.
    compress
        Whether to write model files as .gz.
    force
        Whether to replace files that crossfield has not written or that have changed since.
    progress
        Receives the name of each formulation.

    Raises
    ------
    UnsupportedByFormatError
        If no file can be written because the formats hold none of the problems.
    InputError
        For an unknown format.
    FormulationError
        For an unknown formulation, and for one that the instance cannot have.
    InstanceError
        For a start on another instance.
    OutputError
        If a file cannot be written, or if others are in the way.

    """
    options = options or {}
    if formulations is None:
        formulations = list_formulations(instance, narrowed=windows is not None)
    declarations = [declaration_of(name) for name in formulations]

    def chosen(declaration: Declaration) -> dict[str, Any]:
        unfit = {*Options.__dataclass_fields__} - declaration.option_names
        return {key: value for key, value in options.items() if key not in unfit}

    formats = tuple(formats)
    sets = (
        names_of_set(instance, declaration.name, formats, compress=compress) for declaration in declarations
    )
    manifests = []
    with replace_results(folder, chain.from_iterable(sets), force=force) as new:
        for declaration in declarations:
            progress(declaration.name)
            jumps = jumps_as_data(instance, declaration.name, jumps_of or start)
            problem = formulate(instance, declaration.name, p=jumps, **chosen(declaration))
            problem = replace(problem, windows=windows)
            manifests.append(_write_problem_files(problem, new.path, formats, start, compress=compress))
            del problem
            if instance.domain.size > LARGE:
                gc.collect()  # a problem is in a cycle, and the collector counts objects, not their bytes
        _check_written(manifests)
    return [manifest.moved_to(folder) for manifest in manifests]


def names_of_set(instance: Instance, name: str, formats: Iterable[str], *, compress: bool) -> list[str]:
    """Names of the files that a formulation of an instance can have in some formats, the manifest last."""
    check_flag("compress", compress)
    formats = list(formats)
    for form in formats:
        check_choice("format", form, FORMATS)
    stem, packed = f"{instance.name}.{name}", ".gz" * compress
    models = [file_names(f"{stem}{FORMATS[form].suffix}{packed}", form) for form in formats]
    starts = [start_name(stem, solver) for solver in STARTS]
    return [*chain.from_iterable(models), *starts, instance_file(instance), f"{stem}.manifest.json"]


def _check_written(manifests: list[Manifest]) -> None:
    """Raise UnsupportedByFormatError if every format has refused every problem."""
    reasons = [reason for manifest in manifests for reason in manifest.document["refused"].values()]
    if reasons and not any(manifest.document["files"] for manifest in manifests):
        raise UnsupportedByFormatError(f"nothing can be written: {', and '.join(dict.fromkeys(reasons))}")


def _write_problem_files(
    problem: Problem,
    folder: Path,
    formats: tuple[str, ...],
    start: CrossField | None,
    *,
    compress: bool,
) -> Manifest:
    """Write the files of a problem, its starting points and its manifest."""
    stem, written, refused = file_stem(problem), [], {}
    for name in dict.fromkeys(formats):
        entry = FORMATS[name]
        path = folder / f"{stem}{entry.suffix}{'.gz' if compress else ''}"
        try:
            file = write_file(problem, path, start=start if entry.has_start else None)
        except UnsupportedByFormatError as error:
            refused[name] = str(error)
        else:
            written.append(file)
    if start is not None:
        write_starts(problem, start, folder, stem)
    return write_manifest(problem, written, refused, folder, stem)


def jumps_as_data(instance: Instance, name: str, start: CrossField | None) -> Ints | None:
    """The jumps that a formulation takes as data; None if they are variables. Raises FormulationError.

    They come from `start`, by default from the first field. All code that writes or solves a formulation by
    its name calls this function, so that its files and its solutions belong to one problem.
    """
    if not declaration_of(name).fixed:
        return None
    if start is None:
        from ...models.search.starts import first_field

        start = first_field(instance)
    return start.p
