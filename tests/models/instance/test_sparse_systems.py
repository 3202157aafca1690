"""Orders of elimination of sparse systems on a grid."""

import numpy as np
import pytest
from crossfield.models.instance.sparse_systems import factor_matrix, nested_dissection_order
from scipy import ndimage, sparse


@pytest.mark.parametrize("reach", [1, 2])
def test_the_last_unknowns_part_the_others(reach):
    row, column = np.nonzero(np.ones((30, 20), dtype=bool))
    order = nested_dissection_order(row, column, reach)
    assert sorted(order) == list(range(600))
    rest = np.ones((30, 20), dtype=bool)
    last = order[-20 * reach :]
    rest[row[last], column[last]] = False
    meet = np.ones((2 * reach + 1, 2 * reach + 1), dtype=bool)
    grown = ndimage.binary_dilation(rest, meet) & rest
    label, count = ndimage.label(grown, np.ones((3, 3)))
    assert count == 2
    assert np.bincount(label.ravel())[1:].min() > 200
    assert np.ptp(np.argwhere(~rest)[:, 0]) == reach - 1


def test_an_order_does_not_change_the_solution():
    rng = np.random.default_rng(0)
    row, column = np.nonzero(rng.random((25, 40)) < 0.8)
    near = np.maximum(abs(row[:, None] - row), abs(column[:, None] - column)) <= 2
    squares = sparse.csr_array(np.where(near, rng.standard_normal(near.shape), 0.0))
    matrix = (squares.T @ squares + sparse.eye_array(len(row))).tocsr()
    right = rng.standard_normal(len(row))
    solutions = [
        factor_matrix(matrix, order)(right) for order in (None, nested_dissection_order(row, column, 4))
    ]
    assert solutions[0] == pytest.approx(solutions[1], abs=1e-9)
    assert matrix @ solutions[1] == pytest.approx(right, abs=1e-6)
