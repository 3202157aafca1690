"""Work in several processes: answers in order, errors as raised, and no process left behind."""

import importlib
import os
import sys
import time

import pytest
from children import descendants
from crossfield.models.errors import InputError
from crossfield.models.processes.child_program import WorkerError
from crossfield.models.processes.job_counts import MOST, check_jobs, cores
from crossfield.models.processes.process_pool import parallel_map, process_pool


def test_answers_come_in_the_order_of_the_tasks():
    for jobs in (1, 3):
        with parallel_map(int, jobs) as work:
            assert work([str(number) for number in range(20)]) == list(range(20))
            assert work([]) == []
            assert work(["7"]) == [7]


def test_there_are_as_many_processes_as_tasks_and_jobs_allow():
    before = descendants(os.getpid())
    with parallel_map(time.sleep, 4) as work:
        assert work([0.0]) == [None]
        assert len(descendants(os.getpid()) - before) == 1
        work([0.3] * 9)
        assert 1 < len(descendants(os.getpid()) - before) <= 4


MODULE = """
import threading

class OwnConstructor(Exception):
    def __init__(self, place, cause):
        super().__init__(f"{cause} at {place}")

class Doubling(Exception):
    def __init__(self, text):
        super().__init__(f"code {text}")

class Unpicklable(Exception):
    def __init__(self, text):
        super().__init__(text)
        self.lock = threading.Lock()

def work(task):
    if task == "own constructor":
        raise OwnConstructor("here", "nothing")
    if task == "doubling":
        raise Doubling(7)
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


@pytest.mark.parametrize(
    "task,message",
    [
        ("own constructor", "OwnConstructor: nothing at here"),
        ("doubling", "Doubling: code 7"),
        ("unpicklable", "Unpicklable: no way"),
        ("lock", "the result of a task cannot be sent back: TypeError: cannot pickle '_thread.lock' object"),
    ],
)
def test_what_cannot_be_sent_back_is_named_and_the_process_goes_on(module_of_a_user, task, message):
    with parallel_map(module_of_a_user.work, 2) as work:
        with pytest.raises(WorkerError) as caught:
            work([task])
        assert str(caught.value) == message
        assert "in _answer" in caught.value.__notes__[0]
        assert work(["a", "b"]) == ["a", "b"]


def test_an_error_of_ours_arrives_as_it_was(module_of_a_user):
    with parallel_map(module_of_a_user.work, 2) as work, pytest.raises(InputError) as caught:
        work(["long"])
    with pytest.raises(InputError) as here:
        module_of_a_user.work("long")
    assert (str(caught.value), caught.value.file) == (str(here.value), "file")


def test_a_function_that_a_process_cannot_import_is_named(module_of_a_user, tmp_path):
    (tmp_path / "users_module.py").write_text("raise ImportError('half of it is missing')")
    with parallel_map(module_of_a_user.work, 2) as work, pytest.raises(WorkerError) as caught:
        work(["a"])
    expected = "cannot import the function of its task or read its data: ImportError: half of it is missing"
    assert expected in str(caught.value)


def test_a_task_is_sent_when_its_process_has_imported_the_work(tmp_path, monkeypatch):
    """A deadline in it counts from its arrival, and imports take seconds on a busy machine."""
    (tmp_path / "slow_work.py").write_text(
        "import os, pathlib\n"
        "pathlib.Path(__file__).with_suffix('.imported').touch()\n"
        "def work(task): return task\n"
    )
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    monkeypatch.syspath_prepend(str(tmp_path))
    from slow_work import work as slow

    flag = tmp_path / "slow_work.imported"
    flag.unlink()
    with parallel_map(slow, 2) as work:
        assert work([Sent(flag)]) == [True]


class Sent:
    """A task that turns into, when it is sent, whether a file exists."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return bool, (int(self.path.exists()),)


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_waits_in_the_future_of_its_task(jobs):
    with process_pool(jobs) as chosen:
        futures = [chosen.submit(int, text) for text in ("1", "x", "3")]
        assert (futures[0].result(), futures[2].result()) == (1, 3)
        with pytest.raises(ValueError, match="'x'"):
            futures[1].result()


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
    assert check_jobs(MOST) == MOST >= 16
    for count in (0, -1, MOST + 1, 100000):
        with pytest.raises(InputError, match=f"jobs must be between 1 and {MOST}, got {count}"):
            check_jobs(count)
    with pytest.raises(InputError, match="got 100000"), parallel_map(abs, 100000):
        pass
    assert 1 <= cores() <= (os.cpu_count() or 1)
