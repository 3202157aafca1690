r"""CPLEX-style LP, in the subset that HiGHS, Gurobi, CPLEX, SCIP, Xpress, CBC and GLPK read alike.

    \ comment
    Minimize
     obj_sha256_1a2b3c4d5e6: + 7 ONE_1a2b3c4d5e6   the constant; solutions repeat both names
     + 2 s_00_00_u                     every column, also with cost 0: fixes their order (L16, L31)
     + [
     + 4 d_00_00_u ^2                  twice the coefficient, for the / 2 (L9, L12); no blank after ^ (L34)
     ] / 2
    Subject To
     c14_00_00_u: + 1 s_00_00_u ... >= 0
     c16_00_00_u: + 1 t_00_00_u + [ + 2 beta_00_00 * p1_00_00_u ] >= 0      no / 2 in rows (L10)
    Bounds
     0 <= s_00_00_u <= +inf            both bounds of every column (L17, L22), before the next two (L6)
    Generals / Binaries                never Integers (L5)
    End

The column ONE_... is fixed to 1; it carries the constant (L1, L2) and the stamp of the problem. Each line has
one term, so that no line is long (L30). A model without rows gets the row `c_ONE: + 1 ONE_1a2b3c4d5e6 = 1`
(L27). Numbers are shortest round trip. L-numbers: docs/format-rules.md.
"""

from __future__ import annotations

from collections.abc import Iterator

from ...models.formulations.families import Block, PlacedFamily
from ..writing.canonical import CanonicalForm, coefficient
from ..writing.names import Names
from ..writing.records import Piece, Pieces, bound_texts, render, signed_texts, words


def generate(form: CanonicalForm, header: list[str]) -> Iterator[bytes]:
    """The bytes of the LP file, block by block. header: lines of comment, without the comment sign."""
    problem, names = form.problem, form.names
    for line in header:
        yield f"\\ {line}\n".encode()
    yield f"Minimize\n obj_{problem.stamp}:".encode()
    yield from render([b" ", words(form.constant, signed_texts), b" ", form.one, b"\n"], 1)
    yield from _objective(form)
    yield b"Subject To\n"
    if not problem.rows:
        yield b" c_ONE: + 1 %b = 1\n" % form.one
    for family in problem.rows:
        yield from _rows(family, names)
    yield b"Bounds\n"
    yield b" 1 <= %b <= 1\n" % form.one
    for block in problem.blocks.values():
        yield from _bounds(block, names)
    if form.blocks("integer"):
        yield b"Generals\n"
    for block in form.blocks("integer"):
        yield from render([b" ", names.of(block), b"\n"], block.count)
    if form.blocks("binary"):
        yield b"Binaries\n"
    for block in form.blocks("binary"):
        yield from render([b" ", names.of(block), b"\n"], block.count)
    yield b"End\n"


def _objective(form: CanonicalForm) -> Iterator[bytes]:
    names = form.names
    for block in form.problem.blocks.values():
        cost = words(form.costs[block.slice], signed_texts)
        yield from render([b" ", cost, b" ", names.of(block), b"\n"], block.count)
    index, factor = form.products()
    if not len(factor):
        return
    square = index[:, 0] == index[:, 1]
    yield b" + [\n"
    for which in (square, ~square):
        pair = index[which]
        value = words(2 * factor[which], signed_texts)
        tail: Pieces = [b" ^2\n"] if which is square else [b" * ", names.all.at(pair[:, 1]), b"\n"]
        yield from render([b" ", value, b" ", names.all.at(pair[:, 0]), *tail], len(pair))
    yield b" ] / 2\n"


def _rows(family: PlacedFamily, names: Names) -> Iterator[bytes]:
    parts: list[Piece] = [b" ", names.row(family), b":"]
    for term in family.of_degree(1):
        parts += [
            b" ",
            words(coefficient(term), signed_texts),
            b" ",
            names.at(family, term.symbols[0]),
        ]
    products = family.of_degree(2)
    if products:
        parts.append(b" + [")
        for term in products:
            parts += [
                b" ",
                words(coefficient(term), signed_texts),
                b" ",
                names.at(family, term.symbols[0]),
                b" * ",
                names.at(family, term.symbols[1]),
            ]
        parts.append(b" ]")
    sense = b" = " if family.family.sense == "==" else f" {family.family.sense} ".encode()
    parts += [sense, words(family.limit), b"\n"]
    yield from render(parts, family.count)


def _bounds(block: Block, names: Names) -> Iterator[bytes]:
    lower, upper = (words(end, bound_texts) for end in (block.lower, block.upper))
    yield from render([b" ", lower, b" <= ", names.of(block), b" <= ", upper, b"\n"], block.count)
