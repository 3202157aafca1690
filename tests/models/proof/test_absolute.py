"""Proofs where pairs count with absolute values: the lemmas at random points, and optima of other solvers."""

import math

import crossfield as cf
import numpy as np
import pytest
from angles import HALF
from crossfield.models.processes.compilation import crew
from crossfield.models.proof.bound.dual import Dual
from crossfield.models.proof.bound.lattice import Lattice
from crossfield.models.proof.checkers import check_certificate
from crossfield.models.proof.checkers.check_certificate import has_forced_jump
from crossfield.models.proof.descent.last_step import energy_terms
from crossfield.models.search.angle_program import fit_absolute, solve_angle_program
from crossfield.models.search.starts import first_field
from exhaustive import random_instance
from instance_kinds import kind

NORMS = pytest.mark.parametrize("norm", [1, "mixed"])


def test_boxes_are_cut_where_they_exceed_windows(tmp_path):
    """The optima lie on both sides of edges of windows, so that no finer lattice closes the gap."""
    instance, path = kind("contradicting"), tmp_path / "it.npz"
    proof = cf.prove(instance, norm=1, jobs=1)
    solution = cf.solve(cf.formulate(instance, "milp-mccormick"), "highs", limits=cf.Limits(100, 1e-9))
    assert proof.energy == pytest.approx(solution.objective, abs=1e-6)
    assert cf.write_certificate(proof, path).status == proof.status == "optimal"
    arrays = check_certificate.unpack_arrays(path.read_bytes())
    assert (arrays["cuts"] >= 0).sum() >= 1
    uncut = arrays | {"cuts": np.array([-1], np.int32), "multipliers": arrays["multipliers"][:1]}
    with pytest.raises(check_certificate.NotProvenError):
        check_certificate.check_arrays(uncut)


def test_boxes_that_reach_no_skew_of_one_sign_force_jumps_in_the_checker_too(tmp_path):
    """The checker's boxes are wider by a margin, so their ends at 0 lie beyond it."""
    instance = cf.entries("cf_rand_n006_s1_miqp")[0].instance
    assert (
        cf.write_certificate(cf.prove(instance, norm="mixed", jobs=1), tmp_path / "it.npz").status
        == "optimal"
    )


@NORMS
def test_a_bound_without_forced_jumps_is_confirmed(norm, tmp_path):
    proof = cf.prove(random_instance(5, (4, 4), 16), norm=norm, jobs=1, work=1)
    written = cf.write_certificate(proof, tmp_path / "it.npz")
    assert written.status == "gap"
    assert 0 < written.bound <= written.energy


@NORMS
def test_levels_bound_any_field_from_any_slopes(norm):
    """Levels round a bad field, with slopes of no meaning, are bounds below a good one."""
    rng = np.random.default_rng(0)
    for seed in range(6):
        instance = random_instance(seed, (3, 3), strokes=9)
        good = cf.prove(instance, norm=norm, jobs=1, limits=cf.Limits(math.inf, 0.01))
        bad = cf.CrossField(instance, rng.uniform(0, 3, 9), rng.uniform(-0.7, 0.7, 9), np.zeros(12, int))
        lattice = Lattice.common(bad, norm, rng.uniform(-2, 2, len(instance.theta)), 8)
        assert lattice_bound(lattice) <= good.energy + 1e-12


def lattice_bound(lattice):
    with crew(1) as hands:
        dual = Dual(lattice, hands)
        dual.ascend(10)
        dual.quantise()
        return dual.bound()


