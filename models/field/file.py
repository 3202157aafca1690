"""Field files: .npz and JSON (field.schema.json) with the instance, and files of directions alone.

An .npz holds alpha, beta (n,) and p (m,) in the order of the instance's points and pairs, `head` with format
and version as JSON text, and the arrays of the instance's own .npz, their names preceded by `instance_`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np

from ..array_archive import ArrayArchive, ExpectedArray, pack_arrays
from ..documents import check_schema, check_version, decode_json, parse_head, parse_json
from ..errors import CrossfieldError, InputError, InstanceError, OutputError, naming
from ..input_limits import MAX_ARCHIVE, MAX_GRID, MAX_HEAD
from ..instance.domain import Bools, Floats, Ints
from ..instance.file import (
    instance_arrays,
    instance_of_archive,
    instance_of_document,
    instance_to_json,
)
from ..instance.grid import Grid
from ..instance.instance import Instance
from ..instance.mesh import Mesh
from ..storage import read_bytes, replacing, require_suffix
from ..written_files import FORCE, check_targets, is_unchanged
from .exchange import TEXT_READERS, TEXT_WRITERS, most_text_bytes, to_obj, to_sings
from .field import NORMS, CrossField

FORMAT: Final = "crossfield-field"
VERSION: Final = 1
_PREFIX = "instance_"
_ARCHIVE: Final = {
    "head": ExpectedArray(1, MAX_HEAD, "u"),
    "alpha": ExpectedArray(1, MAX_GRID**2),
    "beta": ExpectedArray(1, MAX_GRID**2),
    "p": ExpectedArray(1, 2 * MAX_GRID**2),
}
SAME: Final = 1e-9  # difference of energies, relative to them plus 1, up to which none is the lower one
_Entry = TypeVar("_Entry")


def write_field(field: CrossField, path: str | Path, *, force: bool = False) -> Path:
    """Write a field and return the path. Equal fields give equal bytes.

    Parameters
    ----------
    field
        The field.
    path
        File to write; the suffix .npz, .json, .rawfield, .rosy, .ply or .vtk selects the format. A .rawfield
        and a .rosy come with their mesh (.obj), a .rawfield with its singularities (.sings).
    force
        Whether to replace files that crossfield has not written or that have changed since, and a better
        field: one on the same instance with less energy in every norm.

    Raises
    ------
    InputError
        For another suffix.
    OutputError
        If a file cannot be written, or is in the way and not replaced unless forced.

    """
    path = Path(path)
    require_suffix(path, *_WRITERS)
    names = field_names(path.name)
    check_targets(path.parent, names, force=force)
    if not force and path.suffix.lower() != ".rosy":  # its crosses have right angles, so another energy
        _check_not_worse(field, path)
    contents: list[Callable[[CrossField], bytes]] = [
        _WRITERS[path.suffix.lower()],
        lambda field: to_obj(field.instance),
        to_sings,
    ]
    with ExitStack() as stack:  # the files get their names together, at its end
        for name, content in zip(names, contents, strict=False):
            stack.enter_context(replacing(path.with_name(name), force=force)).write(content(field))
    return path


def field_names(name: str) -> list[str]:
    """The name of the file of a field, and those of its mesh and its singularities if they come with it."""
    companions = {".rawfield": [".obj", ".sings"], ".rosy": [".obj"]}
    path = Path(name)
    return [name, *(path.with_suffix(suffix).name for suffix in companions.get(path.suffix.lower(), []))]


def earlier_field(path: Path, on: Instance) -> CrossField | None:
    """The field on this instance that crossfield wrote to a file and nobody changed; None without one."""
    try:
        return read_field(path, on=on) if is_unchanged(path) else None
    except CrossfieldError:
        return None


def _check_not_worse(field: CrossField, path: Path) -> None:
    """Raise OutputError if a field would replace a better one."""
    earlier = earlier_field(path, field.instance)
    if earlier is None:
        return
    energies = [(earlier.energy(norm).total, field.energy(norm).total) for norm in NORMS]
    if all(was < now - SAME * (1 + now) for was, now in energies):
        was, now = energies[0]
        raise OutputError(
            f"has a field of lower energy ({was:.6g}, now {now:.6g}) in every norm; choose another name, or "
            f"replace it with {FORCE}",
            file=path,
        )


def read_field(path: str | Path, *, on: Instance | None = None) -> CrossField:
    """Read a field with its instance.

    Parameters
    ----------
    path
        A .npz, .json, .rawfield or .rosy file. A .rawfield has four vectors per face, in any order and of any
        length: u, v, -u and -v. Faces are those of the mesh; on a grid the triangles that `write_field`
        writes, or one per pixel.
    on
        The instance that the field must be on; a field of its other gauge is moved into its windows. A
        .rawfield and a .rosy need it: they contain none.

    Raises
    ------
    InputError
        For another suffix, an unreadable file, and a file that needs an instance without one.
    InstanceError
        For a damaged file and for another instance; the message names the place.

    """
    path = Path(path)
    with naming(path):
        if path.suffix.lower() in TEXT_READERS:
            if on is None:
                raise InputError("holds no instance; give the instance: read_field(path, on=instance)")
            return TEXT_READERS[path.suffix.lower()](read_bytes(path, most_text_bytes(on)), on)
        require_suffix(path, *_READERS, *TEXT_READERS)
        field = _READERS[path.suffix.lower()](read_bytes(path, MAX_ARCHIVE))
        return field if on is None else field.on_instance(on)


def _field_to_npz(field: CrossField) -> bytes:
    head = json.dumps({"format": FORMAT, "version": VERSION})
    arrays: dict[str, np.ndarray[Any, Any]] = {
        "head": np.frombuffer(head.encode(), dtype=np.uint8),
        "alpha": field.alpha,
        "beta": field.beta,
        "p": field.p,
    }
    return pack_arrays(
        arrays | {_PREFIX + name: array for name, array in instance_arrays(field.instance).items()}
    )


def _field_of_npz(data: bytes) -> CrossField:
    archive = ArrayArchive(data)
    arrays = archive.arrays(_ARCHIVE)
    check_version(parse_head(arrays), FORMAT, VERSION)
    instance = _read_embedded(lambda source: instance_of_archive(source, _PREFIX), archive)
    archive.finish()
    return CrossField(instance, arrays["alpha"], arrays["beta"], arrays["p"])


def _read_embedded(read: Callable[[_Entry], Instance], source: _Entry) -> Instance:
    try:
        return read(source)
    except InstanceError as error:
        raise InstanceError(f"its instance: {error}") from error


def field_to_json(field: CrossField) -> bytes:
    """Return the bytes of the field's JSON file, its instance included."""
    blocks = _rows_of_faces(field) if isinstance(field.instance.domain, Mesh) else _rows_of_pixels(field)
    instance = instance_to_json(field.instance).rstrip().replace("\n", "\n  ")
    text = f'{{\n  "format": "{FORMAT}",\n  "version": {VERSION},\n  "instance": {instance}'
    for key, columns in blocks.items():
        rows = zip(*(column.tolist() for column in columns), strict=True)
        content = ",\n".join(f"    {json.dumps(row)}" for row in rows)
        text += f',\n  "{key}": [\n{content}\n  ]'
    return f"{text}\n}}\n".encode()


