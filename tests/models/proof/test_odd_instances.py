"""Tiny odd instances through prove, write, check and read: masks in parts, parts without strokes, one pixel,
extreme weights, every norm and gauge.

The optimum of the smallest is found without the prover: by trying every jump, or with HiGHS.
"""

import itertools
import math

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.instance.angles import HALF, QUARTER
from crossfield.models.instance.terms import parity_sign
from crossfield.models.proof import check_certificate
from exhaustive import every_jump, least_energy
from odd_instances import NORMS, odd_instance
from scipy.optimize import LinearConstraint, lsq_linear, milp

pytestmark = pytest.mark.numeric

WORK = 30_000  # labels after which a proof ends with a gap
MOST_PAIRS = 4  # of an instance whose jumps are all tried


def optimum(instance, norm):
    """The least energy of all fields in the gauge `strokes`, without code of the prover; None if unknown."""
    instance = instance.with_gauge("strokes")
    if len(instance.grid.first) > MOST_PAIRS or norm == "mixed":
        return None
    return least_squares(instance) if norm == 2 else least_absolute(instance)


def least_squares(instance):
    """The least 2-norm energy, over all jumps whose least energy without windows is low enough."""
    jumps = np.concatenate(list(every_jump(instance)))
    free = np.concatenate([least_energy(instance, part) for part in every_jump(instance)])
    best = math.inf
    for number in np.argsort(free, kind="stable"):
        if free[number] >= best:
            break
        best = min(best, least_in_windows(instance, jumps[number]))
    return best


def least_in_windows(instance, p):
    """The energy of the best field with jumps p."""
    rows, goal, weight = terms(instance, p)
    root = np.sqrt(weight)
    x = lsq_linear(rows * root[:, None], goal * root, windows(instance), method="bvls", tol=1e-14).x
    return float(weight @ (rows @ x - goal) ** 2)


def terms(instance, p):
    """All residuals as rows x - goal of the angles x = (alpha, beta), and their weights."""
    grid, n, strokes = instance.grid, instance.grid.size, instance.stroke_terms
    unit, none = np.eye(n), np.zeros((n, n))
    a = np.hstack([unit[grid.first] - unit[grid.second], none[grid.first]])
    b = np.hstack([none[grid.first], parity_sign(p)[:, None] * unit[grid.first] - unit[grid.second]])
    r = np.hstack([unit[strokes.pixel], unit[strokes.pixel]])
    rows = np.vstack([a, b, r, np.hstack([none, unit])])
    goal = np.concatenate([-HALF * np.asarray(p), np.zeros(len(b)), strokes.goal, np.zeros(n)])
    skew = np.full(n, instance.skew_coefficient)
    return rows, goal, np.concatenate([np.full(2 * len(a), 2.0), strokes.weight, skew])


def windows(instance):
    """Least and greatest angles (alpha, beta)."""
    beta = np.full(instance.grid.size, QUARTER)
    lower, upper = np.concatenate([instance.alpha_lower, -beta]), np.concatenate([instance.alpha_upper, beta])
    return lower, np.maximum(upper, lower + 1e-15)


def least_absolute(instance):
    """The least 1-norm energy by HiGHS, one linear program with integers for each parity of all jumps."""
    m = len(instance.grid.first)
    ends = [np.ceil((low - np.array([0, 1])) / 2) for low in instance.p_min]
    found = [math.inf]
    for parities in itertools.product((0, 1), repeat=m):
        parity = np.array(parities, int)
        rows, goal, weight = terms(instance, parity)
        r, size = len(rows), rows.shape[1]
        turns = np.zeros((r, m))  # of the integers q, with p = 2 q + parity
        turns[:m] = np.pi * np.eye(m)
        lower, upper = windows(instance)
        low = [end[bit] for end, bit in zip(ends, parities, strict=True)]
        high = np.floor((instance.p_max - parity) / 2)
        if (high < low).any():
            continue
        both = [np.hstack([sign * rows, sign * turns, -np.eye(r)]) for sign in (1, -1)]
        bounds = [
            np.concatenate([lower, low, np.zeros(r)]),
            np.concatenate([upper, high, np.full(r, np.inf)]),
        ]
        cost = np.concatenate([np.zeros(size + m), weight / max(weight.max(), 1.0)])
        integrality = np.concatenate([np.zeros(size), np.ones(m), np.zeros(r)])
        result = milp(
            cost,
            integrality=integrality,
            bounds=bounds,
            constraints=LinearConstraint(np.vstack(both), ub=np.concatenate([goal, -goal])),
            options={"mip_rel_gap": 0.0},
        )
        if result.x is not None:
            x = np.clip(result.x[:size], lower, upper)
            q = np.round(result.x[size : size + m])
            found.append(float(weight @ np.abs(rows @ x + turns @ q - goal)))
    return min(found)


def assert_round_trip(seed, folder):
    instance, norm = odd_instance(seed), NORMS[seed % len(NORMS)]
    proof = cf.prove(instance, norm=norm, jobs=1, work=WORK)
    path = folder / f"{seed}.npz"
    written = cf.write_certificate(proof, path)
    claim = check_certificate.check_arrays(check_certificate.read_arrays(str(path)))
    read = cf.read_certificate(path, on=instance.with_gauge("strokes"))
    claims = [(each.status, each.bound, each.gap, each.forced) for each in (proof, written, read)]
    assert claims[0] == claims[1] == claims[2]
    assert claim.status == proof.status
    assert proof.bound <= claim.bound
    assert (proof.gap == 0) == (proof.status == "optimal") == (proof.ended == "optimal")
    energy = read.field.energy(norm).total
    assert energy == proof.energy
    assert read.energy == pytest.approx(energy, rel=1e-12, abs=1e-12)
    least = optimum(instance, norm)
    if least is not None:
        assert proof.bound <= least + 1e-9 * max(1.0, least)
        if proof.status == "optimal":
            assert proof.energy <= least + 1e-8 * max(1.0, least)
    return proof


def test_few_odd_instances_are_proven_written_checked_and_read(tmp_path):
    few = [seed for seed in range(100) if odd_instance(seed).grid.size <= MOST_PAIRS][:24]
    proofs = [assert_round_trip(seed, tmp_path) for seed in few]
    assert {proof.norm for proof in proofs} == set(NORMS)
    assert {proof.status for proof in proofs} == {"optimal", "gap"}


@pytest.mark.slow
@pytest.mark.parametrize("block", range(6))
def test_odd_instances_are_proven_written_checked_and_read(block, tmp_path):
    for seed in range(20 * block, 20 * block + 20):
        assert_round_trip(seed, tmp_path)
