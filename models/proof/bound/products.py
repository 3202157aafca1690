"""Bounds from products of two particles: docs/orthogonal-proofs.md, Lemma 12.

The numbers are those of a semidefinite program, by the alternating direction method of multipliers on its
products (Oliveira, Wolkowicz and Xu 2018), and by primal-dual steps (Pock and Chambolle 2011) for triangle
inequalities, which are added where products violate them. The checker computes all bounds anew, so nothing
here has to be exact.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from scipy.sparse import csr_array

from ...array_archive import Arrays
from ...instance.domain import Floats, Ints
from ..checkers.check_orthogonal import (
    MOST_STAGES,
    PRODUCTS,
    Charges,
    Clouds,
    Products,
    dual_of,
    triangle_terms,
)

_MOST_UNITS: Final = 500  # particles: an iteration with more takes a quarter of a second
_MOST_LOOPS: Final = 1500  # the same for the matrices of loops, which take two seconds
_EVERY: Final = 50  # iterations between looks at the bound
_NEW: Final = 4  # of these, between looks for violated inequalities
_SLOW: Final = 0.97  # part of what the bound lacked so many looks before: more of them are not worth it
_PENALTY: Final = 1.0  # of the mean of the matrix
_INERTIA: Final = 0.5  # of products next to the penalty, for each inequality; the same for their multipliers
_HALVINGS: Final = 50
_OTHERS: Final = 0.1  # of particles of the sign that is not in excess: a first share
_VIOLATED: Final = 1e-3
_AT_ONCE: Final = 30  # inequalities for each particle, at most, that a look adds
_FEWER: Final = 0.8  # of the particles left: a new program
_FEW: Final = 12  # particles that branches divide faster


def products_arrays(
    charges: Charges,
    clouds: Clouds,
    count: Ints,
    best: Floats,
    *,
    threshold: float,
    is_over: Callable[[float], bool],
) -> tuple[Arrays, Ints, Floats | None]:
    """The arrays of products in a certificate, how many particles of each kind are left, and charges (l,).

    There are no arrays with too many loops or particles. The charges are those of the likeliest particles,
    in quarter turns: a better field may have them. clouds, count (c,): of the last stage, and how many
    particles of each kind it leaves. best (l,): charges of the best field. threshold: as of `Proof`. is_over:
    whether to end, for the bound so far.
    """
    has = np.round(best + charges.origin).astype(np.int64)
    known = np.maximum(clouds.sign * has[clouds.loop], 0)
    arrays, program, bound = {"products_known": known.astype(np.uint8)}, None, 0.0
    for number in range(MOST_STAGES):
        if not _FEW < count.sum() <= _MOST_UNITS or charges.size > _MOST_LOOPS or is_over(bound):
            break
        program, before = _Program(Products(charges, clouds, count, known), program), count.sum()
        parts, bound, count = program.run(threshold, is_over)
        arrays |= {f"products_{number}_{part}": array for part, array in zip(PRODUCTS, parts, strict=True)}
        arrays["products"] = np.array([number + 1], np.int32)
        if bound >= threshold or count.sum() > _FEWER * before:
            break
    if program is None:
        return {}, count, None
    return arrays, count, program.charges()


class _Program:
    """The least mean energy of random particles, with the means (u + 1, u + 1) of their products.

    The first row and the diagonal have the means of particles. slack: multipliers that make them means of
    random numbers. cuts (k, 4): whether a triangle inequality has a negative weight, as in `Products`, and
    its particles; weight: their multipliers; rows: all of them, flat; over: by how much they fail; taken: the
    sum of all, times their multipliers. apart: the multiplier of `Products.apart`. inertia: how much means
    stay, next to the penalty, and length: of steps of multipliers (Pock and Chambolle 2011).
    """

    rows: csr_array
    over: Floats
    taken: Floats
    inertia: Floats
    length: Floats

    def __init__(self, products: Products, before: _Program | None) -> None:
        self.of, size = products, len(products.matrix)
        self.basis = np.eye(size)
        if products.sum is not None:
            self.basis = np.linalg.qr(np.column_stack([products.sum, self.basis[:, 1:]]))[0][:, 1:]
        self.cuts, self.weight, self.apart = np.zeros((0, 4), np.int64), np.zeros(0), 0.0
        if before:
            self.penalty: float = before.penalty
            self._continue(before)
        else:
            self.penalty = _PENALTY * float(np.linalg.norm(products.matrix)) / size
            due = products.sign * np.sign(products.wanted) > 0
            more = abs(products.wanted) + _OTHERS * (size - 1 - 2 * due.sum())
            first = np.append(1.0, np.clip(_OTHERS + due * more / max(due.sum(), 1), 0.0, 1.0))
            self.means, self.slack = np.outer(first, first), np.zeros((size, size))
        np.fill_diagonal(self.means[1:, 1:], self.means[0, 1:])
        self._add(np.zeros((0, 4), np.int64))

    def _continue(self, before: _Program) -> None:
        """Begin where a program with more particles ended."""
        old, new = ([*zip(p.unit.tolist(), p.number.tolist(), strict=True)] for p in (before.of, self.of))
        place = {key: at for at, key in enumerate(old)}
        kept = np.array([place[key] for key in new])
        here = np.ix_(np.append(0, 1 + kept), np.append(0, 1 + kept))
        self.means, self.slack = before.means[here], before.slack[here]
        now = np.full(len(old), -1)
        now[kept] = np.arange(len(kept))
        cuts = np.column_stack([before.cuts[:, :1], now[before.cuts[:, 1:]]])
        left = (cuts >= 0).all(axis=1)
        self.cuts, self.weight = cuts[left], before.weight[left]

    def run(self, threshold: float, is_over: Callable[[float], bool]) -> tuple[list[Any], float, Ints]:
        """The arrays of the best bound, that bound, and how many particles of each kind it leaves."""
        best, bound, left, lacking = list[Any](), -np.inf, self.of.count, [np.inf]
        while True:
            for _ in range(_EVERY):
                self._iterate()
                if is_over(bound):
                    break
            now, with_each, parts = self._bound()
            if now > bound or not best:
                bound, best = now, parts
                left = np.bincount(self.of.unit, with_each <= threshold, len(self.of.count)).astype(np.int64)
            lacking.append(threshold - bound)
            if left.sum() <= _FEWER * self.of.count.sum() or bound >= threshold or is_over(bound):
                break
            if len(lacking) % _NEW == 0:
                if len(lacking) > 4 * _NEW and lacking[-1] > _SLOW * lacking[-4 * _NEW]:
                    break
                self._add(self._violated())
        return best, bound, left

    def charges(self) -> Floats | None:
        """Charges of the likeliest particles, in quarter turns; None if they have another sum than 0."""
        has = self.means[0, 1:] > 0.5
        if self.of.sum is not None and int(self.of.sign @ has) != self.of.wanted:
            return None
        origin = self.of.charges.origin
        numbers: Floats = np.bincount(self.of.loop, self.of.sign * has, len(origin)) - origin
        return numbers

    def _iterate(self) -> None:
        """One iteration: means of random numbers, means within their limits, and multipliers."""
        around = self.means + self.slack / self.penalty
        numbers, vectors = np.linalg.eigh(self.basis.T @ around @ self.basis)
        vectors = self.basis @ vectors[:, numbers > 0]
        random = (vectors * numbers[numbers > 0]) @ vectors.T
        force = (self.of.matrix + self.slack + self.taken) / self.penalty
        wanted = random + self.inertia * self.means - force
        means = np.clip((wanted + wanted.T) / (2 + 2 * self.inertia), 0.0, 1.0)
        heavy = 3 + np.diag(self.inertia)[1:] + 2 * self.inertia[0, 1:]
        one = (np.diag(wanted)[1:] + wanted[0, 1:] + wanted[1:, 0]) / heavy
        if self.of.apart is not None:
            one, self.apart = _apart(one, self.penalty * heavy, np.diag(self.of.apart))
        means[0, 0], means[0, 1:] = 1.0, np.clip(one, 0.0, 1.0)
        means[1:, 0] = means[0, 1:]
        np.fill_diagonal(means[1:, 1:], means[0, 1:])
        means[1:, 1:][self.of.never] = 0.0
        if len(self.cuts):
            over = self.rows @ means.ravel()
            self.weight = np.maximum(self.weight + self.penalty * self.length * (2 * over - self.over), 0.0)
            self.over = over
            self._take()
        self.means, self.slack = means, self.slack + self.penalty * (means - random)

    def _take(self) -> None:
        """Set the matrix of all inequalities times their multipliers."""
        taken = (self.rows.T @ self.weight).reshape(self.means.shape)
        self.taken = (taken + taken.T) / 2

    def _add(self, cuts: Ints) -> None:
        """Add inequalities, and leave out those that cost nothing."""
        kept = (self.weight > 0) | (self.over > -_VIOLATED) if len(cuts) else self.weight >= 0
        self.cuts, first = np.unique(np.concatenate([self.cuts[kept], cuts]), axis=0, return_index=True)
        self.weight = np.append(self.weight[kept], np.zeros(len(cuts)))[first]
        size, number = len(self.means), np.arange(len(self.cuts))
        places, factors = triangle_terms(size, self.cuts[:, 1:], self.cuts[:, 0] == 1)
        entries = factors.ravel(), (np.tile(number, len(places)), places.ravel())
        self.rows = csr_array(entries, shape=(len(number), size * size))
        uses = np.asarray(abs(self.rows).sum(axis=0)).reshape(size, size)
        self.inertia = _INERTIA * (uses + uses.T) / (2 - np.eye(size))
        self.length = _INERTIA / np.maximum(abs(self.rows).sum(axis=1), 1.0)
        self.over = self.rows @ self.means.ravel()
        self._take()

    def _violated(self) -> Ints:
        """The inequalities that the means violate most."""
        pairs, one, found = self.means[1:, 1:], self.means[0, 1:], []
        units = len(one)
        for a in range(units):
            over = pairs[a][:, None] + pairs[a] - one[a] - pairs
            over[a] = over[:, a] = 0.0
            far = one[a] + one[:, None] + one - pairs[a][:, None] - pairs[a] - pairs - 1
            far[: a + 1] = 0.0
            for kind, amount in enumerate((over, far)):
                b, c = np.nonzero(np.triu(amount, 1) > _VIOLATED)
                found.append(np.column_stack([np.full(len(b), kind), np.full(len(b), a), b, c, amount[b, c]]))
        every = np.concatenate(found)
        order = np.argsort(-every[:, 4], kind="stable")[: _AT_ONCE * units]
        return every[order, :4].astype(np.int64)

    def _bound(self) -> tuple[float, Floats, list[Any]]:
        """Bounds, as of `Products.bound`, and the arrays that prove them."""
        dual = self.of.matrix + self.taken + (self.slack + self.slack.T) / 2
        if self.of.apart is not None:
            dual += self.apart * self.of.apart
        upper = np.triu_indices(len(dual) - 1, 1)
        pairs = dual[1:, 1:][upper]
        pairs = np.where(self.of.never[upper], pairs, np.maximum(pairs, 0.0)).astype(np.float32)
        linear = np.stack([dual[0], np.diag(dual)])
        used, apart = self.weight > 0, np.array([self.apart])
        triples = self.cuts[used, 1:]
        weight = (self.weight[used] * np.where(self.cuts[used, 0] == 1, -1, 1)).astype(np.float32)
        dual = dual_of(linear, pairs.astype(float))
        bound, with_each = self.of.bound(dual, triples, weight.astype(float), self.apart)
        count = self.of.count.astype(np.uint8)
        return bound, with_each, [count, linear, pairs, triples.astype(np.uint16), weight, apart]


def _apart(one: Floats, weight: Floats, apart: Floats) -> tuple[Floats, float]:
    """Numbers near these, if 0 and 1 are their limits, that fulfil `Products.apart`; and its multiplier."""
    low, high = 0.0, 0.0
    while apart[0] + apart[1:] @ np.clip(one - high * apart[1:] / weight, 0.0, 1.0) > 0:
        low, high = high, 2 * high + float(weight.max())
    for _ in range(_HALVINGS if high else 0):
        middle = (low + high) / 2
        over = apart[0] + apart[1:] @ np.clip(one - middle * apart[1:] / weight, 0.0, 1.0) > 0
        low, high = (middle, high) if over else (low, middle)
    return one - high * apart[1:] / weight, high
