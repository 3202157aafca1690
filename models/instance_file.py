"""Instance files: documented JSON (instance.schema.json, mask as text rows) and .npz for large grids."""

from __future__ import annotations

import io
import json
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


def write_instance(instance: Instance, path: str | Path) -> Path:
    """The path of the file that now holds the instance: JSON, or NumPy's .npz when the name ends so.

    Same instance, same bytes. Raises OutputError.
    """
    path = Path(path)
    return write_bytes(path, _npz(instance) if path.suffix == ".npz" else to_json(instance).encode())


def read_instance(path: str | Path) -> Instance:
    """The instance that a .json or .npz file holds.

    Raises InputError when the file cannot be read and InstanceError, with file and place, when it breaks the schema.
    """
    data = read_bytes(path)
    try:
        return _of_npz(data) if data[:2] == b"PK" else of_json(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InstanceError("is neither JSON nor .npz; expected an instance file", file=path) from error
    except InstanceError as error:
        raise InstanceError(str(error), file=path) from error


def to_json(instance: Instance) -> str:
    """The instance as JSON text, one stroke pixel [row, column, theta, w] and one mask row a line."""
    rows = ["".join("#" if inside else "." for inside in row) for row in instance.mask]
    strokes = [
        f"    [{r}, {c}, {theta!r}, {w!r}]"
        for (r, c), theta, w in zip(instance.stroke_pixels.tolist(), instance.theta.tolist(), instance.w.tolist(), strict=True)
    ]
    head = {"format": FORMAT, "version": VERSION} | {key: getattr(instance, key) for key in _SCALARS} | {"origin": list(instance.origin)}
    lines = [f"  {json.dumps(key)}: {json.dumps(value)}," for key, value in head.items()]
    mask = ",\n".join(f'    "{row}"' for row in rows)
    return "{\n" + "\n".join(lines) + f'\n  "mask": [\n{mask}\n  ],\n  "strokes": [\n' + ",\n".join(strokes) + "\n  ]\n}\n"


def of_json(text: str) -> Instance:
    """The instance that JSON text describes. Raises InstanceError with the place in the document."""
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InstanceError(f"is not valid JSON: {error}") from error
    _check_version(document)
    check_schema(document, "instance")
    width = len(document["mask"][0])
    for number, row in enumerate(document["mask"]):
        if len(row) != width:
            raise InstanceError(f"mask row {number} has {len(row)} pixels, the first one {width}; make them equal")
    mask = np.array([[pixel == "#" for pixel in row] for row in document["mask"]], dtype=bool)
    strokes = document["strokes"]
    return Instance(
        mask=mask,
        stroke_pixels=np.array([stroke[:2] for stroke in strokes], dtype=np.int32).reshape(-1, 2),
        theta=np.array([stroke[2] for stroke in strokes], dtype=float),
        w=np.array([stroke[3] for stroke in strokes], dtype=float),
        origin=tuple(document.get("origin", (0.0, 0.0))),
        **{key: document[key] for key in _SCALARS if key in document},
    )


def check_schema(document: object, schema: str) -> None:
    """Nothing, when `document` obeys the shipped `<schema>.schema.json`; else raises InstanceError with the place."""
    import jsonschema

    errors = jsonschema.Draft202012Validator(_schema(schema)).iter_errors(cast("Any", document))
    error = min(errors, key=lambda e: (len(e.absolute_path), str(e.absolute_path)), default=None)
    if error is not None:
        raise InstanceError(f"{error.json_path}: {error.message[:200]}")


@cache
def _schema(name: str) -> dict[str, Any]:
    return cast("dict[str, Any]", json.loads(files(__package__).joinpath(f"{name}.schema.json").read_text("utf-8")))


def _check_version(document: object) -> None:
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise InstanceError(f'is not an instance file: "format" must be "{FORMAT}"')
    if document.get("version") != VERSION:
        raise InstanceError(f"has version {document.get('version')!r}, but this program reads version {VERSION}; write it again")


def _npz(instance: Instance) -> bytes:
    """The .npz bytes; dates are fixed so that equal instances give equal bytes."""
    head = {"format": FORMAT, "version": VERSION} | {key: getattr(instance, key) for key in _SCALARS}
    arrays = {"head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8), "origin": np.array(instance.origin)}
    return pack_arrays(arrays | {key: getattr(instance, key) for key in _ARRAYS})


def _of_npz(data: bytes) -> Instance:
    arrays = unpack_arrays(data)
    missing = [key for key in ("head", "origin", *_ARRAYS) if key not in arrays]
    if missing:
        raise InstanceError(f"holds no array {missing[0]!r}; expected an instance written by crossfield")
    try:
        head = json.loads(arrays["head"].tobytes())
    except ValueError as error:
        raise InstanceError("its array 'head' is not JSON text") from error
    _check_version(head)
    try:
        scalars = {key: head[key] for key in _SCALARS}
        origin = (float(arrays["origin"][0]), float(arrays["origin"][1]))
        return Instance(origin=origin, **scalars, **{key: arrays[key] for key in _ARRAYS})
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InstanceError(f"has an entry of the wrong kind: {error}") from error


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
    """The arrays of a .npz. Raises InstanceError when it is damaged or holds pickled objects."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (ValueError, OSError, KeyError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise InstanceError(f"is a damaged or unsafe .npz: {error}") from error


