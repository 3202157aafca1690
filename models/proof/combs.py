"""The least costs on spanning trees of the grid with one label fixed, which exclude more labels than a pass.

After a forward pass, the cost of any labels exceeds the bound by at least their excesses: D + shares less the
least of each pixel, and c - shares of each pair. On a tree, the least sum of these with one label fixed
follows from messages along its pairs. A comb is such a tree: a row of pixels is its spine, and the columns
that cross it are its teeth; or a column is its spine, and rows are its teeth.

models/proof/check_certificate.py, 3, proves that cells are excluded rightly.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.grid import Floats
from ..processes.compiled import Crew, compiled
from .products import add, all_taken, copy, product, share_of
from .state import Indices, State

_COLUMN: Final = (0, 2)  # of `State.around`: the neighbours before and after a pixel in its column
_ROW: Final = (1, 3)


class Combs:
    """The least excess of each label of a strip on a comb, flat, computed in two turns.

    After `turn(first=True)` and `follow`, it is the least excess on the teeth; after `turn(first=False)` and
    `follow`, that on the whole comb. Numbers at labels that are not allowed have no meaning.
    """

    def __init__(self, state: State, own: slice, crew: Crew) -> None:
        """Find the excesses of single pixels after a forward pass. own: the pixels of the strip."""
        self._state, self._own, self._crew = state, own, crew
        self._single, parts = np.zeros(len(state.unary)), crew.equal_parts(own.stop - own.start)
        crew.run(
            lambda part: _fill_excesses(own.start + part.start, own.start + part.stop, state, self._single),
            parts,
        )
        self.excesses = self._given = self._single

    def turn(self, *, first: bool) -> None:
        """Start to follow pairs of another direction; first: of a new comb."""
        self._given = self._single if first else self.excesses
        self.excesses = self._given.copy()

    def follow(self, edge: Floats, *, column: bool, back: bool) -> Floats:
        """Add the least excess of the pixels before each pixel in its column or row; back: of those after it.

        edge: the result for the strip before this one, empty for the first. Returns the excesses at the last
        own pixels of columns that continue in the next strip, flat.
        """
        before, after = (_COLUMN if column else _ROW)[:: -1 if back else 1]
        (first, sources), (last, targets) = self._ends(before), self._ends(after)
        carried = np.zeros(len(self._state.unary))
        carried[self._labels(sources[sources >= 0])] = edge
        own, arrays = (self._own.start, self._own.stop), (self._given, self.excesses, carried)
        self._crew.run(lambda i: _follow(i, (before, after), own, self._state, arrays), first.tolist())
        return carried[self._labels(last[targets >= 0])]

    def _ends(self, place: int) -> tuple[Indices, Indices]:
        """The pixels without an own neighbour at a place of `State.around`, and these neighbours or -1."""
        own, state = np.arange(self._own.start, self._own.stop), self._state
        pairs, others = state.around[self._own, place], np.full(len(own), -1)
        some = pairs >= 0
        others[some] = (state.first + state.second)[pairs[some]] - own[some]
        outer = (others < self._own.start) | (others >= self._own.stop)
        return own[outer], others[outer]

    def _labels(self, pixels: Indices) -> Indices:
        """The places of the labels of some pixels."""
        start = self._state.start
        return np.concatenate([np.zeros(0, np.int64), *(np.arange(start[i], start[i + 1]) for i in pixels)])


@compiled
def _fill_excesses(begin: int, end: int, state: State, found: Floats) -> None:
    """Fill in D + shares less the least, at the labels of some pixels."""
    for i in range(begin, end):
        theta = all_taken(i, state)
        least = theta.min()
        for x in range(theta.size):
            found[state.start[i] + x] = theta[x] - least


@compiled
def _follow(
    i: int,
    way: tuple[int, int],
    own: tuple[int, int],
    state: State,
    arrays: tuple[Floats, Floats, Floats],
) -> None:
    """Add to the labels of the own pixels of a column or row, which begins at pixel i, those before each.

    way: the places before and after a pixel in `State.around`. arrays: the excesses without and with those
    before, and those carried from and to pixels at the ends of the strip.
    """
    given, found, edge = arrays
    begin, end = state.start[i], state.start[i + 1]
    carried = given[begin:end].copy()
    pair = state.around[i, way[0]]
    if pair >= 0:
        k = state.first[pair] + state.second[pair] - i
        message = _message(pair, k, edge[state.start[k] : state.start[k + 1]], state)
        add(found[begin:end], message)
        add(carried, message)
    while state.around[i, way[1]] >= 0:
        pair = state.around[i, way[1]]
        j = state.first[pair] + state.second[pair] - i
        if not own[0] <= j < own[1]:
            copy(carried, edge[state.start[i] : state.start[i + 1]])
            break
        carried = _message(pair, i, carried, state)
        add(found[state.start[j] : state.start[j + 1]], carried)
        add(carried, given[state.start[j] : state.start[j + 1]])
        i = j


@compiled
def _message(pair: int, i: int, carried: Floats, state: State) -> Floats:
    """The least of the carried excess at end i plus c - shares of a pair, at labels of its other end."""
    j = state.first[pair] + state.second[pair] - i
    share, other = share_of(pair, i, state), share_of(pair, j, state)
    kept, found = share.copy(), other.copy()
    _subtract(share, carried)
    product(pair, j, state, found)
    copy(kept, share)
    _subtract(found, other)
    return found


@compiled
def _subtract(target: Floats, values: Floats) -> None:
    """Subtract the values from the target."""
    for x in range(target.size):
        target[x] -= values[x]
