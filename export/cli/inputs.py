"""Files and names that users give on the command line."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ...models.errors import CrossfieldError, InputError
from ...models.storage import require_suffix
from ...models.written_files import check_targets
from .mesh_options import check_domain

if TYPE_CHECKING:
    from ...models.field.field import CrossField
    from ...models.formulations.problem import Problem
    from ...models.instance.instance import Instance

SAVED: Final = (".npz", ".json", ".rawfield")
"""Suffixes of the files that hold a field."""


def read_start(path: Path | None, instance: Instance) -> CrossField | None:
    """Field of --start; None without one. Raises InputError for a field on another instance."""
    from ...models.field.file import read_field

    return None if path is None else read_field(path, on=instance)


def read_described_problem(path: Path) -> tuple[Problem, Mapping[str, Problem] | None]:
    """Problem of a manifest, or of an entry of a library by its sidecar, and the problem in each format.

    Raises InputError, InstanceError for a missing or damaged file.
    """
    from ...models.documents import stated_format
    from ..bundle.manifest import ENTRY_FORMAT, read_manifest

    if stated_format(path) == ENTRY_FORMAT:
        from ..library.documents.documents import problem_of, read_sidecar

        return problem_of(path.parent, read_sidecar(path)), None
    manifest = read_manifest(path)
    problem = manifest.problem()
    return problem, manifest.problems_by_format(problem)


def read_field_or_instance(path: Path, on: Path | None, command: str) -> CrossField | Instance:
    """Field or instance in a file; on: file of the instance of a .rawfield.

    Raises InputError for a file that holds neither, and DomainError for a domain that the command does not
    take.
    """
    from ...models.instance.instance import Instance

    content = _read_content(path, on)
    check_domain(content if isinstance(content, Instance) else content.instance, command)
    return content


def _read_content(path: Path, on: Path | None) -> CrossField | Instance:
    from ...models.field.file import read_field
    from ...models.instance.file import read_instance

    if not path.is_file():
        raise InputError("there is no such file; give a field or an instance (.npz, .json)", file=path)
    require_suffix(path, *SAVED)
    if on is not None:
        return read_field(path, on=read_instance(on))
    if path.suffix.lower() == ".rawfield":
        raise InputError("holds no instance; give its instance with --on", file=path)
    try:
        return read_field(path)
    except CrossfieldError as as_field:
        try:
            return read_instance(path)
        except CrossfieldError as as_instance:
            first, second = (str(error).removeprefix(f"{path}: ") for error in (as_field, as_instance))
            raise InputError(
                f"is neither a field ({first}) nor an instance ({second})", file=path
            ) from as_field


def check_output(path: Path, *reads: str | Path | None, force: bool) -> None:
    """Raise OutputError if a command may not write to a path. reads: files that it reads."""
    check_targets(path.parent, [path.name], reads=filter(None, reads), force=force)


def find_drawing(source: str) -> str | None:
    """Drawing below the field of a sketch or a sample; None for a mesh or an instance, which have none."""
    from ...models.mesh.formats import MESH_READERS
    from ...models.sketch.samples import SAMPLES

    path = Path(source)
    if path.is_file():
        return None if path.suffix.lower() in {".json", ".npz", *MESH_READERS} else source
    return source if source in SAMPLES and SAMPLES[source].kind == "sketch" else None


def check_names(names: list[str] | None, table: Mapping[str, Any], kind: str) -> list[str]:
    """The names without repetitions; all names of the table if none is given.

    Raises InputError for a name that is not in the table.
    """
    from ...models.arguments import check_choice  # it loads NumPy

    for name in names or ():
        check_choice(kind, name, table)
    return list(dict.fromkeys(names or table))


def full_formulation_names(names: list[str] | None) -> list[str]:
    """Formulations of full or short names, each once; all formulations if no name is given."""
    from ...models.formulations.catalogue import FORMULATIONS, declaration_of

    return list(dict.fromkeys(declaration_of(name).name for name in names or FORMULATIONS))
