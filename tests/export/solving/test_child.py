"""A solver in a child process: who is interrupted, killed, let go on, and that none outlives its parent."""

import signal
import subprocess
import sys
import time

import crossfield as cf
import pytest
from children import all_end, descendants
from crossfield.export.solutions.readers.text import Status
from crossfield.export.solving.child import run_child
from crossfield.models.errors import SolverError
from crossfield.models.processes.deadline import Deadline

SLEEPS = "import time\nprint('solving', flush=True)\ntime.sleep(600)"
DEAF = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n" + SLEEPS
HEARS = "import signal, sys\nsignal.signal(signal.SIGINT, lambda *_: sys.exit(7))\n" + SLEEPS
SILENT = "import time\ntime.sleep(600)"
QUICK = "print('solving')"


class Clock:
    """A clock that stands still until the child listens, and then goes so many times as fast as others."""

    def __init__(self, log, speed):
        self.log, self.speed, self.begin = log, speed, None

    def __call__(self):
        if self.begin is None and self.log.exists() and self.log.stat().st_size:
            self.begin = time.monotonic()
        return 0.0 if self.begin is None else self.speed * (time.monotonic() - self.begin)


@pytest.mark.parametrize("program,speed,code", [(HEARS, 0.01, 7), (DEAF, 10, -signal.SIGKILL)])
def test_a_child_that_goes_on_is_interrupted_and_killed_if_it_does_not_hear(tmp_path, program, speed, code):
    log = tmp_path / "log"
    ending = run_child([sys.executable, "-c", program], log, Deadline.after(1e-3, Clock(log, speed)))
    assert ending == (code, False)
    assert log.read_text() == "solving\n"


@pytest.mark.parametrize(
    "program,seconds,code",
    [(QUICK, 600.0, 0), (SILENT, 1.0, -signal.SIGKILL), (QUICK, -1.0, -signal.SIGKILL)],
)
def test_a_child_that_has_nothing_to_hand_over_is_killed_at_its_deadline(tmp_path, program, seconds, code):
    ending = run_child([sys.executable, "-c", program], tmp_path / "log", Deadline.after(seconds))
    assert ending == (code, False)
    assert ending.killed == (code == -signal.SIGKILL)


PARENT = """
import sys
from pathlib import Path
from crossfield.export.solving.child import run_child
from crossfield.models.processes.deadline import Deadline
run_child([sys.executable, *sys.argv[2:]], Path(sys.argv[1]), Deadline.after(600))
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_solver_ends_with_the_process_that_started_it(tmp_path, number):
    """Whether that is killed or asked to end; the solver would go on for ten minutes."""
    hard = cf.sample("mouse", 12)
    cf.write(cf.formulate(hard, "miqp-exact"), tmp_path / "model.nl")
    solver = [
        "-m",
        "crossfield.export.solving.casadi_driver",
        "bonmin",
        "model.nl",
        "model.sol",
        "1e-6",
        "stamp",
        "600",
    ]
    log = tmp_path / "log"
    with subprocess.Popen([sys.executable, "-c", PARENT, log, *solver], cwd=tmp_path) as parent:
        while not (log.exists() and log.stat().st_size):
            assert parent.poll() is None
        theirs = descendants(parent.pid)
        parent.send_signal(number)
    assert theirs
    assert all_end(theirs)


@pytest.mark.parametrize("name", ["qp-fixed", "miqp-exact"])
def test_without_time_the_start_is_the_answer(tmp_path, name):
    """No solver is started then; a feasible start is the best point so far."""
    instance = cf.sample("skew", 6)
    start = cf.greedy(instance)
    problem = cf.formulate(instance, name, p=start.p if name == "qp-fixed" else None)
    found = cf.solve(problem, folder=tmp_path, start=start, limits=cf.Limits(1e-6))
    assert found.status == Status.LIMIT_WITH_POINT
    assert "nothing better than the start" in found.message
    assert found.objective == pytest.approx(start.energy().total, rel=1e-9)
    assert not list(tmp_path.glob("*.log"))
    with pytest.raises(SolverError, match="left no answer within its time; give it more, or a start"):
        cf.solve(problem, limits=cf.Limits(1e-6))


def test_the_second_stage_keeps_a_part_of_the_time():
    from crossfield.export.solving.two_stage import jumps_until

    now = [0.0]
    for seconds, kept in ((60, 12.0), (10, 2.0), (6, 2.0), (2, 1.0), (0.1, 0.05), (0, 0.0)):
        whole = Deadline.after(seconds, lambda: now[0])
        assert whole.at - jumps_until(whole).at == pytest.approx(kept)


def test_limits_become_what_is_left():
    now = [0.0]
    deadline = Deadline.after(10.0, lambda: now[0])
    limits = cf.Limits(60.0, 1e-3, 2)
    assert limits.until(deadline) == cf.Limits(10.0, 1e-3, 2)
    now[0] = 20.0
    assert 0 < limits.until(deadline).seconds < 0.1


def test_the_driver_of_a_solver_loads_neither_formulas_nor_writers():
    code = "import sys, crossfield.export.solving.casadi_driver; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "casadi" in done.stdout.split()
    assert not {"sympy", "scipy", "jinja2", "highspy"} & set(done.stdout.split())


def test_highs_without_time_leaves_the_start_and_tells_no_bound(tmp_path):
    instance = cf.sample("skew", 6)
    start, problem = cf.greedy(instance), cf.formulate(instance, "milp-mccormick")
    found = cf.solve(problem, "highs", tmp_path, start=start, limits=cf.Limits(1e-6))
    assert found.objective == pytest.approx(problem.objective_value(problem.point(start)), rel=1e-9)
    assert found.bound is None
    assert not list(tmp_path.glob("*.log"))
