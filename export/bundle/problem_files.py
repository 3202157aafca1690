"""Sets of files: problems in several formats, each with instance, starting points and manifest.

    bottle_n024.instance.json (or .npz)              the instance, once per folder
    bottle_n024.milp-mccormick.{nl,row,col,gms,lp,mps}
    bottle_n024.milp-mccormick.manifest.json         describes them; reads a solution, with the instance

Names come only from the instance and the formulation, so that a later export replaces an earlier one.
"""

from __future__ import annotations

import gc
from collections.abc import Iterable
from itertools import chain
from pathlib import Path
from typing import Any

from ...models.arguments import check_choice, check_flag
from ...models.errors import InputError, UnsupportedByFormatError
from ...models.field.field import CrossField
from ...models.formulations.catalogue import declaration_of, declare, list_formulations
from ...models.formulations.declaration import Declaration, Formulation, Options
from ...models.formulations.problem import Problem, formulate, with_windows
from ...models.formulations.windows import Windows
from ...models.instance.domain import Ints
from ...models.instance.instance import Instance
from ...models.processes.deadline import Progress, silent
from ...models.storage import replace_results
from ..formats.registry import DEFAULTS, FORMATS, file_names, problem_in_format, write
from ..solvers_table import smallest_problem
from .manifest import LARGE, Manifest, file_stem, instance_file, write_manifest
from .starts import STARTS, start_name, write_starts


def write_problem(
    problem: Problem,
    folder: str | Path,
    *,
    formats: Iterable[str] = DEFAULTS,
    start: CrossField | None = None,
    dialects: dict[str, str] | None = None,
    compress: bool = False,
    force: bool = False,
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
    start, dialects, compress, force
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
        If a file cannot be written, or if others are in the way.

    """
    if not problem.is_recordable:
        changed = f"{problem.name} with columns fixed or products lifted"
        raise InputError(f"a manifest cannot record {changed}; write it as a single file")
    formats = tuple(formats)
    _check_formats(formats, dialects or {}, [problem.formulation])
    names = names_of_set(problem.instance, problem.name, formats, compress=compress)
    with replace_results(folder, names, force=force) as new:
        manifest = _write_problem_files(problem, new.path, formats, start, dialects or {}, compress=compress)
    return manifest.moved_to(folder)


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
    dialects: dict[str, str] | None = None,
    compress: bool = False,
    force: bool = False,
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
    dialects
        By format: `text` or `binary` for nl.
    compress
        Whether to write model files as .gz.
    force
        Whether to replace files that crossfield has not written or that have changed since.
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
    _check_formats(
        formats,
        dialects or {},
        [declare(declaration.name, instance, **chosen(declaration)) for declaration in declarations],
    )
    sets = (
        names_of_set(instance, declaration.name, formats, compress=compress) for declaration in declarations
    )
    manifests = []
    with replace_results(folder, chain.from_iterable(sets), force=force) as new:
        for declaration in declarations:
            progress(declaration.name)
            jumps = jumps_as_data(instance, declaration.name, jumps_of or start)
            problem = formulate(instance, declaration.name, p=jumps, **chosen(declaration))
            problem = with_windows(problem, windows)
            manifests.append(
                _write_problem_files(problem, new.path, formats, start, dialects or {}, compress=compress)
            )
            del problem
            if instance.domain.size > LARGE:
                gc.collect()  # a problem is in a cycle, and the collector counts objects, not their bytes
    return [manifest.moved_to(folder) for manifest in manifests]


def names_of_set(instance: Instance, name: str, formats: Iterable[str], *, compress: bool) -> list[str]:
    """Names of the files that a formulation of an instance can have in some formats, the manifest last."""
    check_flag("compress", compress)
    stem, packed = f"{instance.name}.{name}", ".gz" * compress
    models = [file_names(f"{stem}{FORMATS[form].suffix}{packed}", form) for form in formats]
    starts = [start_name(stem, solver) for solver in STARTS]
    return [*chain.from_iterable(models), *starts, instance_file(instance), f"{stem}.manifest.json"]


def _check_formats(
    formats: tuple[str, ...], dialects: dict[str, str], formulations: list[Formulation]
) -> None:
    """Check the names of formats, and that one of them holds one of the formulations."""
    for name in (*formats, *dialects):
        check_choice("format", name, FORMATS)
    reasons = []
    for problem in map(smallest_problem, formulations):
        for name in formats:
            try:
                problem_in_format(problem, FORMATS[name])
            except UnsupportedByFormatError as error:
                reasons.append(str(error))
            else:
                return
    if reasons:
        raise UnsupportedByFormatError(f"nothing can be written: {', and '.join(reasons)}")


def _write_problem_files(
    problem: Problem,
    folder: Path,
    formats: tuple[str, ...],
    start: CrossField | None,
    dialects: dict[str, str],
    *,
    compress: bool,
) -> Manifest:
    """Write the files of a problem, its starting points and its manifest."""
    stem, written, refused = file_stem(problem), [], {}
    for name in dict.fromkeys(formats):
        entry = FORMATS[name]
        path = folder / f"{stem}{entry.suffix}{'.gz' if compress else ''}"
        try:
            file = write(problem, path, dialect=dialects.get(name), start=start if entry.has_start else None)
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
