"""Executors of a library's tasks: processes of the package, for any calling program."""

import subprocess
import sys

import pytest
from crossfield.export.library.building.executor import BuildError, open_tasks

TASKS = """import math
from crossfield.export.library.building.executor import open_tasks

print("the script runs")
with open_tasks(2) as tasks:
    for number in (16, 25):
        tasks.add(math.isqrt, number, lambda root: open(f"root_{root}", "w").close())
    tasks.run()
"""


def run_without_guard(script, folder):
    """Run a script without the guard `if __name__ == "__main__"`; it must be read only once."""
    (folder / "script.py").write_text(script, "utf-8")
    command = [sys.executable, "script.py"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "the script runs\n", "")


def test_a_script_without_a_guard_has_tasks_done_in_two_processes(tmp_path):
    run_without_guard(TASKS, tmp_path)
    assert {path.name for path in tmp_path.glob("root_*")} == {"root_4", "root_5"}


def test_a_process_that_ends_early_ends_the_build_with_its_exit_code():
    from os import _exit

    def build():
        with open_tasks(2) as tasks:
            tasks.add(_exit, 3, print)
            tasks.run()

    with pytest.raises(BuildError) as caught:
        build()
    assert str(caught.value) == (
        "a process ended before its work was done: it ended with code 3; complete files are kept"
    )
