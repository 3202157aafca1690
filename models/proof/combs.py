"""Min-marginals on trees of the grid, combs, which exclude more labels than those of a pass.

After a forward pass, the cost of any labels exceeds the bound by at least their excesses, the reparametrised
costs: D + shares less the least of each pixel, and c - shares of each pair. On a tree, the least sum of these
with one label fixed follows from messages along its pairs. A comb is such a tree: a row of pixels is its
spine, and the columns that cross it are its teeth; or a column is its spine, and rows are its teeth.

Lemma 3a of docs/proofs.md proves that cells are excluded rightly.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from ..instance.domain import Floats
from ..processes.compilation import Crew, compiled
from .passes import add_to, copy_to, fill_product, reparametrised_costs, shares_at
from .state import State

_COLUMN: Final = (0, 2)  # of `State.around`: the neighbours before and after a pixel in its column
_ROW: Final = (1, 3)


def comb_excesses(state: State, crew: Crew) -> Iterator[Floats]:
    """The least excess of each label on its combs, flat: first that with a row as its spine.

    Before: a forward pass. Numbers at labels that are not allowed have no meaning.
    """
    single = np.zeros(len(state.unary))
    crew.run(
        lambda part: _fill_excesses(part.start, part.stop, state, single), crew.equal_parts(len(state.least))
    )
    for teeth, spine in ((_COLUMN, _ROW), (_ROW, _COLUMN)):
        yield _along(spine, _along(teeth, single, state, crew), state, crew)


def _along(line: tuple[int, int], excesses: Floats, state: State, crew: Crew) -> Floats:
    """The excesses with the least ones of the pixels before and after each pixel in its column or row."""
    sums = excesses.copy()
    for before, after in (line, line[::-1]):
        first = np.flatnonzero(state.around[:, before] < 0)
        crew.run(lambda i: _follow(i, after, state, excesses, sums), first.tolist())  # noqa: B023
    return sums


@compiled
def _fill_excesses(begin: int, end: int, state: State, excesses: Floats) -> None:
    """Fill in D + shares less the least, at the labels of some pixels."""
    for i in range(begin, end):
        theta = reparametrised_costs(i, state)
        least = theta.min()
        for x in range(theta.size):
            excesses[state.start[i] + x] = theta[x] - least


@compiled
def _follow(i: int, after: int, state: State, excesses: Floats, sums: Floats) -> None:
    """Add to the labels of a column or row, which begins at pixel i, the least excesses before each pixel.

    after: the place of the next pixel in `State.around`.
    """
    carried = excesses[state.start[i] : state.start[i + 1]].copy()
    while state.around[i, after] >= 0:
        pair = state.around[i, after]
        j = state.first[pair] + state.second[pair] - i
        carried = _message(pair, i, carried, state)
        add_to(sums[state.start[j] : state.start[j + 1]], carried)
        add_to(carried, excesses[state.start[j] : state.start[j + 1]])
        i = j


@compiled
def _message(pair: int, i: int, carried: Floats, state: State) -> Floats:
    """The least of the carried excess at end i plus c - shares of a pair, at labels of its share_j end."""
    j = state.first[pair] + state.second[pair] - i
    share_i, share_j = shares_at(pair, i, state), shares_at(pair, j, state)
    before, message = share_i.copy(), share_j.copy()
    _subtract(share_i, carried)
    fill_product(pair, j, state, message)
    copy_to(before, share_i)
    _subtract(message, share_j)
    return message


@compiled
def _subtract(target: Floats, values: Floats) -> None:
    """Subtract the values from the target."""
    for x in range(target.size):
        target[x] -= values[x]
