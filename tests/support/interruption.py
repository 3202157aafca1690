"""Commands in a child process that is interrupted or killed at one of its operations on files."""

import os
import signal
import sys
import warnings
from pathlib import Path

from command_line import invoke

WATCHED = {
    "open",
    "os.rename",
    "os.remove",
    "os.mkdir",
    "os.rmdir",
    "os.listdir",
    "os.chmod",
    "shutil.rmtree",
}


def run_command(arguments, folder, ends=None, at=0):
    """Run a command line in a forked process and return its exit code, negative if a signal ended it.

    ends: SIGINT or SIGKILL just before the `at`-th operation on a file in the folder; None: never. The output
    goes nowhere.
    """
    with warnings.catch_warnings(action="ignore"):  # Python 3.12 warns of threads, which tests do not hold
        process = os.fork()
    if process == 0:
        code = 70
        try:
            silence()
            if ends is not None:
                sys.addaudithook(ending_hook(Path(folder).absolute(), ends, at))
            code = invoke([str(argument) for argument in arguments])
        except KeyboardInterrupt:
            code = 130
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def silence():
    null = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(null, stream)


def ending_hook(folder, ends, at):
    """An audit hook that ends this process at its `at`-th operation on a file in a folder."""
    seen = 0

    def hook(event, arguments):
        nonlocal seen
        if event not in WATCHED or not str(arguments[0] if arguments else "").startswith(str(folder)):
            return
        seen += 1
        if seen == at:
            if ends == signal.SIGKILL:
                os.kill(os.getpid(), ends)
            raise KeyboardInterrupt

    return hook
