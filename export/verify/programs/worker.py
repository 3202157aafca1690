"""A program in a child process, this module with its name: a task a line, an answer a line, both JSON.

A crash or a hang of a program takes the child alone: `Worker` notes it for that task and starts another child
for the next. Arrays go through .npz files in the worker's folder. What a program prints goes to a log.
"""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
import time
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any, Final, Self

from ....models.processes.groups import ending, kill, start
from .protocol import NotTold, Refused, TooLarge
from .reading import Points, load, save

GRACE: Final = 20.0
"""Seconds that a task may take beyond its limit: for reading, and for solvers slow to look at the clock."""


class Worker:
    """A program's child process and its folder; `ask` it, and close it."""

    def __init__(self, program: str, folder: Path) -> None:
        """Start nothing yet."""
        self._program = program
        self._folder = folder
        self._child: subprocess.Popen[str] | None = None
        self._answers: queue.Queue[str] = queue.Queue()

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the child and whatever it started."""
        self._stop()

    def ask(self, task: dict[str, Any], seconds: float) -> dict[str, Any]:
        """The answer to a task; one of the kind `failed` when the child dies over it or takes too long."""
        child = self._running()
        assert child.stdin is not None
        limit = seconds + GRACE
        with suppress(BrokenPipeError):  # of a child that is dead already: its end says how it died
            child.stdin.write(json.dumps(task) + "\n")
            child.stdin.flush()
        try:
            answer = self._answers.get(timeout=limit)
        except queue.Empty:
            self._stop()
            return {"kind": "failed", "words": f"took longer than {limit:g} s and was ended"}
        if answer:
            parsed: dict[str, Any] = json.loads(answer)
            return parsed
        code = child.wait()
        self._stop()
        return {"kind": "failed", "words": f"{ending(code)}: {self._last_words()}"}

    def _running(self) -> subprocess.Popen[str]:
        if self._child is None:
            self._folder.mkdir(parents=True, exist_ok=True)
            # -P: a folder `crossfield` or a file casadi.py where the user happens to be is not meant.
            self._child = start(
                [sys.executable, "-P", "-m", "crossfield.export.verify.programs.worker", self._program],
                cwd=self._folder,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                encoding="ascii",
            )
            self._answers = queue.Queue()
            threading.Thread(target=self._listen, args=(self._child, self._answers), daemon=True).start()
        return self._child

    @staticmethod
    def _listen(child: subprocess.Popen[str], answers: queue.Queue[str]) -> None:
        """Hand over each line, and an empty one at the end."""
        assert child.stdout is not None
        with child.stdout as lines:
            for line in lines:
                answers.put(line)
        answers.put("")

    def _stop(self) -> None:
        child, self._child = self._child, None
        if child is None:
            return
        kill(child)
        child.wait()
        if child.stdin is not None:
            with suppress(BrokenPipeError):  # what was not yet written goes with the child
                child.stdin.close()

    def _last_words(self) -> str:
        log = self._folder / _LOG
        lines = log.read_text("utf-8", "replace").strip().splitlines() if log.exists() else []
        return lines[-1][:200] if lines else "nothing in its log"


_LOG: Final = "log.txt"


def answer_to(module: Any, task: dict[str, Any]) -> dict[str, Any]:
    """The answer of a program's module to a task, its arrays saved where the task says."""
    try:
        if task["step"] == "version":
            return {"kind": "done", "words": module.version()}
        begin = time.perf_counter()
        found = _result(module, task)
        spent = time.perf_counter() - begin
        save(found, Path(task["result"]))
    except Refused as refused:
        return {"kind": "refused", "words": " ".join(str(refused).split())}
    except NotTold as untold:
        return {"kind": "not told", "words": str(untold)}
    except TooLarge:
        return {"kind": "too large", "words": ""}
    except Exception as error:  # noqa: BLE001 - programs raise what they like, and the other tasks go on
        return {"kind": "failed", "words": " ".join(f"{type(error).__name__}: {error}".split())[:300]}
    return {"kind": "done", "words": "", "seconds": spent}


def _result(module: Any, task: dict[str, Any]) -> Any:
    path = Path(task["path"])
    if task["step"] == "read":
        return module.read(path)
    if task["step"] == "evaluate":
        return module.evaluate(path, load(Points, Path(task["points"])))
    start = {"start": Path(task["start"])} if task.get("start") else {}
    return module.solve(path, task["seconds"], task["solver"], task.get("gap", 0.0), **start)


def main(arguments: list[str]) -> int:
    """0 when there are no more tasks."""
    (program,) = arguments
    answers = os.fdopen(os.dup(1), "w", encoding="ascii")
    with Path(_LOG).open("wb") as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
    module = import_module(f"crossfield.export.verify.programs.{program}")
    for line in sys.stdin:
        answers.write(json.dumps(answer_to(module, json.loads(line))) + "\n")
        answers.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
