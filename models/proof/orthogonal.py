"""Proofs for orthogonal crosses on any domain: level after level of labels round the best field.

docs/orthogonal-proofs.md has the lemmas. On every level a dual rises (orthogonal_dual.py), fields are rounded
from it, and the checker (check_orthogonal.py) computes the bound and what is left. A level has a third of the
spacing of the one before, or the same spacing with fewer labels. Rings that hold part of the gap become
clusters.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from ..array_archive import Arrays
from ..field.field import CrossField
from ..instance.domain import Bools, Ints
from ..instance.file import instance_arrays
from ..instance.instance import Instance
from ..orthogonal.energy import OrthogonalEnergy, field_of, integers_of
from ..processes.deadline import Progress
from ..processes.limits import Limits
from ..search.search import search
from ..search.starts import best_start
from . import check_orthogonal as checker
from .check_certificate import OPTIMAL
from .check_orthogonal import Level, Problem
from .orthogonal_certificate import LevelFacts, OrthogonalProof, check_proof
from .orthogonal_dual import Dual

if TYPE_CHECKING:
    from .descent import Termination

# Levels
_COARSEST: Final = 15  # cells of a quarter turn
_FINEST: Final = 3645
_MOST_COSTS: Final = 40_000_000  # pairs of labels of a level: some 3 GB
_NARROW: Final = 0.7  # share of the cells left below which the same spacing is worth another level

# Passes
_MOST_PASSES: Final = 200
_PASSES: Final = 5  # between looks at the bound
_SLOW: Final = 0.08  # part of the gap: a smaller rise of five passes is slow
_FEW: Final = 0.4  # share of labels left below which a record of the level pays
_CLOSER: Final = 0.3  # part of the gap of the last record, from which another one makes rings cheaper
_TINY: Final = 1e-3  # relative gap below which finer labels follow
_CAP: Final = 3.0  # gaps from which sums on rings count alike, before a bound counts

_WIDE: Final = 0.01  # relative gap of the first level above which a search for a better field follows
_SEARCH: Final = 0.05  # share of the time left for it
_ROUNDS: Final = 1  # of that search without a limit of time
_BETTER: Final = 1e-9  # relative: a better field; also what a level keeps more than the checker asks for


def prove_orthogonal(
    instance: Instance, start: CrossField | None, ends: Termination, progress: Progress, seed: int = 0
) -> OrthogonalProof:
    """Find a field of orthogonal crosses, and prove a lower bound of the energy of all.

    The instance has the gauge `strokes`. The proof is checked after its limits.
    """
    began = time.monotonic()
    first = best_start(instance, start, ends.over)
    prover = _Prover(instance, OrthogonalEnergy.of(instance), integers_of(first), ends, progress, seed)
    proof = prover.proof(prover.run(), began)
    if not proof.levels:
        return proof
    progress("checking the levels")
    return check_proof(proof, prover.limit)


@dataclass
class _Chain:
    """Levels round one centre, and what they prove. arrays: of a certificate, without head and field."""

    problem: Problem
    threshold: float
    arrays: Arrays
    levels: list[LevelFacts] = field(default_factory=list)
    forced: int = 0
    convex: float = -math.inf

    @property
    def bound(self) -> float:
        """The bound that all levels prove together."""
        return max([0.0, self.convex, *(level.bound for level in self.levels)])


def two_colours(rows: checker.Rows, fixed: Bools) -> Ints:
    """0 or 1 of each point, such that most pairs have both, and 0 where it is fixed; (n,)."""
    n, m = rows.size, rows.pairs
    near: list[list[int]] = [[] for _ in range(n)]
    for i, j in zip(rows.first[:m].tolist(), rows.second[:m].tolist(), strict=True):
        near[i].append(j)
        near[j].append(i)
    colour = [-1] * n
    for begin in [*np.nonzero(fixed[:n])[0].tolist(), *range(n)]:
        waiting = [begin] if colour[begin] < 0 else []
        colour[begin] = max(colour[begin], 0)
        for i in waiting:
            for j in near[i]:
                if colour[j] < 0:
                    colour[j] = 1 - colour[i]
                    waiting.append(j)
    changing = True
    while changing:
        changing = False
        for i in range(n):
            if not fixed[i] and 2 * sum(colour[j] == colour[i] for j in near[i]) > len(near[i]):
                colour[i], changing = 1 - colour[i], True
    return np.array(colour, dtype=np.int32)


def _rings_of(instance: Instance) -> Arrays:
    """The rings of the domain that are closed walks over different points, as a certificate has them."""
    rings, domain = instance.domain.rings, instance.domain
    first, second, sign = domain.first[rings.pair], domain.second[rings.pair], rings.sign
    begin = np.where(sign > 0, first, second)
    blocks = [
        (a, b)
        for a, b in zip(rings.start[:-1].tolist(), rings.start[1:].tolist(), strict=True)
        if 3 <= b - a <= checker.MOST_RING and len(set(begin[a:b].tolist())) == b - a
    ]
    steps = np.concatenate([np.arange(a, b) for a, b in blocks] or [np.zeros(0, dtype=np.int64)])
    return {
        "ring_start": np.cumsum([0, *(b - a for a, b in blocks)]).astype(np.int32),
        "ring_pair": rings.pair[steps].astype(np.int32),
        "ring_sign": sign[steps].astype(np.int8),
    }


@dataclass
class _Prover:
    """The best field, and the chain of levels that proves most.

    z: the integers of the best field. least: its energy. pruned: the gap at the last record.
    """

    instance: Instance
    energy: OrthogonalEnergy
    z: Ints
    ends: Termination
    progress: Progress
    seed: int = 0
    proven: _Chain | None = None
    pruned: float = math.inf

    def __post_init__(self) -> None:
        arrays = instance_arrays(self.instance).items()
        self.arrays: Arrays = {f"instance_{name}": array for name, array in arrays} | _rings_of(self.instance)
        if self.instance.domain.kappa is not None:
            self.arrays["kappa"] = self.instance.domain.kappa
        self.rows = checker.rows_of(self.arrays)
        self.limit = checker.limits_of(self.rows)
        self.half = two_colours(self.rows, self.rows.fixed_points()).astype(np.uint8)
        m, n = self.rows.pairs, self.rows.size
        first, second = self.rows.first[:m], self.rows.second[:m]
        graph = sparse.csr_array((np.ones(2 * m), (np.r_[first, second], np.r_[second, first])), (n, n))
        self.order = reverse_cuthill_mckee(graph, symmetric_mode=True).astype(np.int64)
        self.least = self.energy.least_total(self.z)

    def proof(self, ended: str, began: float) -> OrthogonalProof:
        """The proof so far, not checked."""
        best, chain = field_of(self.instance, self.z, self.energy), self.proven
        arrays: Arrays = {} if chain is None else dict(chain.arrays)
        arrays |= {"alpha": best.alpha, "p": best.p}
        if chain is not None:
            arrays["divisions"] = np.array([level.divisions for level in chain.levels], dtype=np.int32)
        energy = best.energy().total
        return OrthogonalProof(
            best, energy, min(self.bound, energy), 0 if chain is None else chain.forced,
            () if chain is None else tuple(chain.levels), time.monotonic() - began, ended, arrays,
            energy if chain is None else chain.threshold,
        )  # fmt: skip

    @property
    def bound(self) -> float:
        """The greatest bound of all chains."""
        return 0.0 if self.proven is None else self.proven.bound

    def run(self) -> str:
        """Go through chains of levels until a limit is met or nothing helps; return the reason."""
        while not (reason := self._go_through_levels()):
            pass
        return reason

    def _go_through_levels(self) -> str:
        """Go through the levels round the best field; the reason of the end, empty for a better field."""
        if reason := self.ends.reason():
            return reason
        if self.rows.pairs * (_COARSEST + 1) ** 2 > _MOST_COSTS:
            return "labels"
        chain = self._first_chain()
        problem, rings, self.pruned = chain.problem, list[int](), math.inf
        level, before = checker.first_level(problem, _COARSEST), None
        while True:
            costs = checker.costs_of(problem, level)
            dual = Dual(problem, level, costs, self.order, rings)
            if before is not None:
                dual.interpolate(before)
            closing = self._ascend(dual, chain.threshold)
            if self._find_better_field(dual) and not self.ends.over():
                return ""
            least = self.least
            kept = self._record(chain, dual, costs)
            if chain.bound >= self.bound:
                self.proven = chain
            reason = self._reason_to_end(chain)
            wide = len(chain.levels) == 1 and self.least - chain.bound > _WIDE * self.least
            if reason or self.least < least or (wide and self._search(_SEARCH * self.ends.deadline.left())):
                return reason
            more = self._more_rings(dual)
            factor = 1 if closing else self._next_factor(level, kept[0], more=bool(more))
            if not factor:
                return "labels"
            rings = rings + more
            level, before = checker.next_level(problem, level, *kept, factor), dual

    def _first_chain(self) -> _Chain:
        """A chain round the best field, without levels."""
        best = field_of(self.instance, self.z, self.energy)
        energy, error = checker.energy_of({"alpha": best.alpha, "p": best.p}, self.rows)
        arrays = self.arrays | {"centre": self.energy.fit_angles(self.z), "half": self.half}
        problem = checker.problem_of(arrays, self.rows, self.limit)
        return _Chain(problem, energy * (1 + _BETTER) + 2 * error, arrays)

    def _ascend(self, dual: Dual, most: float) -> bool:
        """Passes until the bound rises slowly, or few labels are left; whether rings close much of it."""
        reached, rings, closing = -math.inf, bool(dual.ring_numbers), False
        if rings:
            dual.update_rings(_CAP * max(most - self.bound, 0.0) + 0.1, backward=False)
        for number in range(_MOST_PASSES):
            dual.pass_over(most, forward=True)
            bound, left = dual.pass_over(most, forward=False)
            if rings:
                dual.update_rings(max(most - bound, 0.0), backward=bool(number % 2))
            closing = rings and number > 1 and _TINY * most < most - bound < _CLOSER * self.pruned
            if self.ends.over() or closing:
                break
            if number % _PASSES == _PASSES - 1:
                if bound - reached < _SLOW * (most - bound) or left < _FEW:
                    break
                reached = bound
        dual.pass_over(most, forward=True)
        bound, _ = dual.pass_over(most, forward=False)
        labels = len(dual.state.unary)
        self.ends.labels += labels
        self.progress(f"energy {self.least:.5g}, bound {max(bound, self.bound):.5g}, {labels} labels")
        return closing

    def _find_better_field(self, dual: Dual) -> bool:
        """Whether the shares suggest a better field, which then is the best one."""
        improved = False
        for forward in (True, False):
            z = self.energy.nearest(dual.decode(forward=forward))
            improved |= self._offer(self.energy.descend(z, over=self.ends.over)[0])
            dual.pass_over(math.inf, forward=forward)
        return improved

    def _search(self, seconds: float) -> bool:
        """Whether a search finds a better field; without a limit of time, in some rounds."""
        timed = math.isfinite(self.ends.deadline.left())
        result = search(
            self.instance,
            limits=Limits().until(self.ends.deadline.within(seconds)) if timed else None,
            rounds=None if timed else _ROUNDS,
            seed=self.seed,
            jobs=1,
            start=field_of(self.instance, self.z, self.energy),
            stop=self.ends.stop,
        )
        return self._offer(integers_of(result.field))

    def _offer(self, z: Ints) -> bool:
        """Whether integers are better than the best ones, which they then are."""
        total = self.energy.least_total(z)
        better = total < self.least * (1 - _BETTER) - 1e-12
        if better:
            self.z, self.least = z, total
        return better

    def _record(self, chain: _Chain, dual: Dual, costs: Any) -> tuple[list[Bools], list[Bools]]:
        """Add a level to its chain; what the checker finds that it leaves, and a little more.

        Other processors round differently, and must not find more.
        """
        number, level, problem = len(chain.levels), dual.level, chain.problem
        self.pruned = chain.threshold - dual.bound
        gap = max(self.pruned, 1e-6 * (1 + chain.threshold))
        chain.arrays |= {f"level_{number}_{name}": array for name, array in dual.arrays(gap).items()}
        excess = checker.excess_of(
            problem, costs, *checker.stored_shares(chain.arrays, number, problem, level)
        )
        kept = checker.kept_of(problem, level, excess, chain.threshold * (1 + _BETTER) + 1e-12)
        for name, bits in zip(("cells", "squares"), kept, strict=True):
            packed = np.packbits(np.concatenate([of_one.ravel() for of_one in bits]))
            chain.arrays[f"level_{number}_{name}"] = packed
        labels = sum(map(len, level.labels[:-1]))
        chain.levels.append(LevelFacts(level.divisions, labels, excess.bound))
        turns = checker.possible_turns(problem, level, *kept)
        chain.forced = sum(of_row == [0] for of_row in turns[: self.rows.pairs])
        nearest = np.round(-self.rows.residuals(problem.centre) / np.pi * 2).astype(np.int32)
        cases = [nearest + np.array(case, dtype=np.int32) for case in checker.cases_of(turns)]
        angles = np.array([self.energy.fit_angles(z) for z in cases]).reshape(-1, self.rows.size)
        chain.arrays["cases"] = angles
        chain.convex = checker.cases_bound(problem, turns, angles)
        for z in cases:
            self._offer(z)
        return kept

    def _reason_to_end(self, chain: _Chain) -> str:
        """The reason why the work ends; empty if it goes on."""
        if self.least - chain.bound <= OPTIMAL / 2 * max(1.0, self.least):
            return "optimal"
        return "gap" if self.least - self.bound <= self.ends.gap * self.least else self.ends.reason()

    def _more_rings(self, dual: Dual) -> list[int]:
        """Rings whose pairs cost more at the centre than their shares, and that are not in use."""
        gaps = dual.ring_gaps()
        gaps[dual.ring_numbers] = 0.0
        numbers = np.argsort(-gaps, kind="stable")
        return [int(number) for number in numbers if gaps[number] > 1e-6 * max(self.least, 1.0)]

    def _next_factor(self, level: Level, cells: list[Bools], *, more: bool) -> int:
        """How many parts each cell has on the next level; 0 if no level helps."""
        counts = np.array([3.0 * cell.sum() + 1 for cell in cells])
        ends = self.rows.ends[: self.rows.pairs]
        finer = sum(counts[i] * counts[j] for i, j in ends)
        narrow = counts.sum() < _NARROW * 3 * sum(int(cell.sum()) for cell in level.cells)
        if more and level.divisions == _COARSEST:
            return 1
        if level.divisions < _FINEST and finer <= (_MOST_COSTS / 20 if narrow else _MOST_COSTS):
            return 3
        return 1 if narrow or more else 0
