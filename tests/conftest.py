"""Puts this folder on the path, so that test modules can import `cases` and `oracles`; says how many slow tests were left out."""

import os
import sys
from pathlib import Path

# pytest-xdist gives every core a test; linear algebra with as many threads in each would only wait for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parent))

import pytest
from hypothesis import HealthCheck, settings

# The same examples in every run: a chance find must not decide whether a change passes. `--hypothesis-profile=fuzz` draws others.
# Neither must the clock: how long an example takes on a busy machine says nothing.
settings.register_profile(
    "same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("fuzz", settings.get_profile("same"), derandomize=False, print_blob=True)
settings.load_profile("same")

SLOW = pytest.StashKey[int]()


@pytest.fixture(autouse=True)
def _needed_programs(request):
    marks = list(request.node.iter_markers("needs"))
    if marks:
        from oracles import require

        for mark in marks:
            require(*mark.args)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Before `-m` chooses: who needs a program is among the oracles, and slow tests are counted."""
    for item in items:
        if item.get_closest_marker("needs"):
            item.add_marker("oracles")
    config.stash[SLOW] = sum("slow" in item.keywords for item in items)


def pytest_sessionfinish(session):
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["slow"] = session.config.stash.get(SLOW, 0)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    """The count of a worker of pytest-xdist, where the process on the terminal collects nothing."""
    node.config.stash[SLOW] = getattr(node, "workeroutput", {}).get("slow", 0)


def pytest_terminal_summary(terminalreporter, config):
    left_out = config.stash.get(SLOW, 0)
    if left_out and config.option.markexpr == "not slow":
        terminalreporter.write_line(f"{left_out} slow tests were left out; run them with -m slow")