def _rows_of_pixels(field: CrossField) -> dict[str, tuple[np.ndarray[Any, Any], ...]]:
    """Columns of the rows of a field on pixels."""
    grid = field.instance.grid
    jumps = np.append(field.p, 0).astype(object)
    jumps[-1] = None  # where there is no pair
    upper, right = (jumps[pair] for pair in grid.pair_number)
    return {"pixels": (grid.rows, grid.columns, field.alpha, field.beta, upper, right)}


def _rows_of_faces(field: CrossField) -> dict[str, tuple[np.ndarray[Any, Any], ...]]:
    """Columns of the rows of a field on faces, and of its jumps."""
    mesh = field.instance.mesh
    return {"faces": (field.alpha, field.beta), "jumps": (mesh.first, mesh.second, field.p)}


def field_of_json(data: bytes) -> CrossField:
    """Read a field from the bytes of a JSON file. Raises InstanceError with the place in the document."""
    document = parse_json(decode_json(data))
    check_version(document, FORMAT, VERSION)
    checked = check_schema(document, "field", __package__)
    instance = _read_embedded(instance_of_document, checked["instance"])
    try:
        if "faces" in checked:
            return _field_on_faces(instance, checked)
        row, column, alpha, beta, upper, right = zip(*checked["pixels"], strict=True)
        _check_places(instance.grid, np.array([row, column], dtype=np.int32))
        p = np.zeros(len(instance.grid.first), dtype=np.int32)
        tables = zip(("upper", "right"), instance.grid.pair_number, (upper, right), strict=True)
        for name, pair, jumps in tables:
            _fill_jumps(p, pair, np.array(jumps, dtype=np.float64), name)
        return CrossField(instance, np.array(alpha, dtype=np.float64), np.array(beta, dtype=np.float64), p)
    except OverflowError as error:
        raise InstanceError("holds a number beyond the range of doubles") from error


def _field_on_faces(instance: Instance, document: dict[str, Any]) -> CrossField:
    """The field of a document with faces and jumps. Raises InstanceError for pairs of another mesh."""
    mesh = instance.mesh
    alpha, beta = np.array(document["faces"], dtype=np.float64).T
    *pairs, p = np.array(document["jumps"], dtype=np.int32).reshape(-1, 3).T
    if not np.array_equal(pairs, [mesh.first, mesh.second]):
        raise InstanceError("$.jumps: lists other pairs of faces than the mesh has; write it again")
    return CrossField(instance, alpha, beta, p)


def _check_places(grid: Grid, places: Ints) -> None:
    expected = np.stack([grid.rows, grid.columns])
    if places.shape != expected.shape:
        raise InstanceError(f"has {places.shape[1]} pixels, but its mask has {grid.size}")
    wrong = (places != expected).any(axis=0)
    if wrong.any():
        at = int(np.argmax(wrong))
        raise InstanceError(
            f"$.pixels[{at}]: is {places[:, at].tolist()}, but the mask has {expected[:, at].tolist()} there"
        )


def _fill_jumps(p: Ints, pair: Ints, jumps: Floats, name: str) -> None:
    """Store the jumps of the pixels, NaN where there is none, at their pairs in p."""
    wrong: Bools = np.isnan(jumps) != (pair < 0)
    if wrong.any():
        raise InstanceError(
            f"$.pixels[{int(np.argmax(wrong))}]: a jump belongs where the mask has the {name} neighbour, "
            "null elsewhere"
        )
    p[pair[pair >= 0]] = jumps[pair >= 0].astype(np.int32)


_WRITERS: Final[dict[str, Callable[[CrossField], bytes]]] = {
    ".npz": _field_to_npz,
    ".json": field_to_json,
    **TEXT_WRITERS,
}
_READERS: Final[dict[str, Callable[[bytes], CrossField]]] = {".npz": _field_of_npz, ".json": field_of_json}
