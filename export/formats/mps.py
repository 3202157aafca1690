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
from typing import Final

import numpy as np

from ...models.formulations.families import Block, Monomial, PlacedFamily
from ...models.formulations.names import row_names, stack_names
from ...models.formulations.problem import Problem
from ...models.instance.domain import Ints
from ..writing.canonical import BlockBounds, CanonicalForm, coefficient
from ..writing.names import OBJECTIVE, Names, problem_name
from ..writing.records import (
    OptionalPieces,
    Piece,
    TaggedWords,
    Words,
    check_coefficients,
    number_text,
    render,
    words,
)

_ROW_TYPES = {">=": b"G", "<=": b"L", "==": b"E"}


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
    """Matrix entries column by column; a record is a column: its cost first, then by row."""
    problem, names = form.problem, form.names
    rows = {family.family.tag: names.row(family) for family in problem.rows}
    markers = 0
    for integer, blocks in _integrality_runs(problem):
        if integer:
            yield f" MARKER{markers} 'MARKER' 'INTORG'\n".encode()
        for block in blocks:
            if any(family.family.steps for family in problem.rows):
                yield from _single_entries(form, block)
                continue
            name, cost = names.of(block), words(form.costs[block.slice])
            entries = [
                entry
                for family in problem.rows
                for entry in _entries(family, block, name, rows[family.family.tag])
            ]
            yield from render([b" ", name, b" obj ", cost, b"\n", *entries], block.count)
        if integer:
            yield f" MARKER{markers + 1} 'MARKER' 'INTEND'\n".encode()
            markers += 2
    yield b" %b obj %b\n" % (form.one, number_text(form.constant).encode())
    if not problem.rows:
        yield b" %b c_ONE 1\n" % form.one


def _single_entries(form: CanonicalForm, block: Block) -> Iterator[bytes]:
    """Matrix entries of a block whose columns may stand in any number of rows; a record is an entry."""
    from ...models.formulations.arrays import row_terms  # it loads SciPy, as cycles do

    rows, (at, value) = form.problem.rows, row_terms(form.problem.rows, 1)
    check_coefficients(value, "a row of cycles")
    mine = (at[:, 1] >= block.offset) & (at[:, 1] < block.offset + block.count)
    column = np.concatenate([np.arange(block.count), at[mine, 1] - block.offset])
    row = np.concatenate([np.zeros(block.count, dtype=np.int64), at[mine, 0] + 1])  # costs first
    order = np.lexsort((row, column))
    names = Words(stack_names([np.array([list(OBJECTIVE)], dtype=np.uint8), row_names(rows)]), row[order])
    values = words(np.concatenate([form.costs[block.slice], value[mine]])[order])
    parts: list[Piece] = [b" ", form.names.of(block).at(column[order]), b" ", names, b" ", values, b"\n"]
    yield from render(parts, len(order))


def _entries(
    family: PlacedFamily, block: Block, name: TaggedWords, rows: TaggedWords
) -> Iterator[Piece | OptionalPieces]:
    """The lines of a column of a block for the rows of a family, in the order of rows."""
    terms = [term for term in family.of_degree(1) if family.block(term.symbols[0]).name == block.name]
    lines = [line for term in terms for line in _incident_rows(family, term)]
    for _, row, term in sorted(lines, key=lambda line: line[0]):
        value = words(coefficient(term))
        if row is None:
            yield from (b" ", name, b" ", rows, b" ", value, b"\n")
        else:
            at_row = value if isinstance(value, bytes) else value.at(row)
            yield OptionalPieces(row >= 0, [b" ", name, b" ", rows.at(row), b" ", at_row, b"\n"])


def _incident_rows(family: PlacedFamily, term: Monomial) -> list[tuple[int, Ints | None, Monomial]]:
    """Rows of a family that contain a column of the term's block: (rank, row of each column or -1, term).

    None where row and column have the same number.
    """
    instance, kind = family.instance, family.family.slots[term.symbols[0]][1]
    if kind == "itself":
        row = (
            None
            if family.covers_index_set
            else _inverse_index(family.elements, family.block(term.symbols[0]).count)
        )
        return [(0, row, term)]
    assert family.covers_index_set  # families on a part of the pairs have terms of only those pairs
    if kind == "stroke":
        return [(0, _inverse_index(instance.stroke_index, instance.domain.size), term)]
    tables = enumerate(instance.domain.pairs_of_points)
    return [(rank, row, term) for rank, (end, row) in tables if end == kind]


def _inverse_index(index: Ints, count: int) -> Ints:
    """Place in `index` of each number below `count`, -1 if it is missing."""
    place = np.full(count, -1, dtype=np.int32)
    place[index] = np.arange(len(index), dtype=np.int32)
    return place


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
