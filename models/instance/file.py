"""Instance files: documented JSON (instance.schema.json, mask as text rows) and .npz for large ones.

A file has a mask with its strokes, or a mesh with its strokes. Whether crosses are orthogonal,
the weights of pairs and prescribed indices are written only where they are not the default.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..array_archive import ArrayArchive, ExpectedArray, pack_arrays
from ..documents import check_schema, check_version, decode_json, parse_head, parse_json
from ..errors import InstanceError, naming, shortened
from ..input_limits import MAX_ARCHIVE, MAX_GRID, MAX_HEAD
from ..storage import read_bytes, require_suffix, write_bytes
from .grid import Grid
from .instance import Instance
from .mesh import MOST_FACES, Mesh

FORMAT: Final = "crossfield-instance"
VERSION: Final = 1
_SCALARS = {
    "name": "name",
    "gauge": "gauge",
    "source": "source",
    "view": "view",
    "w_strokes": "stroke_coefficient",
    "w_beta": "skew_coefficient",
    "orthogonal": "orthogonal",
}
"""Attributes of an instance by the keys of a file; view and orthogonal only where they are chosen."""
_ARCHIVE: Final = {
    "head": ExpectedArray(1, MAX_HEAD, "u"),
    "theta": ExpectedArray(1, MAX_GRID**2),
    "w": ExpectedArray(1, MAX_GRID**2),
}
_GRID_ARCHIVE: Final = {
    "origin": ExpectedArray(1, 2),
    "mask": ExpectedArray(2, MAX_GRID, "b"),
    "stroke_pixels": ExpectedArray(2, MAX_GRID**2, "iuf"),
}
_MOST_VERTICES: Final = 3 * MOST_FACES
_MESH_ARCHIVE: Final = {
    "vertices": ExpectedArray(2, _MOST_VERTICES, "f"),
    "faces": ExpectedArray(2, MOST_FACES, "iu"),
    "stroke_faces": ExpectedArray(1, MOST_FACES, "iu"),
}
_OPTIONAL: Final = {
    "pair_weights": ExpectedArray(1, max(2 * MAX_GRID**2, 2 * MOST_FACES)),
    "indices": ExpectedArray(2, _MOST_VERTICES, "iu"),
}


def write_instance(instance: Instance, path: str | Path, *, force: bool = False) -> Path:
    """Write an instance and return the path. Equal instances give equal bytes.

    Parameters
    ----------
    instance
        The instance.
    path
        File to write; the suffix .json or .npz selects the format.
    force
        Whether to replace a file that crossfield has not written or that has changed since.

    Raises
    ------
    InputError
        For another suffix.
    OutputError
        If the file cannot be written, or if another one is in the way.

    """
    path = Path(path)
    require_suffix(path, ".json", ".npz")
    packed = path.suffix.lower() == ".npz"
    content = pack_arrays(instance_arrays(instance)) if packed else instance_to_json(instance).encode()
    return write_bytes(path, content, force=force)


def read_instance(path: str | Path) -> Instance:
    """Read an instance.

    Parameters
    ----------
    path
        A .json or .npz file that `write_instance` wrote.

    Raises
    ------
    InputError
        If the file cannot be read.
    InstanceError
        If it breaks the schema; the message names the place.

    """
    data = read_bytes(path, MAX_ARCHIVE)
    with naming(path):
        if data[:2] != b"PK":
            return instance_of_document(parse_json(decode_json(data)))
        archive = ArrayArchive(data)
        instance = instance_of_archive(archive)
        archive.finish()
        return instance


def instance_to_json(instance: Instance) -> str:
    """The instance as JSON text: one line per mask row, vertex, face, weight of a pair, and stroke."""
    blocks = _mesh_blocks(instance) if isinstance(instance.domain, Mesh) else _grid_blocks(instance)
    if instance.pair_weights is not None:
        blocks["pair_weights"] = list(map(repr, instance.pair_weights.tolist()))
    if instance.indices is not None:
        blocks["indices"] = list(map(repr, instance.indices.tolist()))
    head = _head(instance)
    if isinstance(instance.domain, Grid):
        head["origin"] = list(instance.origin)
    lines = [f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
    for key, rows in blocks.items():
        content = ",\n".join(f"    {row}" for row in rows)
        lines.append(f'  "{key}": [\n{content}\n  ]')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _grid_blocks(instance: Instance) -> dict[str, list[str]]:
    """Lines of JSON for the rows of the mask and the strokes [row, column, theta, w]."""
    rows = zip(instance.stroke_pixels.tolist(), instance.theta.tolist(), instance.w.tolist(), strict=True)
    return {
        "mask": ['"' + "".join("#" if inside else "." for inside in row) + '"' for row in instance.mask],
        "strokes": [f"[{r}, {c}, {angle!r}, {weight!r}]" for (r, c), angle, weight in rows],
    }


def _mesh_blocks(instance: Instance) -> dict[str, list[str]]:
    """Lines of JSON for vertices [x, y, z], faces [a, b, c] and strokes [face, theta, w]."""
    mesh = instance.mesh
    strokes = zip(instance.stroke_index.tolist(), instance.theta.tolist(), instance.w.tolist(), strict=True)
    rows = {"vertices": mesh.vertices.tolist(), "faces": mesh.faces.tolist(), "strokes": map(list, strokes)}
    return {name: [repr(row) for row in listed] for name, listed in rows.items()}


def _head(instance: Instance) -> dict[str, Any]:
    """Format, version and scalars; a view and right angles only if there are any."""
    scalars = {key: getattr(instance, name) for key, name in _SCALARS.items()}
    for key, default in (("view", None), ("orthogonal", False)):
        if scalars[key] == default:
            del scalars[key]
    if isinstance(instance.domain, Grid):
        scalars["pixel_size"] = instance.pixel_size
    return {"format": FORMAT, "version": VERSION} | scalars


def instance_of_document(document: object) -> Instance:
    """Read an instance from a parsed JSON document. Raises InstanceError with the place in the document."""
    check_version(document, FORMAT, VERSION)
    checked = check_schema(document, "instance", __package__)
    try:
        return _make_instance(checked, _arrays_of_document(checked))
    except OverflowError as error:
        raise InstanceError("holds a number beyond the range of doubles") from error


def _arrays_of_document(document: dict[str, Any]) -> dict[str, Any]:
    """The lists of a document as arrays, by the names of an .npz."""
    lists = ("vertices", "faces", "origin", *_OPTIONAL)
    arrays: dict[str, Any] = {key: document[key] for key in lists if key in document}
    if "vertices" in document:
        strokes = np.array(document["strokes"], dtype=np.float64).reshape(-1, 3)
        arrays["stroke_faces"] = strokes[:, 0]
    else:
        width = len(document["mask"][0])
        for number, row in enumerate(document["mask"]):
            if len(row) != width:
                raise InstanceError(
                    f"mask row {number} has {len(row)} pixels, the first one {width}; make them equal"
                )
        letters = np.frombuffer("".join(document["mask"]).encode(), dtype=np.uint8)
        strokes = np.array(document["strokes"], dtype=np.float64).reshape(-1, 4)
        arrays |= {"mask": letters.reshape(-1, width) == ord("#"), "stroke_pixels": strokes[:, :2]}
    return arrays | {"theta": strokes[:, -2], "w": strokes[:, -1]}


def _make_instance(head: dict[str, Any], arrays: dict[str, Any]) -> Instance:
    """The instance of the scalars in a head and of arrays. Raises InstanceError."""
    more = {"name": head["name"]} | {name: head[key] for key, name in _SCALARS.items() if key in head}
    more |= {key: arrays[key] for key in ("theta", "w", *_OPTIONAL) if key in arrays}
    if "vertices" in arrays:
        mesh = Mesh(arrays["vertices"], arrays["faces"])
        strokes = arrays["stroke_faces"]
        return Instance.on_faces(mesh=mesh, stroke_faces=strokes, **{"orthogonal": False} | more)
    strokes, pixels = len(arrays["stroke_pixels"]), int(np.count_nonzero(arrays["mask"]))
    if strokes > pixels:
        raise InstanceError(
            f"lists {strokes} stroke pixels, but its mask has {pixels} pixels; list each once"
        )
    more |= {key: facts[key] for key, facts in (("pixel_size", head), ("origin", arrays)) if key in facts}
    return Instance.on_pixels(mask=arrays["mask"], stroke_pixels=arrays["stroke_pixels"], **more)


def instance_arrays(instance: Instance) -> dict[str, np.ndarray[Any, Any]]:
    """The instance as named arrays; `head` is JSON text with format, version and scalars."""
    arrays: dict[str, np.ndarray[Any, Any]] = {
        "head": np.frombuffer(json.dumps(_head(instance)).encode(), dtype=np.uint8)
    }
    if isinstance(mesh := instance.domain, Mesh):
        arrays |= {"vertices": mesh.vertices, "faces": mesh.faces, "stroke_faces": instance.stroke_index}
    else:
        arrays["origin"] = np.array(instance.origin)
        arrays |= {"mask": instance.mask, "stroke_pixels": instance.stroke_pixels}
    arrays |= {"theta": instance.theta, "w": instance.w}
    optional = {name: getattr(instance, name) for name in _OPTIONAL}
    return arrays | {name: array for name, array in optional.items() if array is not None}


def instance_of_archive(archive: ArrayArchive, prefix: str = "") -> Instance:
    """Read an instance from arrays whose names start with a prefix. Raises InstanceError."""
    of_domain = _MESH_ARCHIVE if f"{prefix}vertices" in archive else _GRID_ARCHIVE
    optional = {name: kind for name, kind in _OPTIONAL.items() if prefix + name in archive}
    return instance_of_arrays(archive.arrays(_ARCHIVE | of_domain | optional, prefix))


def instance_of_arrays(arrays: dict[str, np.ndarray[Any, Any]]) -> Instance:
    """The instance whose arrays `instance_arrays` returned. Raises InstanceError with the array's name."""
    head = parse_head(arrays)
    check_version(head, FORMAT, VERSION)
    try:
        return _make_instance({"name": head["name"]} | head, arrays)
    except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
        raise InstanceError(f"has an entry of the wrong kind: {shortened(error)}") from error
