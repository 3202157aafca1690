"""Programs of the tests' own that are interrupted, as by Ctrl-C on a terminal."""

import os
import signal
import subprocess
import sys


def interrupted(program: str) -> list[str]:
    """The words of the last line that a Python program prints when Ctrl-C comes after its first line, a number; it must end well."""
    child = subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert int(child.stdout.readline()) > 0
    os.killpg(child.pid, signal.SIGINT)
    out, err = child.communicate(timeout=60)
    assert (child.returncode, err) == (0, "")
    return out.splitlines()[-1].split()
