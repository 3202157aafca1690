"""Threads that share a problem: none loses a cost, whoever computed the arrays.

`functools.cached_property` has no lock since Python 3.12, so that two threads may each compute a value, and
the second one replaces the first. On Python 3.11 it has one.
"""

from __future__ import annotations

import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from cases import make_instance, make_problem
from crossfield.models.formulations.problem import Problem

THREADS = 4


@pytest.fixture
def frequent_switches():
    """Make the interpreter switch threads as often as possible."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def costs_of(problem: Problem) -> tuple[list[list[int]], list[float]]:
    index, cost = problem.merged_objective(1)
    return index.tolist(), cost.tolist()


def spoiled(problems: int) -> int:
    """Number of problems that lose costs when several threads request them at once."""
    instance = make_instance()
    whole = costs_of(make_problem("milp-mccormick", instance))
    barrier = threading.Barrier(THREADS)

    def ask(problem: Problem) -> bool:
        barrier.wait()
        return costs_of(problem) == whole

    with ThreadPoolExecutor(THREADS) as pool:
        shared = (make_problem("milp-mccormick", instance) for _ in range(problems))
        return sum(not all(pool.map(ask, [problem] * THREADS)) for problem in shared)


def test_no_cost_is_lost_when_threads_share_a_problem(frequent_switches):
    assert spoiled(150) == 0
