"""Free memory as Linux, control groups and limits of the process state it, and what it is compared with."""

import sys

import crossfield as cf
import numpy as np
import pytest
from children import within_memory
from crossfield.models.memory import available_memory, check_memory, free_in_groups

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the system does not state what is free")
GIGABYTE = 1_000_000_000


def test_this_machine_states_what_is_free():
    assert 1 << 20 < available_memory() < 1 << 50


@pytest.mark.parametrize("points, act", [(10**12, "read"), (10**11, "written")])
def test_more_than_any_machine_has_is_refused_with_the_estimate(points, act):
    check_memory(128 * 128, act)
    with pytest.raises(cf.InputError, match=rf"of {points} pixels needs about 150000.0 GB to be {act}, but"):
        check_memory(points, act)


def group(folder, names, most, used, facts):
    folder.mkdir(parents=True, exist_ok=True)
    for name, value in zip(names, (most, used), strict=True):
        (folder / f"memory.{name}").write_text(f"{value}\n")
    (folder / "memory.stat").write_text(facts)


def test_limits_of_both_versions_of_control_groups_are_known(tmp_path):
    """The limits of groups around a group hold too; caches of files are given up when memory is short."""
    second = ("max", "current")
    group(tmp_path / "a", second, 4 * GIGABYTE, 3 * GIGABYTE, f"anon 7\ninactive_file {GIGABYTE}\n")
    group(tmp_path / "a" / "b", second, "max", GIGABYTE, "anon 7\n")
    assert list(free_in_groups("0::/a/b\n", tmp_path)) == [2 * GIGABYTE]
    assert list(free_in_groups("0::/../../of/the/host\n", tmp_path / "a")) == [2 * GIGABYTE]
    first = ("limit_in_bytes", "usage_in_bytes")
    facts = "inactive_file 5\ntotal_inactive_file 7\n"
    group(tmp_path / "memory" / "c", first, 4 * GIGABYTE, GIGABYTE, facts)
    groups = "9:name=systemd:/c\n4:cpu,memory:/c\n1:cpu:/c\n0::/none\n"
    assert list(free_in_groups(groups, tmp_path)) == [3 * GIGABYTE + 7]


EXPORT = """
import crossfield as cf
instance = cf.read_instance("million.npz")
problem = cf.formulate(instance, "milp")
try:
    cf.write(problem, "million.lp")
except cf.InputError as error:
    print(error)
"""


def test_what_the_process_may_map_counts(tmp_path):
    side = 1000
    strokes = np.stack([np.arange(side), np.zeros(side, int)], axis=1)
    million = cf.Instance.on_pixels("m", np.ones((side, side), bool), strokes, np.zeros(side), np.ones(side))
    cf.write_instance(million, tmp_path / "million.npz")
    line = within_memory(EXPORT, tmp_path, 1.4)
    assert "a grid of 1000000 pixels needs about 1.5 GB to be written, but 1." in line or "but 0." in line
    assert not (tmp_path / "million.lp").exists()
