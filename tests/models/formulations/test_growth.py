"""Work on many parts and on long cycles grows like their number. Calls are counted, not seconds."""

import sys

import crossfield as cf
import numpy as np
import pytest

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])


def count_calls(work):
    count = 0

    def note(frame, event, argument):
        nonlocal count
        count += event in {"call", "c_call"}

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


def cycles_of_apart_triangles(count):
    vertices = (CORNERS + [[[3 * number, 0, 0]] for number in range(count)]).reshape(-1, 3)
    mesh = cf.Mesh(vertices, np.arange(3 * count).reshape(-1, 3))
    instance = cf.Instance.on_faces("soup", mesh, [0], [0.3], [1.0])
    return lambda: instance.cycles


def rows_of_a_ring(count):
    mask = np.ones((count // 4 + 1, count // 4 + 1), bool)
    mask[1:-1, 1:-1] = False
    ring = cf.Instance.on_pixels("ring", mask, [[0, 0]], [0.3], [1.0], orthogonal=True)
    return lambda: cf.formulate(ring, "miqp-cycle").rows


@pytest.mark.parametrize("prepare, most", [(cycles_of_apart_triangles, 1.2), (rows_of_a_ring, 5)])
def test_four_times_the_parts_or_steps_take_hardly_more_calls(prepare, most):
    """Parts are handled as arrays, all at once; a row has a term for each step."""
    prepare(20)()  # imports
    small, large = (count_calls(prepare(count)) for count in (100, 400))
    assert large < most * small
