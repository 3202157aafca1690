"""A slow prover for some pixels, every cost in a dense table: certificates that no compiled code has made."""

import itertools

import numpy as np
from crossfield.models.instance.angles import HALF, QUARTER
from crossfield.models.proof.clusters import zero_clusters
from crossfield.models.proof.encoding import share_arrays, table_arrays
from crossfield.models.proof.lattice import Lattice
from crossfield.models.proof.record import LevelRecord, Proof

QUANTUM = 2.0**-24


class Table:
    """A level: labels of each pixel, their costs, and the shares of the pairs."""

    def __init__(self, field, h, labels=None):
        instance = field.instance
        grid = instance.grid
        self.field, self.h, self.offset = field, h, 0.5 * ((grid.rows + grid.columns) % 2)
        self.labels = (
            [whole(field, h, i, self.offset[i]) for i in range(grid.size)] if labels is None else labels
        )
        self.unary = [self.costs(i).ravel() for i in range(grid.size)]
        self.pairs = [self.pair(e) for e in range(len(grid.first))]
        self.shares = [[np.zeros(size) for size in table.shape] for table in self.pairs]
        self.at = [[] for _ in range(grid.size)]
        for e, (i, j) in enumerate(zip(grid.first.tolist(), grid.second.tolist(), strict=True)):
            self.at[i].append((e, 0, j))
            self.at[j].append((e, 1, i))

    def places(self, i):
        k, q, _ = self.labels[i]
        return (
            self.field.alpha[i] + self.h * (k + self.offset[i]),
            self.field.beta[i] + self.h * (q + self.offset[i]),
        )

    def costs(self, i):
        instance, h = self.field.instance, self.h
        k, q, allowed = self.labels[i]
        alpha, beta = np.meshgrid(*self.places(i), indexing="ij")
        cost = instance.skew_coefficient * (beta**2 - h * h / 4)
        for at, theta, w in zip(instance.stroke_index, instance.target, instance.w, strict=True):
            if at != i:
                continue
            own = round((self.field.alpha[i] + self.field.beta[i] - theta) / np.pi)
            steps = np.abs(k[:, None] + q + 2 * self.offset[i])
            lost = np.where(steps < 2, steps, 0.5)
            best = (alpha + beta - theta - np.pi * own) ** 2 - lost * h * h
            for turn in range(-4, 5):
                if turn != own:
                    best = np.minimum(best, (alpha + beta - theta - np.pi * turn) ** 2 - h * h / 2)
                best = np.minimum(best, (alpha + HALF - beta - theta - np.pi * turn) ** 2 - h * h / 2)
            cost = cost + instance.stroke_coefficient * w * best
        return np.where(allowed, cost, np.inf)

    def pair(self, e):
        grid = self.field.instance.grid
        (ai, bi), (aj, bj) = (
            [x.ravel() for x in np.meshgrid(*self.places(int(i)), indexing="ij")]
            for i in (grid.first[e], grid.second[e])
        )
        best = np.full((len(ai), len(aj)), np.inf)
        for p in range(-7, 8):
            a = ai[:, None] - aj + HALF * p
            b = (-1) ** p * bi[:, None] - bj
            best = np.minimum(best, 2 * (a * a + b * b))
        return best - self.h**2

    def theta(self, i):
        return self.unary[i] + sum((self.shares[e][side] for e, side, _ in self.at[i]), np.zeros(()))

    def visit(self, i, forwards):
        """Take from pairs to earlier pixels, give to those to later ones; theta with least value 0."""
        before = [x for x in self.at[i] if (x[2] < i) == forwards]
        after = [x for x in self.at[i] if (x[2] < i) != forwards]
        for e, side, j in before:
            self.shares[e][side] = self.most(e, side, j)
        theta = self.theta(i)
        theta = theta - theta.min()
        for e, side, _ in after:
            handed = theta / max(len(before), len(after))
            self.shares[e][side] = self.shares[e][side] - np.where(np.isfinite(handed), handed, 0.0)
        return theta

    def most(self, e, side, other):
        """The largest share of a pair at one end, given its shares at the other."""
        left = self.pairs[e] if side == 0 else self.pairs[e].T
        taken = np.where(np.isfinite(self.unary[other]), self.shares[e][1 - side], -np.inf)
        return (left - taken).min(axis=1)

    def bound(self):
        total = sum(float(self.theta(i).min()) for i in range(len(self.unary)))
        for e, (i, j) in enumerate(
            zip(self.field.instance.grid.first, self.field.instance.grid.second, strict=True)
        ):
            left = self.pairs[e] - self.shares[e][0][:, None] - self.shares[e][1]
            total += left[np.isfinite(self.unary[i])][:, np.isfinite(self.unary[j])].min()
        return total

    def quantise(self):
        for e, (i, j) in enumerate(
            zip(self.field.instance.grid.first, self.field.instance.grid.second, strict=True)
        ):
            for side, pixel in enumerate((i, j)):
                share = np.round(self.shares[e][side] / QUANTUM) * QUANTUM
                self.shares[e][side] = np.where(np.isfinite(self.unary[pixel]), share, 0.0)

    def finer(self, bound, energy):
        """The labels of half the spacing round what is left below an energy; a forward pass is made."""
        self.alive = [self.visit(i, True) <= energy + 1e-7 - bound for i in range(len(self.unary))]
        return [halved(*self.labels[i], self.offset[i], alive) for i, alive in enumerate(self.alive)]

    def record(self, bound, energy):
        labels = self.labels
        first, second = ([share[side] for share in self.shares] for side in (0, 1))
        lattice = Lattice(
            self.field.instance,
            self.h,
            self.field.alpha,
            self.field.beta,
            self.field.p,
            *(np.array(x) for x in zip(*((k[0], len(k), q[0], len(q)) for k, q, _ in labels), strict=True)),
            np.concatenate([allowed.ravel() for *_, allowed in labels]),
        )
        shares = [np.concatenate([*each, []]) for each in (first, second)]
        clusters = zero_clusters(lattice, np.zeros(0, int))
        messages = share_arrays(lattice, shares, QUANTUM)
        arrays = messages, table_arrays(lattice, clusters, QUANTUM)
        return LevelRecord.on_lattice(lattice, arrays, bound=bound, energy=energy)


