"""A child process: requests to stop and kills, its output, and its end."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import work
from children import all_end, descendants
from crossfield.models.processes.child import Child, KilledError
from crossfield.models.processes.child_program import WorkerError
from crossfield.models.processes.deadline import Deadline

pytestmark = pytest.mark.smoke


class Clock:
    """A clock that stands still until the work has begun, and then runs faster than others by a factor."""

    def __init__(self, begun: Path, speed: float):
        self.begun, self.speed, self.begin = begun, speed, None

    def __call__(self) -> float:
        if self.begin is None and self.begun.exists():
            self.begin = time.monotonic()
        return 0.0 if self.begin is None else self.speed * (time.monotonic() - self.begin)


@pytest.fixture
def child():
    with Child() as process:
        yield process


@pytest.mark.parametrize("waits,answer", [(work.until_stopped, "stopped"), (work.hooked, ["hook"])])
def test_work_is_asked_to_stop_at_its_deadline(child, tmp_path, waits, answer):
    begun = tmp_path / "begun"
    answered = child.call(waits, begun, deadline=Deadline.after(1e-3, Clock(begun, 0.01)))
    assert answered == (answer, False)
    assert child.call(abs, -3) == (3, False)


def test_work_that_does_not_stop_is_killed(child, tmp_path):
    begun = tmp_path / "begun"
    with pytest.raises(KilledError, match="did not stop at its time limit") as caught:
        child.call(work.deaf, begun, deadline=Deadline.after(1e-3, Clock(begun, 10.0)))
    assert not caught.value.interrupted
    assert child.call(abs, -3).value == 3


def test_what_work_prints_goes_to_its_log(child, tmp_path):
    log = tmp_path / "log"
    child.call(work.prints, log=log)
    assert sorted(log.read_text().splitlines()) == ["an error", "from C", "from Python"]
    assert child.call(abs, -1, log=tmp_path / "other").value == 1
    assert (tmp_path / "other").read_text() == ""


def test_failures_are_named(child):
    with pytest.raises(WorkerError, match="a process ended before its work was done: it ended with code 3"):
        child.call(os._exit, 3)
    with pytest.raises(WorkerError, match=r"it was killed by signal SIGABRT\Z"):
        child.call(signal.raise_signal, signal.SIGABRT)
    with pytest.raises(WorkerError, match="a task cannot be sent to a process: TypeError: cannot pickle"):
        child.call(abs, threading.Lock())
    with pytest.raises(WorkerError, match="cannot be sent back"):
        child.call(open, os.devnull)
    with pytest.raises(ValueError, match="'three'") as caught:
        child.call(int, "three")
    assert "in _answer" in caught.value.__notes__[0]
    assert child.call(abs, -3).value == 3


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs signals of POSIX")
@pytest.mark.parametrize("dead_before_it_is_asked", [False, True])
def test_a_child_that_was_killed_is_replaced(child, dead_before_it_is_asked):
    child.call(abs, -3)
    process = child._process
    process.kill()
    if dead_before_it_is_asked:
        process.wait()
    with pytest.raises(WorkerError, match=r"SIGKILL.*lack of memory"):
        child.call(time.sleep, 600)
    assert child.call(abs, -3).value == 3


PARENT = """
import sys, work
from pathlib import Path
from crossfield.models.processes.child import Child
with Child() as child:
    found = child.call(getattr(work, sys.argv[1]), Path(sys.argv[2]))
    print(found.value, found.interrupted)
"""


def parent(name, begun):
    """A process whose child works, once it does."""
    folder = Path(work.__file__).parent
    program = f"import sys; sys.path.append({str(folder)!r})\n{PARENT}"
    process = subprocess.Popen(
        [sys.executable, "-c", program, name, begun],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while not begun.exists():
        assert process.poll() is None, process.communicate()
    return process


@pytest.mark.parametrize("name", ["SIGKILL", "SIGTERM"])
def test_a_child_ends_with_its_parent(tmp_path, name):
    with parent("deaf", tmp_path / "begun") as process:
        theirs = descendants(process.pid)
        process.send_signal(getattr(signal, name))
    assert theirs
    assert all_end(theirs)


def test_the_first_interrupt_asks_the_work_to_stop(tmp_path):
    with parent("until_stopped", tmp_path / "begun") as process:
        theirs = descendants(process.pid)
        process.send_signal(signal.SIGINT)
        assert process.communicate() == ("stopped True\n", "")
    assert all_end(theirs)


def test_the_second_interrupt_kills_the_work_and_is_raised(tmp_path):
    with parent("deaf", tmp_path / "begun") as process:
        theirs = descendants(process.pid)
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        assert "KeyboardInterrupt" in process.communicate()[1]
    assert all_end(theirs)


def test_a_child_whose_parent_is_gone_at_its_start_ends_without_a_word():
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-c", "from crossfield.models.processes.child_program import main; main()"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=writer, stderr=subprocess.PIPE) as process:
        assert process.stderr.read() == b""
    os.close(writer)
