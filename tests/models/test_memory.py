"""Free memory as Linux states it."""

import sys

import pytest
from crossfield.models import memory
from crossfield.models.errors import InputError
from crossfield.models.memory import available_memory


@pytest.mark.skipif(sys.platform != "linux", reason="the system does not state what is free")
def test_this_machine_states_what_is_free():
    assert 1 << 20 < available_memory() < 1 << 50


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
