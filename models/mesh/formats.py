"""Mesh files: vertices, triangles, and the polylines of an OBJ.

Every reader accounts for all faces that a file states or begins, because a face that is lost is a hole.
Polygons are refused: there are several ways to cut them into triangles.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from ..arguments import whole_numbers
from ..errors import InputError, MeshError, quote_line, shortened
from ..input_limits import MAX_BYTES
from ..instance.domain import Floats, Ints
from ..instance.mesh import MOST_FACES, Mesh
from ..packed import unpack
from ..storage import read_bytes, require_suffix
from ..text_rows import Lines, filled_lines, number_rows, plain_text
from .vertices import NO_LINES, first_at_places, join_vertices

_MOST_VERTICES: Final = 3 * MOST_FACES
_HEAD: Final = 1 << 16  # bytes in which a file states the numbers of its vertices and faces
_AGAIN: Final = "write the file again"
_OBJ_IGNORED: Final = frozenset(
    b"vt vn vp p g s o mg usemtl mtllib usemap maplib c_interp d_interp shadow_obj trace_obj".split()
)
_OFF_HEAD: Final = rb"\s*(?:ST|C|N)*OFF\s+(\d{1,9})\s+(\d{1,9})\b"
_PLY_BODY: Final = re.compile(rb"^end_header[ \t]*(?:\r?\n|\Z)", re.MULTILINE)
_CORNERS: Final = ("vertex_indices", "vertex_index")  # names of the list of vertices of a face
_LENGTH: Final = "length of "
_OLD_TYPES: Final = ("char", "uchar", "short", "ushort", "int", "uint", "float", "double")
_NEW_TYPES: Final = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64")
_PLY_TYPES: Final = dict(zip(_OLD_TYPES + _NEW_TYPES, 2 * "bBhHiIfd", strict=True))
_STL_HEAD: Final = 84  # bytes, of which the last four are the number of triangles
_STL_TRIANGLE: Final = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_FACET: Final = re.compile(
    rb"facet(?:\s+normal(?:\s+\S+){3})?\s+outer\s+loop"
    + 3 * rb"\s+vertex\s+(\S+)\s+(\S+)\s+(\S+)"
    + rb"\s+endloop\s+endfacet(?:\s+|\Z)",
    re.IGNORECASE,
)
_SOLID: Final = re.compile(rb"(end[ \t]*)?solid\b(?:(?!\sfacet\s+normal\s+[-+.\d]).)*\s*", re.IGNORECASE)


class MeshFile(NamedTuple):
    """Content of a mesh file: a mesh, not yet checked, edges [vertex, vertex] (k, 2) of polylines, and what
    was left out.
    """

    mesh: Mesh
    lines: Ints = NO_LINES
    notes: tuple[str, ...] = ()


def read_mesh_file(path: Path) -> MeshFile:
    """Content of a mesh file, plain or packed.

    Raises InputError for another suffix or content, or a file that is too large, and MeshError for polygons.
    """
    suffix = mesh_suffix(path)
    if suffix in _CONVERTED:
        what, remedy = _CONVERTED[suffix]
        raise InputError(f"is {what}, which is not read; {remedy}")
    if not suffix:
        require_suffix(path, *MESH_READERS)
    data = read_bytes(path, MAX_BYTES, "simplify the mesh")
    return MESH_READERS[suffix](unpack(data, MAX_BYTES, "simplify the mesh"))


def mesh_suffix(path: Path) -> str:
    """Suffix of a kind of mesh files, in front of .gz; empty for other files."""
    suffix = unpacked_name(path).suffix.lower()
    return suffix if suffix in {*MESH_READERS, *_CONVERTED} else ""


def unpacked_name(path: Path) -> Path:
    """The name of a file without .gz."""
    return path.with_suffix("") if path.suffix.lower() == ".gz" else path


def _read_obj(data: bytes) -> MeshFile:
    """Vertices, faces and polylines of an OBJ; texture, normals, groups, materials and points are ignored."""
    vertices: Lines = []
    faces: list[list[int]] = []
    edges: list[tuple[int, int]] = []
    unknown: Lines = []
    for number, line in _lines_without_comments(data):
        word, *values = line.split()
        if word == b"v":
            vertices.append((number, line.split(b"v", 1)[1]))
        elif word in {b"f", b"l"}:
            try:
                corners = [_vertex_of(value, len(vertices)) for value in values]
            except ValueError as error:
                raise InputError(f"line {number}: {quote_line(line)} is no OBJ; {_AGAIN}") from error
            if word == b"l":
                edges += pairwise(corners)
            elif len(corners) == 3:
                faces.append(corners)
            else:
                raise MeshError(f"line {number}: has a face of {len(corners)} corners; triangulate it")
        elif word not in _OBJ_IGNORED:
            unknown.append((number, line))
        _check_size(max(len(vertices), len(edges)), len(faces))
    lines = whole_numbers(np.array(edges).reshape(-1, 2), "polylines", MeshError)
    if ((lines < 0) | (lines >= len(vertices))).any():
        raise MeshError(f"a polyline has a vertex that is none of the {len(vertices)} in the file")
    notes = tuple(
        f"line {number}: {quote_line(line)} is of no kind that is read, left out ({len(unknown)} such lines)"
        for number, line in unknown[:1]
    )
    mesh = Mesh(_positions(vertices), np.array(faces).reshape(-1, 3))
    return MeshFile(mesh, lines, notes)


def _lines_without_comments(data: bytes) -> Lines:
    """Filled lines; a backslash at the end joins the next one, but not at the end of a comment."""
    return filled_lines(re.sub(rb"#.*", b"", plain_text(data)).replace(b"\\\n", b" "))


def _positions(rows: Lines) -> Floats:
    return number_rows(rows, 3, "x y z of a vertex", more=True)


def _vertex_of(corner: bytes, vertices: int) -> int:
    """Number of a vertex `v`, `v/vt` or `v//vn`, from 1, or negative from the last one so far."""
    number = int(corner.split(b"/", 1)[0])
    if number == 0:
        raise ValueError
    return number - 1 if number > 0 else max(vertices + number, -1)


def _read_off(data: bytes) -> MeshFile:
    rows = _lines_without_comments(data)
    numbers = re.match(_OFF_HEAD, b" ".join(line for _, line in rows[:2]))
    if not numbers:
        raise InputError("does not begin as .off, with the numbers of its vertices and faces")
    vertices, faces = map(int, numbers.groups())
    _check_size(vertices, faces)
    rows = rows[1 if len(rows[0][1].split()) > 1 else 2 :]
    _check_complete(len(rows), vertices + faces, "lines of vertices and faces")
    corners = rows[vertices : vertices + faces]
    for number, line in corners:
        count = line.split()[0]
        if count != b"3":
            words = count.decode("ascii", "replace")
            raise MeshError(f"line {number}: has a face of {words} corners; triangulate it")
    table = number_rows(corners, 4, "3 and the vertices of a face", more=True)
    mesh = Mesh(_positions(rows[:vertices]), whole_numbers(table[:, 1:], "faces", MeshError))
    return MeshFile(mesh, notes=_note_rest(len(rows) - vertices - faces, "line"))


def _check_complete(held: int, stated: int, what: str) -> None:
    """Raise InputError for a file that holds fewer things than it states."""
    if held < stated:
        raise InputError(f"states {stated} {what} and holds {held}: it is cut off or damaged; {_AGAIN}")


def _note_rest(count: int, unit: str) -> tuple[str, ...]:
    """A note on lines or bytes at the end of a file."""
    return (f"the last {count} {unit}{'s' * (count > 1)}, behind all faces, are left out",) * (count > 0)


def _check_size(vertices: int, faces: int) -> None:
    """Raise MeshError for too many vertices or faces, before their memory is spent."""
    if vertices > _MOST_VERTICES or faces > MOST_FACES:
        raise MeshError(
            f"has more than {_MOST_VERTICES} vertices or {MOST_FACES} faces, the most that are allowed; "
            "simplify it"
        )


def _read_ply(data: bytes) -> MeshFile:
    """Vertices and faces of a PLY; the numbers of a text become doubles, and are read as binary ones."""
    binary = re.search(rb"^format[ \t]+binary_(little|big)_endian", data[:_HEAD], re.MULTILINE)
    head, *body = _PLY_BODY.split(data if binary else plain_text(data), 1)
    order = (">" if binary[1] == b"big" else "<") if binary else ""
    elements = re.split(r"^element\s", head.decode("ascii", "replace"), flags=re.MULTILINE)[1:]
    tables: dict[str, Any] = {}
    try:
        sizes = {name: int(size) for name, size, *_ in map(str.split, elements) if size.isdigit()}
        _check_size(sizes["vertex"], sizes["face"])
        lines = [] if binary else filled_lines(body[0], head.count(b"\n") + 2)
        rest = memoryview(body[0] if binary else number_rows(lines).tobytes())
        while not {"vertex", "face"} <= tables.keys():
            (name, _), *lines_of_head = map(str.split, elements.pop(0).splitlines())
            properties = [words[1:] for words in lines_of_head if words[:1] == ["property"]]
            tables[name], rest = _ply_rows(name, sizes[name], properties, rest, order)
        positions = np.stack([tables["vertex"][axis] for axis in "xyz"], axis=1)
        faces = next(tables["face"][name] for name in _CORNERS if name in tables["face"].dtype.names)
    except (ValueError, LookupError, OverflowError, StopIteration) as error:
        reason = "does not begin as .ply, with the numbers and properties of its vertices and faces"
        raise InputError(f"{reason}: {shortened(error)}; {_AGAIN}") from error
    left = 0 if elements else len(rest)
    notes = _note_rest(left, "byte") if binary else _note_rest(left // 8, "number")
    return MeshFile(Mesh(positions, faces), notes=notes)


def _ply_rows(
    name: str, size: int, properties: list[list[str]], data: memoryview, order: str
) -> tuple[Any, memoryview]:
    """Rows of an element as a structured array, and the bytes behind; order: of bytes, empty for doubles.

    Lists must be as long as in the first row, and lists of corners have three numbers. Raises ValueError or
    LookupError for properties that make no sense.
    """
    fields: list[tuple[Any, ...]] = []
    lists: dict[str, int] = {}
    for *kinds, field in properties:
        *length, of = (order + _PLY_TYPES[kind] if order else "f8" for kind in kinds if kind != "list")
        if length:
            at, known = np.dtype(fields).itemsize, field in _CORNERS or not size
            lists[field] = 3 if known else int(np.frombuffer(data, length[0], 1, at)[0])
            fields.append((_LENGTH + field, length[0]))
        fields.append((field, of, (lists[field],) if length else ()))
    row = np.dtype(fields).itemsize
    held = min(len(data) // row, size) if row else 0
    table = np.frombuffer(data, fields, held)
    for field, usual in lists.items():
        wrong = np.nonzero(table[_LENGTH + field] != usual)[0]
        if len(wrong):
            number = int(table[_LENGTH + field][wrong[0]])
            if field in _CORNERS:
                raise MeshError(f"face {wrong[0]}: has {number} corners; triangulate it")
            reason = f"its list {field} has {number} numbers, not {usual}; leave the list out"
            raise InputError(f"{name} {wrong[0]}: {reason}")
    _check_complete(held, size, f"rows of the element {name}")
    return table, data[held * row :]


def _read_stl(data: bytes) -> MeshFile:
    """Triangles that share a corner where their coordinates are equal, vertices in order of appearance."""
    text = plain_text(data)
    binary = b"\0" in data[_STL_HEAD - 4 : _STL_HEAD] and b"\0" in text  # as in every count below 2^24
    corners, notes = _read_binary_stl(data) if binary else _read_text_stl(text)
    _check_size(0, len(corners) // 3)
    faces = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    mesh, _ = join_vertices(Mesh(corners, faces), NO_LINES, first_at_places(corners))
    return MeshFile(mesh, notes=notes)


def _read_binary_stl(data: bytes) -> tuple[Floats, tuple[str, ...]]:
    """Corners of the triangles of an STL, and notes."""
    _check_complete(len(data), _STL_HEAD, "bytes at least, the head of a binary STL,")
    stated = int.from_bytes(data[_STL_HEAD - 4 : _STL_HEAD], "little")
    held, rest = divmod(len(data) - _STL_HEAD, _STL_TRIANGLE.itemsize)
    _check_complete(held, stated, "triangles")
    notes: tuple[str, ...] = ()
    if not stated and held:
        stated, notes = held, (f"it states 0 triangles; all {held} that it holds are read",)
    rest += (held - stated) * _STL_TRIANGLE.itemsize
    corners = np.frombuffer(data, _STL_TRIANGLE, stated, _STL_HEAD)["corners"]
    return corners.reshape(-1, 3).astype(np.float64), notes + _note_rest(rest, "byte")


def _read_text_stl(text: bytes) -> tuple[Floats, tuple[str, ...]]:
    """Corners of the triangles of an STL, and notes."""
    rows: Lines = []
    at, ended = len(text) - len(text.lstrip()), False
    line = 1 + text.count(b"\n", 0, at)
    while at < len(text):
        item = _FACET.match(text, at) or _SOLID.match(text, at)
        if not item:
            words = quote_line(text[at : at + _HEAD].split(b"\n")[0])
            raise InputError(f"line {line}: {words} begins no whole facet of an .stl; {_AGAIN}")
        if item.re is _FACET:
            rows.append((line, b" ".join(item.groups())))
        else:
            ended = item[1] is not None
        line += text.count(b"\n", at, item.end())
        at = item.end()
    corners = number_rows(rows, 9, "the corners of a facet").reshape(-1, 3)
    return corners, () if ended else ("it ends without endsolid, so that faces may be missing",)


MESH_READERS: Final[dict[str, Callable[[bytes], MeshFile]]] = {
    ".obj": _read_obj,
    ".ply": _read_ply,
    ".off": _read_off,
    ".stl": _read_stl,
}
"""Suffixes of mesh files, and their readers."""

_CAD: Final = ("a CAD model", "save its surface as .stl in FreeCAD or your CAD program")
_SCENE: Final = ("a scene", "save its triangles as .obj in Blender")
_PRINT: Final = ("a print job", "save its parts as .stl in the slicer")
_SIMULATION: Final = ("a mesh for simulations", "save its surface as .stl, in Gmsh or ParaView")
_CONVERTED: Final = {
    **dict.fromkeys((".step", ".stp", ".iges", ".igs", ".brep", ".sldprt", ".fcstd", ".3dm"), _CAD),
    **dict.fromkeys((".glb", ".gltf", ".fbx", ".dae", ".3ds", ".usd", ".usdz", ".blend"), _SCENE),
    **dict.fromkeys((".3mf", ".amf"), _PRINT),
    **dict.fromkeys((".msh", ".mesh", ".vtk", ".vtu", ".vtp", ".inp", ".med"), _SIMULATION),
}
"""Suffixes of other kinds of mesh files, what they are, and how to convert them."""
