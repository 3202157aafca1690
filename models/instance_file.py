"""Instance files: documented JSON (instance.schema.json, mask as text rows) and .npz for large grids."""

from __future__ import annotations

import io
import json
import math
import struct
import tokenize
import warnings
import zipfile
import zlib
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from .errors import InstanceError
from .instance import Instance
from .storage import read_bytes, write_bytes

FORMAT: Final = "crossfield-instance"
VERSION: Final = 1
_SCALARS = ("name", "gauge", "source", "w_strokes", "w_beta", "pixel_size")
_ARRAYS = ("mask", "stroke_pixels", "theta", "w")
_MOST_BYTES: Final = 1 << 32  # a grid of 9999 x 9999 takes less; a small file that claims more is a trap
_DAMAGE: Final = (
    ValueError,
    TypeError,
    KeyError,
    OSError,
    EOFError,
    RuntimeError,
    SyntaxError,
    MemoryError,
    OverflowError,
    Warning,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


def write_instance(instance: Instance, path: str | Path) -> Path:
    """The path of the file that now holds the instance: JSON, or NumPy's .npz when the name ends so.

    Same instance, same bytes. Raises OutputError.
    """
    path = Path(path)
    return write_bytes(path, _npz(instance) if path.suffix.lower() == ".npz" else to_json(instance).encode())


def read_instance(path: str | Path) -> Instance:
    """The instance that a .json or .npz file holds.

    Raises InputError when the file cannot be read and InstanceError, with file and place, when it breaks the schema.
    """
    data = read_bytes(path)
    try:
        return of_arrays(unpack_arrays(data)) if data[:2] == b"PK" else of_json(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InstanceError("is neither JSON nor .npz; expected an instance file", file=path) from error
    except InstanceError as error:
        raise InstanceError(str(error), file=path) from error


def to_json(instance: Instance) -> str:
    """The instance as JSON text, one stroke pixel [row, column, theta, w] and one mask row a line."""
    rows = ["".join("#" if inside else "." for inside in row) for row in instance.mask]
    strokes = [
        f"    [{r}, {c}, {theta!r}, {w!r}]"
        for (r, c), theta, w in zip(
            instance.stroke_pixels.tolist(), instance.theta.tolist(), instance.w.tolist(), strict=True
        )
    ]
    head = (
        {"format": FORMAT, "version": VERSION}
        | {key: getattr(instance, key) for key in _SCALARS}
        | {"origin": list(instance.origin)}
    )
    lines = [f"  {json.dumps(key)}: {json.dumps(value)}," for key, value in head.items()]
    mask = ",\n".join(f'    "{row}"' for row in rows)
    return (
        "{\n"
        + "\n".join(lines)
        + f'\n  "mask": [\n{mask}\n  ],\n  "strokes": [\n'
        + ",\n".join(strokes)
        + "\n  ]\n}\n"
    )


def of_json(text: str) -> Instance:
    """The instance that JSON text describes. Raises InstanceError with the place in the document."""
    return of_document(parse_json(text))


def parse_json(text: str) -> object:
    """The document that JSON text holds, behind a byte order mark or not. Raises InstanceError with line and column."""
    try:
        return cast("object", json.loads(text.removeprefix("\ufeff")))
    except (ValueError, RecursionError) as error:
        raise InstanceError(f"is not valid JSON: {error}") from error


def of_document(document: object) -> Instance:
    """The instance that a parsed JSON document describes. Raises InstanceError with the place in the document."""
    check_version(document, FORMAT, VERSION)
    document = check_schema(document, "instance")
    width = len(document["mask"][0])
    for number, row in enumerate(document["mask"]):
        if len(row) != width:
            raise InstanceError(
                f"mask row {number} has {len(row)} pixels, the first one {width}; make them equal"
            )
    mask = np.array([[pixel == "#" for pixel in row] for row in document["mask"]], dtype=bool)
    strokes = document["strokes"]
    try:
        return Instance(
            mask=mask,
            stroke_pixels=np.array([stroke[:2] for stroke in strokes], dtype=np.int32).reshape(-1, 2),
            theta=np.array([stroke[2] for stroke in strokes], dtype=float),
            w=np.array([stroke[3] for stroke in strokes], dtype=float),
            origin=tuple(document.get("origin", (0.0, 0.0))),
            **{key: document[key] for key in _SCALARS if key in document},
        )
    except OverflowError as error:
        raise InstanceError("holds a number beyond the range of doubles") from error


def check_schema(document: object, schema: str, package: str = __package__) -> dict[str, Any]:
    """The document, which obeys the `<schema>.schema.json` that ships with a package. Raises InstanceError with the place."""
    import jsonschema

    errors = jsonschema.Draft202012Validator(_schema(schema, package)).iter_errors(cast("Any", document))
    error = min(errors, key=lambda e: (len(e.absolute_path), str(e.absolute_path)), default=None)
    if error is not None:
        raise InstanceError(f"{error.json_path}: {error.message[:200]}")
    return cast("dict[str, Any]", document)


@cache
def _schema(name: str, package: str) -> dict[str, Any]:
    return cast(
        "dict[str, Any]", json.loads(files(package).joinpath(f"{name}.schema.json").read_text("utf-8"))
    )


def check_version(document: object, form: str, version: int) -> None:
    """Nothing, when the document says that it has this format and version; else raises InstanceError."""
    if not isinstance(document, dict) or document.get("format") != form:
        raise InstanceError(f'is not a file of this kind: "format" must be "{form}"')
    found = document.get("version")
    if found != version:
        raise InstanceError(
            f"has version {str(found)[:20]}, but this program reads version {version}; write it again"
        )


def _npz(instance: Instance) -> bytes:
    """The .npz bytes; dates are fixed so that equal instances give equal bytes."""
    return pack_arrays(arrays_of(instance))


def arrays_of(instance: Instance) -> dict[str, np.ndarray[Any, Any]]:
    """The instance as named arrays; `head` is JSON text with format, version and scalars."""
    head = {"format": FORMAT, "version": VERSION} | {key: getattr(instance, key) for key in _SCALARS}
    arrays = {
        "head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8),
        "origin": np.array(instance.origin),
    }
    return arrays | {key: getattr(instance, key) for key in _ARRAYS}


def of_arrays(arrays: dict[str, np.ndarray[Any, Any]]) -> Instance:
    """The instance that `arrays_of` gave. Raises InstanceError with the array's name."""
    require_arrays(arrays, ("head", "origin", *_ARRAYS))
    head = head_of(arrays)
    check_version(head, FORMAT, VERSION)
    try:
        scalars = {key: head[key] for key in _SCALARS}
        origin = (float(arrays["origin"][0]), float(arrays["origin"][1]))
        entries: dict[str, Any] = scalars | {key: arrays[key] for key in _ARRAYS}
        return Instance(origin=origin, **entries)
    except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
        raise InstanceError(f"has an entry of the wrong kind: {error}") from error


def head_of(arrays: dict[str, np.ndarray[Any, Any]]) -> dict[str, Any]:
    """The parsed JSON text in the array `head`. Raises InstanceError."""
    try:
        head = json.loads(arrays["head"].tobytes())
    except (ValueError, RecursionError) as error:
        raise InstanceError("its array 'head' is not JSON text") from error
    return cast("dict[str, Any]", head)


def require_arrays(arrays: dict[str, np.ndarray[Any, Any]], names: tuple[str, ...]) -> None:
    """Nothing, when all the arrays are there and hold numbers; else raises InstanceError."""
    for name in names:
        if name not in arrays:
            raise InstanceError(f"holds no array {name!r}; expected a file written by crossfield")
        if arrays[name].dtype.kind not in "biuf":
            raise InstanceError(f"array {name!r} holds {arrays[name].dtype}, not numbers")


def pack_arrays(arrays: dict[str, np.ndarray[Any, Any]]) -> bytes:
    """The bytes of a compressed .npz that depend on the arrays alone, not on the clock."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            entry = io.BytesIO()
            np.lib.format.write_array(entry, np.ascontiguousarray(array), allow_pickle=False)
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(member, entry.getvalue())
    return buffer.getvalue()


def unpack_arrays(data: bytes) -> dict[str, np.ndarray[Any, Any]]:
    """The arrays of a .npz. Raises InstanceError when it is damaged, unreasonably large, or holds pickled objects."""
    try:
        with warnings.catch_warnings(action="error"), zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = [member for member in archive.infolist() if member.filename.endswith(".npy")]
            if sum(member.file_size for member in members) > _MOST_BYTES:
                raise InstanceError(f"is a .npz of more than {_MOST_BYTES >> 20} MiB when unpacked")
            return {member.filename[:-4]: _array(archive.read(member)) for member in members}
    except _DAMAGE as error:
        raise InstanceError(f"is a damaged or unsafe .npz: {error}") from error


def _array(entry: bytes) -> np.ndarray[Any, Any]:
    """The array of one .npy entry, whose header may not promise more than the entry holds."""
    stream = io.BytesIO(entry)
    read_header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    shape, _, kind = read_header[np.lib.format.read_magic(stream)](stream)
    if kind.hasobject or math.prod(shape) * kind.itemsize != len(entry) - stream.tell():
        raise ValueError("an array is pickled or has another length than its header says")
    stream.seek(0)
    return cast("np.ndarray[Any, Any]", np.lib.format.read_array(stream, allow_pickle=False))
