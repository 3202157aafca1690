"""Work in several processes: answers in order, errors as raised, and no process left behind."""

import importlib
import os
import sys
import time

import crossfield as cf
import pytest
from children import descendants
from crossfield.models.processes.child_program import WorkerError
from crossfield.models.processes.job_counts import MOST_JOBS, check_jobs, cores
from crossfield.models.processes.process_pool import parallel_map, process_pool


def test_answers_come_in_the_order_of_the_tasks():
    for jobs in (1, 3):
        with parallel_map(int, jobs) as work:
            assert work([str(number) for number in range(20)]) == list(range(20))
            assert work([]) == []
            assert work(["7"]) == [7]


MODULE = """
import threading

class OwnConstructor(Exception):
    def __init__(self, place, cause):
        super().__init__(f"{cause} at {place}")

class Unpicklable(Exception):
    def __init__(self, text):
        super().__init__(text)
        self.lock = threading.Lock()

def work(task):
    if task == "own constructor":
        raise OwnConstructor("here", "nothing")
    if task == "unpicklable":
        raise Unpicklable("no way")
    if task == "long":
        from crossfield.models.errors import InputError
        raise InputError(2000 * "x", file="file")
    return threading.Lock() if task == "lock" else task
"""


@pytest.fixture
def module_of_a_user(tmp_path, monkeypatch):
    """A module next to the user's program, which this process finds without installation."""
    (tmp_path / "users_module.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    yield importlib.import_module("users_module")
    del sys.modules["users_module"]


NAMED = {
    "own constructor": "OwnConstructor: nothing at here",
    "unpicklable": "Unpicklable: no way",
    "lock": "the result of a task cannot be sent back: TypeError: cannot pickle '_thread.lock' object",
}


def test_what_cannot_be_sent_back_is_named_and_the_process_goes_on(module_of_a_user):
    with parallel_map(module_of_a_user.work, 2) as work:
        for task, message in NAMED.items():
            with pytest.raises(WorkerError) as caught:
                work([task])
            assert str(caught.value) == message
            assert "in _answer" in caught.value.__notes__[0]
        assert work(["a", "b"]) == ["a", "b"]


def test_an_error_of_ours_arrives_as_it_was(module_of_a_user):
    with parallel_map(module_of_a_user.work, 2) as work, pytest.raises(cf.InputError) as caught:
        work(["long"])
    with pytest.raises(cf.InputError) as here:
        module_of_a_user.work("long")
    assert (str(caught.value), caught.value.file) == (str(here.value), "file")


def test_an_error_in_this_process_waits_in_the_future_of_its_task():
    with process_pool(1) as chosen:
        one, wrong, three = (chosen.submit(int, text) for text in ("1", "x", "3"))
    assert (one.result(), three.result()) == (1, 3)
    assert isinstance(wrong.exception(), ValueError)


def test_no_process_stays_behind():
    """Neither after a good end, nor after an error of the caller's, nor while tasks are under way."""
    before = descendants(os.getpid())
    with parallel_map(abs, 2) as work:
        work([1, 2, 3])
        assert len(descendants(os.getpid()) - before) == 2
    assert descendants(os.getpid()) == before
    with pytest.raises(TypeError), parallel_map(abs, 2) as work:
        len(work([1, 2, 3])[0])
    assert descendants(os.getpid()) == before
    with parallel_map(time.sleep, 2) as work, pytest.raises(TypeError):
        work([None, 600])
    assert descendants(os.getpid()) == before


def test_a_file_where_the_user_happens_to_be_is_not_run(tmp_path, monkeypatch):
    (tmp_path / "pickle.py").write_text("raise SystemExit('taken for a library')")
    monkeypatch.chdir(tmp_path)
    with parallel_map(abs, 2) as work:
        assert work([-1, -2]) == [1, 2]


def test_how_many_may_be_asked_for_is_said():
    assert check_jobs(1) == 1
    assert check_jobs(MOST_JOBS) == MOST_JOBS >= 16
    for count in (0, -1, MOST_JOBS + 1, 100000):
        with pytest.raises(cf.InputError, match=f"jobs must be between 1 and {MOST_JOBS}, got {count}"):
            check_jobs(count)
    with pytest.raises(cf.InputError, match="got 100000"), parallel_map(abs, 100000):
        pass
    assert 1 <= cores() <= (os.cpu_count() or 1)
