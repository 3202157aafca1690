"""The bound of the objective saved by broken rows: valid, zero without a broken row, and tight."""

import numpy as np
import pytest
from cases import SKEWED
from crossfield.export.formats.registry import FORMATS, problem_in_format
from crossfield.export.verify.leeway import objective_leeway
from crossfield.export.verify.verify import random_field
from crossfield.models.formulations.problem import Problem, formulate
from crossfield.models.samples.samples import sample

CHOSEN = {"alpha", "beta", "p", "p1", "p2"}
NAMES = [name for name in SKEWED if name != "qp-fixed"]


def following(problem: Problem) -> np.ndarray:
    """Which columns follow from angles and jumps."""
    return np.concatenate(
        [np.full(block.count, name not in CHOSEN) for name, block in problem.blocks.items()]
    )


@pytest.mark.parametrize("name", NAMES)
def test_the_leeway_is_no_less_than_what_was_saved(name: str):
    problem = formulate(sample("skew", 4), name)
    for held in (
        (problem, problem_in_format(problem, FORMATS["lp"])) if name != "minlp-parity" else (problem,)
    ):
        follows, rng = following(held), np.random.default_rng(2)
        point = held.point(random_field(held, 1))
        energy = held.objective_value(point)
        assert objective_leeway(held, point) == pytest.approx(0.0, abs=1e-12 * max(1.0, energy))
        for size in (1e-6, 1e-3, 0.1):
            for direction in (-1.0, rng.choice([-1.0, 1.0], len(point)), rng.uniform(-1, 1, len(point))):
                moved = point + size * direction * follows
                assert energy - held.objective_value(moved) <= objective_leeway(held, moved) + 1e-9


def test_one_broken_row_is_worth_its_slacks_cost():
    problem = formulate(sample("skew", 4), "milp-mccormick")
    point = problem.point(random_field(problem, 1))
    index, cost = problem.merged_objective(1)
    for column, price in list(zip(index[:, 0], cost, strict=True))[::7]:
        moved = point.copy()
        moved[column] -= 1e-3
        lost = problem.objective_value(point) - problem.objective_value(moved)
        assert objective_leeway(problem, moved) == pytest.approx(lost, rel=1e-6)
        assert lost == pytest.approx(1e-3 * price, rel=1e-6)


def test_a_product_that_is_off_counts_in_its_pair():
    """z off by e breaks a facet by as much; t, with 2 z in its row and a cost of 2, may lack 2 e.

    It may lack 4 e where its own row is broken as well.
    """
    problem = formulate(sample("skew", 4), "milp-mccormick")
    point = problem.point(random_field(problem, 1))
    z = problem.blocks["z"]
    moved = point.copy()
    moved[z.offset] += 1e-3
    assert round(objective_leeway(problem, moved) / 4e-3, 9) in {1.0, 2.0}
