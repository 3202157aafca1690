"""Files and names that users give on the command line."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ...models.errors import CrossfieldError, InputError
from ...models.storage import require_suffix
from ...models.written_files import check_targets
from .output import print_notice

if TYPE_CHECKING:
    from ...models.field.field import CrossField
    from ...models.formulations.problem import Problem
    from ...models.instance.instance import Instance

SAVED: Final = (".npz", ".json", ".rawfield")
"""Suffixes of the files that hold a field."""


def read_source(
    source: str,
    *,
    stroke_weight: float | None = None,
    sketch: Mapping[str, Any] | None = None,
    mesh: Mapping[str, Any] | None = None,
) -> Instance:
    """Instance of a sketch or mesh file, a sample or an instance file; prints the warnings of its reader.

    sketch, mesh: options of `read_sketch` and `read_mesh`. Raises InputError for an option that the source
    does not take, and InstanceError for a weight that is out of range.
    """
    from ...models.mesh.formats import mesh_suffix

    path = Path(source)
    of_sketch = {name: value for name, value in (sketch or {}).items() if value not in (None, "none")}
    of_mesh = {name: value for name, value in (mesh or {}).items() if value not in (None, "unit")}
    if mesh_suffix(path):
        from ...models.mesh.read import read_mesh

        _refuse(of_sketch, "a mesh", path)
        instance = read_mesh(path, **of_mesh)
    else:
        _refuse(of_mesh, "no mesh file", path)
        instance = _read_drawing_or_instance(path, of_sketch)
    for text in instance.reading.warnings if instance.reading else ():
        print_notice(f"warning: {instance.source}: {text}")
    return instance.with_weights(stroke_weight=stroke_weight)


def _read_drawing_or_instance(path: Path, options: dict[str, Any]) -> Instance:
    """Instance of a sketch file, a sample or an instance file."""
    if path.is_file() and path.suffix.lower() in {".json", ".npz"}:
        from ...models.instance.file import read_instance

        _refuse(options, "no drawing", path)
        return read_instance(path)
    if not path.is_file():
        from ...models.mesh.shapes import MESHES
        from ...models.samples.samples import sample
        from ...models.sketch.samples import SAMPLES

        if str(path) in {*SAMPLES, *MESHES}:
            taken = {"size", "silhouette"} if str(path) in SAMPLES else set()
            refused = {name: value for name, value in options.items() if name not in taken}
            _refuse(refused, "a sample", path)
            return sample(str(path), **options)
    if not path.exists():
        raise InputError(
            "there is no such file and no such sample; `crossfield list` lists the samples", file=path
        )
    from ...models.sketch.read import read_sketch

    return read_sketch(path, **options)


def _refuse(options: Mapping[str, Any], what: str, path: Path) -> None:
    """Raise InputError for options that a source does not take."""
    if options:
        raise InputError(f"is {what}; leave --{' and --'.join(options).replace('_', '-')} out", file=path)


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


def read_field_or_instance(path: Path, on: Path | None) -> CrossField | Instance:
    """Field or instance in a file; on: file of the instance of a .rawfield.

    Raises InputError for a file that holds neither.
    """
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
            reasons = f"as a field: {first}; as an instance: {second}"
            raise InputError(f"is neither a field nor an instance; {reasons}", file=path) from as_field


def check_output(path: Path, *reads: str | Path | None, force: bool) -> None:
    """Raise OutputError if a command may not write to a path. reads: files that it reads."""
    check_targets(path.parent, [path.name], reads=filter(None, reads), force=force)


def find_drawing(source: str) -> str | None:
    """Drawing below the field of a sketch or a sample; None for a mesh or an instance, which have none."""
    from ...models.mesh.formats import mesh_suffix
    from ...models.sketch.samples import SAMPLES

    path = Path(source)
    if path.is_file():
        return None if mesh_suffix(path) or path.suffix.lower() in {".json", ".npz"} else source
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
