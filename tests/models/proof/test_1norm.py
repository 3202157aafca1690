"""Proofs of the 1-norm: the lemmas at random points, and optima that HiGHS proves of the same problem."""

import math

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.errors import InputError
from crossfield.models.instance.instance import HALF, Instance
from crossfield.models.processes.compiled import crew
from crossfield.models.proof.certificate import write_certificate
from crossfield.models.proof.lattice import CommonLattice
from crossfield.models.proof.prove_1norm import forced_1norm
from crossfield.models.proof.pruning import RemainingCells
from crossfield.models.proof.sweep import Dual
from crossfield.models.search.box_lp import Residuals, fitted_1norm
from crossfield.models.search.starts import first_field
from exhaustive import random_instance

pytestmark = pytest.mark.numeric


@pytest.mark.slow
def test_bound_and_energy_are_the_optimum_that_highs_proves():
    for seed in range(6):
        instance = random_instance(seed, (2 + seed % 3,) * 2, strokes=(2 + seed % 3) ** 2)
        proof = cf.prove(instance, norm=1, jobs=1)
        optimum = cf.solve(
            cf.formulate(instance, "milp-mccormick"), "highs", limits=cf.Limits(100, gap=1e-9)
        ).objective
        assert proof.bound <= optimum + 1e-9, seed
        assert proof.energy >= optimum - 1e-7, seed
        assert proof.energy == proof.field.energy(1).total
        assert proof.status == "optimal", seed


def test_levels_bound_any_field_from_any_slopes():
    """Levels round a bad field, with slopes of no meaning, are bounds below a good one."""
    rng = np.random.default_rng(0)
    for seed in range(6):
        instance = random_instance(seed, (3, 3), strokes=9)
        good = cf.prove(instance, norm=1, jobs=1, limits=cf.Limits(math.inf, 0.01))
        bad = cf.CrossField(instance, rng.uniform(0, 3, 9), rng.uniform(-0.7, 0.7, 9), np.zeros(12, int))
        lattice = CommonLattice.near(bad, rng.uniform(-1, 1, len(instance.theta)), 8)
        assert lattice_bound(lattice) <= good.energy + 1e-12


def lattice_bound(lattice):
    with crew(1) as hands:
        dual = Dual(lattice, hands)
        dual.ascend(10)
        dual.quantise()
        return dual.bound()


def test_the_mean_cost_of_a_rounded_cross_is_at_most_its_own():
    """Stroke and skew at random crosses of one pixel; thresholds of alpha and beta are independent."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        theta, slope, skew_coefficient = (
            rng.uniform(0, np.pi),
            rng.choice([-1, 0, 1, rng.uniform(-1, 1)]),
            rng.uniform(),
        )
        instance = Instance(
            "one", np.ones((1, 1), bool), [[0, 0]], [theta], [1.0], skew_coefficient=skew_coefficient
        )
        field = cf.CrossField(instance, [rng.uniform(0, 3)], [0.0], [])
        lattice = CommonLattice.near(field, np.array([slope]), int(rng.choice([2, 4, 16])))
        rows, columns = lattice.alpha_count[0], lattice.beta_count[0]
        cost = lattice.unary_costs().reshape(rows, columns)
        alpha, beta = (angle.reshape(rows, columns) for angle in lattice.angles)
        x, y = rng.uniform(0, rows - 1, 100), rng.uniform(0, columns - 1, 100)
        k, l = x.astype(int), y.astype(int)  # noqa: E741 - the letter of the equation
        mean = sum(
            np.abs(x - k - 1 + a) * np.abs(y - l - 1 + b) * cost[k + a, l + b] for a in (0, 1) for b in (0, 1)
        )
        at, skew = alpha[0, 0] + lattice.h * x, beta[0, 0] + lattice.h * y
        turned = np.array([at + skew, at + HALF - skew]) - theta
        misfit = np.abs(turned - np.pi * np.round(turned / np.pi)).min(axis=0)
        assert (mean <= misfit + skew_coefficient * np.abs(skew) + 1e-12).all()


def test_any_multipliers_bound_the_energy_in_a_box():
    rng = np.random.default_rng(2)
    instance = random_instance(3, (3, 4))
    field = first_field(instance)
    fitted, slopes = fitted_1norm(field)
    assert fitted.energy(1).total <= field.energy(1).total
    assert (np.abs(slopes) <= 1).all()
    terms = Residuals.at(instance, field.p)
    lower = np.concatenate([fitted.alpha, fitted.beta]) - rng.uniform(0, 1, 24)
    upper = lower + rng.uniform(0, 1, 24)
    for _ in range(50):
        x = rng.uniform(lower, upper)
        energy = cf.CrossField(instance, x[:12], x[12:], field.p).energy(1).total
        assert terms.weight @ np.abs(terms.matrix @ x + terms.constant) == pytest.approx(energy, rel=1e-12)
        assert terms.bound(rng.uniform(-1.5, 1.5, len(terms.weight)), lower, upper) <= energy


def test_a_forced_jump_is_the_best_one_everywhere_in_its_boxes():
    rng = np.random.default_rng(3)
    instance = Instance("two", np.ones((1, 2), bool), [[0, 0]], [1.0], [1.0])
    found = 0
    for _ in range(300):
        p = rng.integers(-1, 2)
        middle = np.array([[0.5, 0.5 + HALF * p], rng.uniform(-0.7, 0.7, 2)]) + rng.normal(0, 0.2, (2, 2))
        low, high = middle - rng.uniform(0, 0.2, (2, 2)), middle + rng.uniform(0, 0.2, (2, 2))
        lattice = CommonLattice.near(cf.CrossField(instance, middle[0], middle[1], [p]), np.zeros(1), 4)
        left = RemainingCells(lattice, lattice.allowed, low[0], high[0], low[1], high[1])
        if not forced_1norm(left).pairs[0]:
            continue
        found += 1
        alpha, beta = rng.uniform(low[..., None], high[..., None], (2, 2, 200))
        jumps = np.arange(p - 4, p + 5)[:, None]
        costs = np.abs(alpha[0] - alpha[1] + HALF * jumps) + np.abs((-1.0) ** jumps * beta[0] - beta[1])
        assert (costs[4] <= costs.min(axis=0) + 1e-12).all()
    assert found > 30


def test_a_proof_in_the_1norm_has_no_certificate(tmp_path):
    proof = cf.prove(random_instance(0, (2, 2)), norm=1, jobs=1)
    with pytest.raises(InputError, match="1-norm"):
        write_certificate(proof, tmp_path / "proof.npz")
    assert not list(tmp_path.iterdir())
