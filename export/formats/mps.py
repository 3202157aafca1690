"""Free MPS, in the subset that HiGHS, Gurobi, CPLEX, SCIP, Xpress, CBC and GLPK read alike.

    NAME ring_sha256_1a2b3c4d5e6 FREE    repeated in solutions; FREE is for CBC (M20)
    ROWS                               one N row, always minimised, no OBJSENSE (M5, M6)
    COLUMNS                            ` column row value`, one pair per line; `obj 0` without a cost (M19);
        MARKER 'MARKER' 'INTORG'       one block of markers round each run of integer columns
    RHS                                set name RHS1; no entry for the objective (M4), no RANGES (M11)
    BOUNDS                             set name BND1; both bounds of every column (M1-M3): FX, FR, LO + UP,
                                       LO + PL, MI then UP
    QUADOBJ                            one triangle of the Hessian: x'Qx/2 (M13)
    QCMATRIX row                       both triangles, without one-half (M16), after BOUNDS (M17)
    ENDATA

The last column is fixed to 1. Its name carries the stamp, `ONE_1a2b3c4d5e6`, and its cost is the constant.
M-numbers: docs/format-rules.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...models.formulations.families import Block, PlacedFamily
from ...models.formulations.problem import Problem
from ...models.instance.domain import Ints
from ..writing.canonical import BlockBounds, CanonicalForm, coefficient
from ..writing.names import OBJECTIVE, Names, problem_name
from ..writing.records import (
    Piece,
    Words,
    bytes_of_texts,
    number_text,
    render,
    words,
)

_ROW_TYPES = {">=": b"G", "<=": b"L", "==": b"E"}
_COLUMNS: Final = 1 << 17  # of a block whose entries are held at once


def generate(form: CanonicalForm, header: list[str]) -> Iterator[bytes]:
    """The bytes of the MPS file, block by block. header: lines of comment, without the comment sign."""
    problem, names = form.problem, form.names
    for line in header:
        yield f"* {line}\n".encode()
    yield f"NAME {problem_name(problem)} FREE\nROWS\n N obj\n".encode()
    if not problem.rows:
        yield b" E c_ONE\n"
    for family in problem.rows:
        head = b" " + _ROW_TYPES[family.family.sense] + b" "
        yield from render([head, names.row(family), b"\n"], family.count)
    yield b"COLUMNS\n"
    yield from _columns(form)
    yield b"RHS\n"
    yield from _right_sides(problem, names)
    yield b"BOUNDS\n"
    for block in problem.blocks.values():
        for bounds in form.bounds(block):
            yield from _bounds(bounds)
    yield b" FX BND1 %b 1\n" % form.one
    yield from _objective_matrix(form)
    for family in problem.rows:
        yield from _row_matrices(family, names)
    yield b"ENDATA\n"


def _columns(form: CanonicalForm) -> Iterator[bytes]:
    """Matrix entries column by column, its cost first, then by row."""
    problem, markers = form.problem, 0
    for integer, blocks in _integrality_runs(problem):
        if integer:
            yield f" MARKER{markers} 'MARKER' 'INTORG'\n".encode()
        for block in blocks:
            yield from _entries(form, block)
        if integer:
            yield f" MARKER{markers + 1} 'MARKER' 'INTEND'\n".encode()
            markers += 2
    yield b" %b obj %b\n" % (form.one, number_text(form.constant).encode())
    if not problem.rows:
        yield b" %b c_ONE 1\n" % form.one


def _entries(form: CanonicalForm, block: Block) -> Iterator[bytes]:
    """Costs and matrix entries of a block of columns, a part of the block at a time to limit memory."""
    costs, name, (places, _) = form.costs[block.slice], form.names.of(block), form.names.places
    row_tags = (family.family.tag.encode() for family in form.problem.rows)
    tags = bytes_of_texts(np.array([OBJECTIVE, *row_tags]))
    for part in np.array_split(np.arange(block.count, dtype=np.int32), 1 + block.count // _COLUMNS):
        zeros = np.zeros(len(part), dtype=np.int32)
        of_costs = part, zeros, zeros.astype(np.uint16), zeros, costs[part]
        entries = zip(of_costs, *_row_entries(form, block, part), strict=True)
        column, row, tag, place, value = map(np.concatenate, entries)
        order = np.lexsort((row, column))
        label: list[Piece] = [Words(tags, tag[order]), places.at(place[order])]
        number = words(value)
        number = number if isinstance(number, bytes) else number.at(order)
        yield from render([b" ", name.at(column[order]), b" ", *label, b" ", number, b"\n"], len(order))


def _row_entries(form: CanonicalForm, block: Block, part: Ints) -> Iterator[tuple[NDArray[Any], ...]]:
    """The entries of a part of a block in rows, one linear term after the other.

    Yields arrays: the column in its block, the number of the row (from 1; the objective is row 0), the number
    of the tag of its name and of what follows the tag, and the coefficient.
    """
    first, (_, begins) = 1, form.names.places
    for tag, family in enumerate(form.problem.rows, 1):
        for term in family.of_degree(1):
            if family.block(term.symbols[0]).name == block.name:
                inside = family.inside(term.symbols[0])
                at = part if inside is None else _within(inside, part)
                column = at if inside is None else inside[at]
                place = at if family.covers_index_set else family.elements[at]
                value = np.broadcast_to(coefficient(term), (family.count,))[at]
                yield (
                    column,
                    at + np.int32(first),
                    np.full(len(at), tag, dtype=np.uint16),
                    place + np.int32(begins[family.family.over]),
                    value,
                )
        first += family.count


def _within(inside: Ints, part: Ints) -> Ints:
    """The elements of a family whose columns are in a part of a block."""
    return np.flatnonzero((inside >= part[0]) & (inside <= part[-1])).astype(np.int32)


def _integrality_runs(problem: Problem) -> list[tuple[bool, list[Block]]]:
    """Runs of consecutive blocks that are all integer or all not; empty blocks are left out."""
    runs: list[tuple[bool, list[Block]]] = []
    for block in filter(lambda block: block.count, problem.blocks.values()):
        if not runs or runs[-1][0] != block.integer:
            runs.append((block.integer, []))
        runs[-1][1].append(block)
    return runs


def _right_sides(problem: Problem, names: Names) -> Iterator[bytes]:
    if not problem.rows:
        yield b" RHS1 c_ONE 1\n"
    for family in problem.rows:
        at = np.nonzero(family.limit)[0]
        value = words(family.limit[at])
        yield from render([b" RHS1 ", names.row(family).at(at), b" ", value, b"\n"], len(at))


_ENDS: Final = {
    "fixed": (b"FX",),
    "boxed": (b"LO", b"UP"),
    "lower": (b"LO", b"PL"),
    "upper": (b"MI", b"UP"),
    "free": (b"FR",),
}
"""Keywords of the lines of a column, by the kind of its bounds."""


def _bounds(bounds: BlockBounds) -> Iterator[bytes]:
    """One record per column, with two lines where both ends are named."""
    numbers = {b"FX": bounds.lower, b"LO": bounds.lower, b"UP": bounds.upper}
    parts: list[Piece] = []
    for keyword in _ENDS[bounds.kind]:
        value = [b" ", words(numbers[keyword])] if keyword in numbers else []
        parts += [b" " + keyword + b" BND1 ", bounds.names, *value, b"\n"]
    yield from render(parts, len(bounds.lower))


def _objective_matrix(form: CanonicalForm) -> Iterator[bytes]:
    names, (index, factor) = form.names, form.products()
    if not len(factor):
        return
    hessian = np.where(index[:, 0] == index[:, 1], 2 * factor, factor)
    one, two = (names.all.at(column) for column in index.T)
    yield b"QUADOBJ\n"
    yield from render([b" ", one, b" ", two, b" ", words(hessian), b"\n"], len(index))


def _row_matrices(family: PlacedFamily, names: Names) -> Iterator[bytes]:
    products = family.of_degree(2)
    if not products:
        return
    parts: list[Piece] = [b"QCMATRIX ", names.row(family), b"\n"]
    for term in products:
        first, second = (names.at(family, symbol) for symbol in term.symbols)
        half = words(np.asarray(coefficient(term)) / 2)
        parts += [b" ", first, b" ", second, b" ", half, b"\n"]
        parts += [b" ", second, b" ", first, b" ", half, b"\n"]
    yield from render(parts, family.count)
