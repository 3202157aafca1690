"""Memory follows the pixels, not the sides of the mask."""

import pytest
from children import require_proc, within_memory

TWO_PIXELS = """
import crossfield as cf, numpy as np
mask = np.zeros((9999, 9999), bool)
mask[0, 0] = mask[-1, -1] = True
two = cf.Instance.on_pixels("two", mask, [[0, 0], [9998, 9998]], [0.1, 0.2], [1, 1])
cf.write_instance(two, "two.npz")
"""
WORK = """
import crossfield as cf
two = cf.read_instance("two.npz")
for field in (cf.greedy_field(two), cf.search(two, rounds=1, jobs=1).field, cf.polyvector_field(two)):
    assert field.energy().total < 1e-9
cf.write(cf.formulate(two, "milp"), "two.lp")
print(open("/proc/self/status").read().split("VmHWM:")[1].split()[0])  # getrusage has the peak of its parent
"""


@pytest.mark.slow
def test_two_pixels_on_the_largest_grid_take_the_memory_of_two_pixels(tmp_path):
    """A mask of 100 MB is read in the two gigabytes, and copied a few times."""
    require_proc()
    within_memory(TWO_PIXELS, tmp_path)
    assert (tmp_path / "two.npz").stat().st_size < 500_000
    assert int(within_memory(WORK, tmp_path)) < 700_000  # kilobytes