@pytest.mark.parametrize("norm", [2, 1, "mixed"])
def test_the_mean_cost_of_a_rounded_cross_is_at_most_its_own(norm):
    """Stroke and skew at random crosses of one pixel; thresholds of alpha and beta are independent."""
    rng, size = np.random.default_rng(1), np.abs if norm == 1 else np.square
    for place in (0, 1) * 40:  # on both colours of the checkerboard
        theta, skew_coefficient = rng.uniform(0, np.pi), rng.uniform()
        slope = rng.choice([-1, 0, 1, rng.uniform(-1.6, 1.6)])
        instance = cf.Instance.on_pixels(
            "one", [[place == 0, place == 1]], [[0, place]], [theta], [1.0], skew_coefficient=skew_coefficient
        )
        steps, beta = int(rng.choice([8, 10, 16])), rng.uniform(-0.7, 0.7) if norm == 2 else 0.0
        field = cf.CrossField(instance, [rng.uniform(0, 3)], [beta], [])
        lattice = (
            Lattice.whole(field, steps)
            if norm == 2
            else Lattice.common(field, norm, np.array([slope]), steps)
        )
        shape = lattice.alpha_count[0], lattice.beta_count[0]
        cost = lattice.unary_costs().reshape(shape)
        alpha, beta = (angle.reshape(shape) for angle in lattice.angles(np.arange(cost.size)))
        x, y = (rng.uniform(0, side - 1, 300) for side in shape)
        k, l = x.astype(int), y.astype(int)  # noqa: E741 - the letter of the equation
        mean = sum(
            np.abs(x - k - 1 + a) * np.abs(y - l - 1 + b) * cost[k + a, l + b] for a in (0, 1) for b in (0, 1)
        )
        at, skew = alpha[0, 0] + lattice.h * x, beta[0, 0] + lattice.h * y
        turned = np.array([at + skew, at + HALF - skew]) - theta
        misfit = np.abs(turned - np.pi * np.round(turned / np.pi)).min(axis=0)
        assert (mean <= size(misfit) + skew_coefficient * size(skew) + 1e-12).all()


@NORMS
def test_the_angles_of_a_program_are_the_best_in_its_box(norm):
    rng = np.random.default_rng(2)
    instance = random_instance(3, (3, 4))
    field = first_field(instance)
    fitted, _ = fit_absolute(field, norm)
    assert fitted.energy(norm).total <= field.energy(norm).total
    lower = np.concatenate([fitted.alpha, fitted.beta]) - rng.uniform(0, 1, 24)
    upper = lower + rng.uniform(0, 1, 24)
    tilt = rng.normal(0, 0.1, 24)
    best, _ = solve_angle_program(instance, field.p, norm, lower, upper, tilt=tilt)

    def objective(x):
        return cf.CrossField(instance, x[:12], x[12:], field.p).energy(norm).total - tilt @ x

    assert ((lower <= best) & (best <= upper)).all()
    near = np.clip(best + rng.normal(0, np.repeat([[1e-3], [0.1]], 25, axis=0), (50, 24)), lower, upper)
    assert objective(best) <= min(map(objective, [*near, *rng.uniform(lower, upper, (25, 24))])) + 1e-9


@pytest.mark.parametrize("norm", [2, 1, "mixed"])
def test_a_forced_jump_is_the_best_one_everywhere_in_its_boxes(norm):
    rng, size = np.random.default_rng(3), np.square if norm == 2 else np.abs
    instance = cf.Instance.on_pixels("two", np.ones((1, 2), bool), [[0, 0]], [1.0], [1.0])
    forced = 0
    for _ in range(300):
        p = rng.integers(-1, 2)
        middle = np.array([[0.5, 0.5 + HALF * p], rng.uniform(-0.7, 0.7, 2)]) + rng.normal(0, 0.2, (2, 2))
        low, high = middle - rng.uniform(0, 0.2, (2, 2)), middle + rng.uniform(0, 0.2, (2, 2))
        boxes = np.stack([low[0], high[0], low[1], high[1]], axis=1)
        if not has_forced_jump(energy_terms(instance, norm), np.array([p]), boxes)[0]:
            continue
        forced += 1
        alpha, beta = rng.uniform(low[..., None], high[..., None], (2, 2, 200))
        jumps = np.arange(p - 4, p + 5)[:, None]
        costs = size(alpha[0] - alpha[1] + HALF * jumps) + size((-1.0) ** jumps * beta[0] - beta[1])
        assert (costs[4] <= costs.min(axis=0) + 1e-12).all()
    assert forced > 30
