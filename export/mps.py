"""Free MPS, in the subset that HiGHS, Gurobi, CPLEX, SCIP, Xpress, CBC and GLPK read alike.

    NAME cylinder FREE                 FREE is for CBC (M20)
    ROWS                               one N row, always minimised, no OBJSENSE (M5, M6)
    COLUMNS                            ` column row value`, one pair a line, `obj 0` for columns without cost (M19);
        MARKER 'MARKER' 'INTORG'       one block of markers round each run of integer columns
    RHS                                set name RHS1; no entry for the objective (M4), no RANGES (M11)
    BOUNDS                             set name BND1; both bounds of every column (M1-M3): FX, FR, LO + UP, LO + PL, MI then UP
    QUADOBJ                            one triangle of the Hessian: x'Qx/2 (M13)
    QCMATRIX row                       both triangles, without one-half (M16), after BOUNDS (M17)
    ENDATA

The objective's constant is the cost of a column ONE fixed to 1. M-numbers: the project's notes on formats, section 1.2.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import sparse

from ..models.grid import Bools, Floats
from ..models.problem import Block, Bound, Problem
from .lp import linear_costs, needs_one, scalar_when_constant
from .names import OBJECTIVE, column_names, family_names, row_names, stacked, with_one
from .records import Words, check_coefficients, number, render, table, words

_KIND = {">=": b"G", "<=": b"L", "==": b"E"}


def generate(problem: Problem, header: list[str]) -> Iterator[bytes]:
    """The bytes of the MPS file, block by block. header: lines of comment, without the comment sign."""
    names = Words(with_one(column_names(problem)), None)
    for line in header:
        yield f"* {line}\n".encode()
    yield f"NAME {problem.instance.name} FREE\nROWS\n N obj\n".encode()
    if not problem.rows:
        yield b" E c_ONE\n"
    for family in problem.rows:
        yield from render(
            [b" " + _KIND[family.family.sense] + b" ", Words(family_names(family), None), b"\n"], family.count
        )
    yield b"COLUMNS\n"
    yield from _columns(problem, names)
    yield b"RHS\n"
    yield from _right_sides(problem)
    yield b"BOUNDS\n"
    for block in problem.blocks.values():
        yield from _bounds(block, names)
    if needs_one(problem):
        yield b" FX BND1 ONE 1\n"
    yield from _objective_matrix(problem, names)
    for family in problem.rows:
        yield from _row_matrices(family, names)
    yield b"ENDATA\n"


def _columns(problem: Problem, names: Words) -> Iterator[bytes]:
    """Matrix entries column by column; entry (0, j) is the cost of column j."""
    entries, distinct = _entries(problem)
    rows = Words(
        stacked([table([OBJECTIVE]), row_names(problem)]) if problem.rows else table([OBJECTIVE]), None
    )
    values = table([number(value).encode() for value in distinct.tolist()])
    column = np.repeat(np.arange(problem.columns, dtype=np.int32), np.diff(entries.indptr))
    markers = 0
    for integer, blocks in _runs(problem):
        first, last = entries.indptr[blocks[0].offset], entries.indptr[blocks[-1].columns.stop]
        part = slice(first, last)
        if integer:
            yield f" MARKER{markers} 'MARKER' 'INTORG'\n".encode()
        value = Words(values, entries.data[part] - 1)
        yield from render(
            [b" ", names.at(column[part]), b" ", rows.at(entries.indices[part]), b" ", value, b"\n"],
            last - first,
        )
        if integer:
            yield f" MARKER{markers + 1} 'MARKER' 'INTEND'\n".encode()
            markers += 2
    if needs_one(problem):
        constant = float(problem.merged_objective(0)[1][0])
        yield f" ONE obj {number(constant)}\n".encode()
        if not problem.rows:
            yield b" ONE c_ONE 1\n"


def _entries(problem: Problem) -> tuple[sparse.csc_matrix, Floats]:
    """Costs (row 0) and coefficients as a matrix of codes, 1 + index into the distinct values, which come second."""
    costs = linear_costs(problem)
    row_parts = [np.zeros(problem.columns, dtype=np.int32)]
    column_parts = [np.arange(problem.columns, dtype=np.int32)]
    value_parts: list[Floats] = [costs]
    start = 1
    for family in problem.rows:
        for term in family.of_degree(1):
            check_coefficients(term.coefficient, f"row family {family.family.tag}")
            row_parts.append(np.arange(start, start + family.count, dtype=np.int32))
            column_parts.append(term.factors[0])
            value_parts.append(
                np.broadcast_to(np.asarray(term.coefficient, dtype=np.float64), (family.count,))
            )
        start += family.count
    distinct, codes = np.unique(np.concatenate(value_parts) + 0.0, return_inverse=True)
    triplets = (codes.astype(np.int32) + 1, (np.concatenate(row_parts), np.concatenate(column_parts)))
    return sparse.coo_matrix(triplets, shape=(start, problem.columns)).tocsc(), distinct


def _runs(problem: Problem) -> list[tuple[bool, list[Block]]]:
    """Blocks that follow each other and are alike integer or not; empty blocks are left out."""
    runs: list[tuple[bool, list[Block]]] = []
    for block in filter(lambda block: block.count, problem.blocks.values()):
        if not runs or runs[-1][0] != block.integer:
            runs.append((block.integer, []))
        runs[-1][1].append(block)
    return runs


def _right_sides(problem: Problem) -> Iterator[bytes]:
    if not problem.rows:
        yield b" RHS1 c_ONE 1\n"
    for family in problem.rows:
        at = np.nonzero(family.limit)[0]
        value = words(scalar_when_constant(family.limit[at]))
        yield from render([b" RHS1 ", Words(family_names(family), None).at(at), b" ", value, b"\n"], len(at))


def _bounds(block: Block, names: Words) -> Iterator[bytes]:
    """Bounds kind by kind; within a kind one record a column, two lines where both ends are named."""
    low, high = np.isfinite(block.lower), np.isfinite(block.upper)
    fixed = block.lower == block.upper
    kinds: list[tuple[Bools, bytes, bytes]] = [
        (fixed, b"FX", b""),
        (low & high & ~fixed, b"LO", b"UP"),
        (low & ~high, b"LO", b"PL"),
        (~low & high, b"MI", b"UP"),
        (~low & ~high, b"FR", b""),
    ]
    for chosen, first, second in kinds:
        at = np.nonzero(chosen)[0]
        name = names.at(block.offset + at)
        parts: list[bytes | Words] = []
        for kind in filter(None, (first, second)):
            value = {b"FX": block.lower, b"LO": block.lower, b"UP": block.upper}.get(kind)
            parts += [b" " + kind + b" BND1 ", name]
            if value is not None and len(at):
                parts += [b" ", words(scalar_when_constant(value[at]))]
            parts.append(b"\n")
        yield from render(parts, len(at))


def _objective_matrix(problem: Problem, names: Words) -> Iterator[bytes]:
    index, coefficient = problem.merged_objective(2)
    if not len(coefficient):
        return
    check_coefficients(coefficient, "the objective")
    hessian = np.where(index[:, 0] == index[:, 1], 2 * coefficient, coefficient)
    yield b"QUADOBJ\n"
    yield from render(
        [b" ", names.at(index[:, 0]), b" ", names.at(index[:, 1]), b" ", words(hessian), b"\n"], len(index)
    )


def _row_matrices(family: Bound, names: Words) -> Iterator[bytes]:
    products = family.of_degree(2)
    if not products:
        return
    parts: list[bytes | Words] = [b"QCMATRIX ", Words(family_names(family), None), b"\n"]
    for term in products:
        check_coefficients(term.coefficient, f"row family {family.family.tag}")
        first, second = (names.at(factor) for factor in term.factors)
        half = words(np.asarray(term.coefficient) / 2)
        parts += [b" ", first, b" ", second, b" ", half, b"\n", b" ", second, b" ", first, b" ", half, b"\n"]
    yield from render(parts, family.count)
