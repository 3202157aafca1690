"""Grid: numbering, neighbour pairs and quads against small grids written out by hand."""

import numpy as np
from crossfield.models.instance.grid import Grid
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

RING = np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], dtype=bool)
MASKS = arrays(bool, st.tuples(st.integers(1, 6), st.integers(1, 6)))


def pairs(grid):
    return list(zip(grid.first.tolist(), grid.second.tolist(), grid.upward.tolist(), strict=True))


def test_a_grid_of_two_by_two_is_numbered_as_by_hand():
    grid = Grid(np.ones((2, 2), bool))
    assert (grid.height, grid.width, grid.size, grid.parts) == (2, 2, 4, 1)
    assert grid.number.tolist() == [[0, 1], [2, 3]]
    assert grid.rows.tolist() == [0, 0, 1, 1]
    assert grid.columns.tolist() == [0, 1, 0, 1]
    # 0 -> 1 to the right; 2 -> 0 up, 2 -> 3 to the right; 3 -> 1 up.
    assert pairs(grid) == [(0, 1, False), (2, 0, True), (2, 3, False), (3, 1, True)]
    upper, right = grid.pair_number
    assert upper.tolist() == [-1, -1, 1, 3]
    assert right.tolist() == [0, -1, 2, -1]
    # Bottom 2 -> 3, right side 3 -> 1, top 0 -> 1, left side 2 -> 0.
    assert grid.quads.tolist() == [[2, 3, 0, 1]]


def test_pixels_that_meet_in_a_corner_are_two_parts():
    assert Grid(np.eye(3, dtype=bool)).parts == 3
    assert Grid(RING).parts == 1


@given(MASKS)
def test_pairs_are_all_upper_and_right_neighbours_in_order(mask):
    grid = Grid(mask)
    expected = []
    for row, column in zip(*np.nonzero(mask), strict=True):
        for r, c, up in ((row - 1, column, True), (row, column + 1, False)):
            if r >= 0 and c < mask.shape[1] and mask[r, c]:
                expected.append((grid.number[row, column], grid.number[r, c], up))
    assert pairs(grid) == expected


@given(MASKS)
def test_walk_round_a_block_is_closed_and_counter_clockwise(mask):
    grid = Grid(mask)
    for bottom, side, top, left in grid.quads:
        assert grid.second[bottom] == grid.first[side]
        assert grid.second[side] == grid.second[top]
        assert grid.first[top] == grid.second[left]
        assert grid.first[left] == grid.first[bottom]
        assert grid.upward[[bottom, side, top, left]].tolist() == [False, True, False, True]
    full = mask[:-1, :-1] & mask[1:, :-1] & mask[:-1, 1:] & mask[1:, 1:]
    assert len(grid.quads) == full.sum()


@given(MASKS)
def test_pair_numbers_lead_back_to_the_pairs(mask):
    grid = Grid(mask)
    for table, upward in zip(grid.pair_number, (True, False), strict=True):
        (pixel,) = np.nonzero(table >= 0)
        pair = table[pixel]
        assert (grid.first[pair] == pixel).all()
        assert (grid.upward[pair] == upward).all()
    assert sum((table >= 0).sum() for table in grid.pair_number) == len(grid.first)
