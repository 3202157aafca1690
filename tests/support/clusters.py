"""A real dask scheduler with real workers, each in a process of its own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def started(arguments, log, words, environment):
    """A process whose output goes to a file, once that holds what the words match; and the match."""
    with log.open("wb") as stream:
        process = subprocess.Popen(
            [sys.executable, "-W", "ignore", "-m", *arguments],
            stdout=stream, stderr=subprocess.STDOUT, env=os.environ | environment,
        )  # fmt: skip
    while True:
        result = re.search(words, log.read_text("utf-8", "replace"))
        if result:
            return process, result
        assert process.poll() is None, log.read_text("utf-8", "replace")
        time.sleep(0.05)


@contextmanager
def cluster(
    folder: Path, workers: int = 2, **environment: str
) -> Iterator[tuple[str, list[subprocess.Popen]]]:
    """Address of a scheduler on this machine, and its workers; all are killed in the end."""
    arguments = ["distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    words = r"Scheduler at: +(tcp://127\.0\.0\.1:\d+)"
    scheduler, match = started(arguments, folder / "scheduler.log", words, environment)
    processes = [scheduler]
    address = match.group(1)
    try:
        for number in range(1, workers + 1):
            arguments = [
                "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard",
                "--name", f"w{number}", "--local-directory", str(folder / f"worker{number}"),
            ]  # fmt: skip
            log = folder / f"worker{number}.log"
            processes.append(started(arguments, log, "Registered to", environment)[0])
        yield address, processes[1:]
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()