def whole(field, h, i, offset):
    """All labels of a pixel."""
    half = round(QUARTER / h)
    low, high = (np.array([-QUARTER, QUARTER]) - field.beta[i]) / h - offset
    k, q = np.arange(-half, half + 1), np.arange(np.floor(low), np.ceil(high) + 1).astype(int)
    return k, q, np.ones((len(k), len(q)), bool)


def halved(k, q, allowed, offset, alive):
    """Labels of half the spacing on what is left."""
    alive = alive.reshape(allowed.shape)
    corners = [
        (slice(a, a - 1 or None), slice(b, b - 1 or None)) for a, b in itertools.product((0, 1), (0, 1))
    ]
    cells = np.all([allowed[x] for x in corners], axis=0) & np.any([alive[x] for x in corners], axis=0)
    rows, columns = np.nonzero(cells)
    extra = int(offset > 0)
    wide = {
        (2 * k[row] + a, 2 * q[column] + b)
        for row, column in zip(rows, columns, strict=True)
        for a, b in itertools.product(range(3 + extra), repeat=2)
    }
    ks, ls = (np.arange(min(x), max(x) + 1) for x in zip(*wide, strict=True))
    fine = np.zeros((len(ks), len(ls)), bool)
    for a, b in wide:
        fine[a - ks[0], b - ls[0]] = True
    return ks, ls, fine


def proof_of(field, *, steps=8, levels=3, passes=8, most=300):
    """A proof round a field: `steps` in pi/2 on the first level, at most so many levels,
    and none but the first in which a pixel has more than `most` labels.
    """
    records, labels, energy = [], None, field.energy().total
    for level in range(levels):
        table, record = risen(field, HALF / steps / 2**level, labels, passes)
        records.append(record)
        labels = table.finer(record.bound, energy)
        if max(allowed.size for *_, allowed in labels) > most:
            break
    return Proof(field, energy, max(record.bound for record in records), 0, tuple(records), 0.0, "gap")


def risen(field, h, labels, passes):
    """A level after some passes, and its record."""
    table = Table(field, h, labels)
    for _ in range(passes):
        for i in range(len(table.unary)):
            table.visit(i, True)
        for i in reversed(range(len(table.unary))):
            table.visit(i, False)
    table.quantise()
    return table, table.record(table.bound(), field.energy().total)
