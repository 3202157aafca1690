"""Free memory as Linux states it, for the machine and for the control groups that limit a container."""

import sys

import pytest
from crossfield.models import memory
from crossfield.models.errors import InputError
from crossfield.models.memory import available_memory

MACHINE = 8 << 30


def system(root, groups, files):
    """A folder that looks like the root of a Linux system of 8 GiB, with these control groups."""
    files = {"proc/meminfo": f"MemTotal: 9 kB\nMemAvailable:    {MACHINE >> 10} kB\n"} | files
    for name, text in (files | {"proc/self/cgroup": groups}).items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(f"{text}\n")
    return root


def group(folder, limit, used, cached=0, *, version=2):
    names = {2: ("max", "current"), 1: ("limit_in_bytes", "usage_in_bytes")}[version]
    total = "" if version == 2 else "total_"
    stat = f"anon 5\n{total}inactive_file {cached}\n{total}active_file 7"
    return {
        f"{folder}/memory.{name}": text
        for name, text in zip((*names, "stat"), (limit, used, stat), strict=True)
    }


@pytest.mark.parametrize(
    "groups,files,expected",
    [
        ("0::/", {}, MACHINE),  # no limit at all: the outermost group has none of these files
        ("0::/", group("sys/fs/cgroup", 1 << 30, 1 << 20), (1 << 30) - (1 << 20)),
        ("0::/", group("sys/fs/cgroup", "max", 1 << 20), MACHINE),
        ("0::/", group("sys/fs/cgroup", 1000, 900, 300), 400),
        ("0::/", group("sys/fs/cgroup", 1000, 1100), 0),
        ("0::/", group("sys/fs/cgroup", 1 << 40, 0), MACHINE),
        ("0::/a/b", group("sys/fs/cgroup/a", 1000, 1) | group("sys/fs/cgroup/a/b", "max", 1), 999),
        ("0::/a/b", group("sys/fs/cgroup/a", 1000, 1) | group("sys/fs/cgroup/a/b", 500, 1), 499),
        (
            "5:cpu,cpuacct:/x\n4:memory:/docker/f00",
            group("sys/fs/cgroup/memory", 1000, 100, 10, version=1),
            910,
        ),
        ("4:memory:/x", group("sys/fs/cgroup/memory/x", 2**63 - 4096, 100, version=1), MACHINE),
    ],
)  # fmt: skip
def test_a_container_has_what_its_control_group_leaves(tmp_path, groups, files, expected):
    assert available_memory(system(tmp_path, groups, files)) == expected


@pytest.mark.skipif(sys.platform != "linux", reason="the system does not state what is free")
def test_this_machine_states_what_is_free():
    assert 1 << 20 < available_memory() < 1 << 50


def test_without_proc_it_is_all_memory_or_unknown(tmp_path):
    found = available_memory(tmp_path)
    assert found is None or found > 1 << 20


def test_grids_larger_than_memory_are_refused_with_the_estimate(monkeypatch):
    free = 8_000_000_000
    monkeypatch.setattr(memory, "available_memory", lambda: free)
    memory.check_memory(128 * 128)
    with pytest.raises(
        InputError, match=r"a grid of 16777216 pixels needs about 83.9 GB to be written, but 8.0 GB are free"
    ):
        memory.check_memory(4096 * 4096)
    monkeypatch.setattr(memory, "available_memory", lambda: None)
    memory.check_memory(4096 * 4096)
