"""Processes of the tests' own: programs that are interrupted, as by Ctrl-C on a terminal,
what they complain of, and who is left of whom.
"""

import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from crossfield.models.processes.process_groups import start_group


def interrupted(program: str, folder: Path | None = None) -> list[str]:
    """The words of the last line that a Python program prints when Ctrl-C comes after its first line,
    a number; it must end well. folder: where it runs.
    """
    command = [sys.executable, "-c", program]
    child = start_group(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder)
    assert int(child.stdout.readline()) > 0
    child.send_signal(signal.SIGINT)
    out, err = child.communicate()
    assert (child.returncode, err) == (0, "")
    return out.splitlines()[-1].split()


def within_memory(program: str, folder: Path, gigabytes: float = 2.0) -> str:
    """What a Python program prints in a process of its own with so much address space; it must end well."""
    limit = f"import resource\nresource.setrlimit(resource.RLIMIT_AS, 2 * [{int(gigabytes * 2**30)}])\n"
    command = [sys.executable, "-c", limit + program]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def complaints(err: str) -> str:
    """Standard error without the lines that say, every few seconds, what is being done."""
    return re.sub(r"^\[\d+ s\] .*\n", "", err, flags=re.MULTILINE)


def running() -> dict[int, tuple[int, int]]:
    """The parent and the group of every process that runs;
    those that have ended and were not waited for are left out.
    """
    processes = {}
    require_proc()
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended meanwhile
            state, parent, group, *_ = path.read_text("utf-8", "replace").rpartition(")")[2].split()
            if state not in "ZX":
                processes[int(path.parent.name)] = (int(parent), int(group))
    return processes


def require_proc() -> None:
    """Skip the test on systems that do not list their processes in /proc."""
    if not Path("/proc/self/stat").exists():
        pytest.skip("this system has no /proc, which lists the processes that run")


def command_lines() -> dict[int, bytes]:
    """The command line of every process; nothing between its words but a zero byte."""
    require_proc()
    lines = {}
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # it has ended meanwhile
            lines[int(path.parent.name)] = path.read_bytes()
    return lines


def descendants(ancestor: int) -> set[int]:
    """The processes that run and that a process, or one of these, has started."""
    parents = {pid: parent for pid, (parent, _) in running().items()}
    family = {ancestor}
    while more := {pid for pid, parent in parents.items() if parent in family} - family:
        family |= more
    return family - {ancestor}


def all_end(processes: set[int], seconds: float = 60.0) -> bool:
    """Whether all of these processes end; waits no longer than so many seconds."""
    limit = time.monotonic() + seconds
    while processes & set(running()):
        if time.monotonic() > limit:
            return False
        time.sleep(0.1)
    return True
