"""Names of columns and rows: `alpha_012_034`, `p1_012_034_u`, `c14_012_034_r`; on a mesh `alpha_0123`.

A name consists of the block or row tag, and of the row and the column of the pixel (of a pair: of its first
pixel). A pair adds `u` for the upper or `r` for the right neighbour. On a mesh, the number of the face or of
the pair follows the tag, and so does the number of a cycle on any domain. Numbers are zero-padded to the
width of the largest. Names have at most 15
characters and no leading e, i or n, and they are unique without regard to case (docs/format-rules.md, W6). So
a solver's log can be read, and every solution file maps back without the model.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from ..instance.domain import Ints
from ..instance.instance import Instance
from ..instance.mesh import Mesh
from .symbols import IndexSet, count_elements, point_of

if TYPE_CHECKING:
    from .families import Block, PlacedFamily

Bytes = NDArray[np.uint8]
"""Texts as rows of bytes, padded with NUL on the right."""

_FOUR: Final = np.array([b"%04d" % value for value in range(10_000)]).view(np.uint32)
"""The decimals 0000 to 9999, four bytes each."""


def digits(values: NDArray[Any], width: int) -> Bytes:
    """Decimal digits with leading zeros, shape (len(values), width): four at a time from a table."""
    groups = -(-width // 4)
    out = np.empty((len(values), groups), dtype=np.uint32)
    rest = values
    for place in range(groups - 1, 0, -1):
        high = rest // 10_000
        out[:, place] = _FOUR.take(rest - high * 10_000)
        rest = high
    out[:, 0] = _FOUR.take(rest)
    return out.view(np.uint8)[:, 4 * groups - width :]


def element_names(instance: Instance, tag: str, over: IndexSet) -> Bytes:
    """Names of all elements of an index set, shape (count, width), no padding."""
    place = _numbered if is_numbered(instance, over) else _row_and_column
    parts: dict[str, Any] = {"tag": np.bytes_(f"{tag}_")} | place(instance, over)
    names = np.empty(count_elements(instance, over), [(name, part.dtype) for name, part in parts.items()])
    for name, part in parts.items():
        names[name] = part
    return names.view(np.uint8).reshape(len(names), names.itemsize)


def _row_and_column(instance: Instance, over: IndexSet) -> dict[str, Any]:
    """The parts `row_column[_u|_r]` of names on a grid."""
    grid, at = instance.grid, point_of(instance, over)
    labels = digits(np.arange(grid.side), number_width(instance, over))
    parts: dict[str, Any] = {
        "row": _items(labels)[grid.rows[at]],
        "between": np.bytes_("_"),
        "column": _items(labels)[grid.columns[at]],
    }
    if over == "pairs":
        parts["side"] = np.array([b"_r", b"_u"])[grid.upward.astype(np.intp)]
    return parts


def _numbered(instance: Instance, over: IndexSet) -> dict[str, Any]:
    """The number of the face or pair in names on a mesh, and of a cycle."""
    return {"number": _items(digits(element_numbers(instance, over), number_width(instance, over)))}


def _items(texts: Bytes) -> NDArray[np.void]:
    """Texts as items, which NumPy moves as a whole."""
    return np.ascontiguousarray(texts).view(f"V{texts.shape[1]}")[:, 0]


def name_length(instance: Instance, tag: str, over: IndexSet) -> int:
    """Length of each of these names."""
    width = number_width(instance, over)
    if is_numbered(instance, over):
        return len(tag) + 1 + width
    return len(tag) + 2 * (1 + width) + (2 if over == "pairs" else 0)


def number_width(instance: Instance, over: IndexSet) -> int:
    """Digits of a number in a name: as many as the largest of its kind may have, at least two."""
    domain = instance.domain
    if is_numbered(instance, over):  # cycles are fewer than pairs
        return max(2, len(str(max(len(domain.first), domain.size) - 1)))
    return max(2, len(str(domain.side - 1)))


def element_numbers(instance: Instance, over: IndexSet) -> Ints:
    """The number of each element in names that have one number: of its face, or its own."""
    if over in {"pixels", "strokes"}:
        return point_of(instance, over)
    return np.arange(count_elements(instance, over), dtype=np.int32)


def is_numbered(instance: Instance, over: IndexSet) -> bool:
    """Whether names have one number, not the row and the column of a pixel."""
    return over == "cycles" or isinstance(instance.domain, Mesh)


def stack_names(matrices: list[Bytes]) -> Bytes:
    """Matrices of names below each other, narrower ones padded with NUL on the right."""
    width = max((matrix.shape[1] for matrix in matrices), default=1)
    out = np.zeros((sum(len(matrix) for matrix in matrices), width), dtype=np.uint8)
    start = 0
    for matrix in matrices:
        out[start : start + len(matrix), : matrix.shape[1]] = matrix
        start += len(matrix)
    return out


def column_names(instance: Instance, blocks: dict[str, Block]) -> Bytes:
    """Names of all columns in column order, shape (columns, width), padded with NUL."""
    return stack_names([element_names(instance, block.name, block.over) for block in blocks.values()])


def decode_names(names: Bytes) -> NDArray[np.str_]:
    """Names as text, shape (count,), from rows of bytes padded with NUL."""
    return np.ascontiguousarray(names).view(f"S{names.shape[1]}").ravel().astype(np.str_)


def family_names(family: PlacedFamily) -> Bytes:
    """Names of the rows of a family, shape (count, width), no padding."""
    names = element_names(family.instance, family.family.tag, family.family.over)
    return names if family.covers_index_set else names[family.elements]


def row_names(rows: Iterable[PlacedFamily]) -> Bytes:
    """Names of all rows in row order, shape (rows, width), padded with NUL."""
    return stack_names([family_names(family) for family in rows])
