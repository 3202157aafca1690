"""One run in a process of its own: pinned to a core, on one thread, with a limit of time and memory."""

from __future__ import annotations

import os
import re
import resource
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import crossfield as cf
import numpy as np
from crossfield.export.formats.registry import program_version
from crossfield.export.solving.local import Solvers
from crossfield.models.errors import SolutionError, SolverError, UnsupportedBySolverError
from crossfield.models.field.field import Norm
from crossfield.models.formulations.problem import Problem, with_windows
from crossfield.models.formulations.windows import Windows
from crossfield.models.instance.instance import Instance
from crossfield.models.proof.certificate import read_certificate
from crossfield.models.proof.compiling import compile_all
from crossfield.models.proof.tightening import remaining_windows
from crossfield.models.storage import replacing
from machine import processor_name

from ..rows import Row
from .logs import progress, root_bound
from .plan import PROVE, QUICK, Run, make_instance
from .statistics import DISCARDED, FAILED, GAP, TOO_LARGE, integral, is_solved

MEMORY: Final = 8 << 30
"""Bytes of address space of each process."""
SHARE: Final = 0.05
"""Largest share of a run's seconds that its core may spend on other work."""
SLACK: Final = 0.1
"""Seconds of other work that no run is discarded for: clocks count hundredths of a second."""
_TICKS: Final = os.sysconf("SC_CLK_TCK")


def measure_run(run: Run, core: int, left: float, certificates: Path, slack: float = SLACK) -> Row:
    """The row of a run on a core, ended after `left` seconds.

    certificates: folder of those of `prove`. slack: seconds of other work that are tolerated.
    """
    os.sched_setaffinity(0, {core})
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    most = int(2 * run.limit) + 120
    resource.setrlimit(resource.RLIMIT_CPU, (most, most))
    watch = Watch(core, run.limit, time.monotonic() + left, slack, inside=run.solver == PROVE)
    problem = cf.formulate(make_instance(run.instance, run.turns), run.formulation)
    facts: Row = {
        "pairs": len(problem.instance.grid.first), "integers": int(problem.integer.sum()),
        "columns": problem.n_columns, "machine": _machine(),
    }  # fmt: skip
    if run.solver == PROVE:
        return facts | _proven(run, watch, certificates)
    if run.start == "tightened":
        problem = _narrowed(run, problem, watch, certificates)
    return facts | _solved(run, problem, watch)


def _machine() -> str:
    return f"{processor_name()}, {os.cpu_count()} cores"


@dataclass
class Watch:
    """Clocks of a run: its own processes, and all other work on its core, since `begin`.

    end: time of the monotonic clock at which the study ends. inside: whether this process does the work;
    otherwise its children do.
    """

    core: int
    limit: float
    end: float
    slack: float = SLACK
    inside: bool = False
    seen: float = 0.0

    def begin(self) -> None:
        """Start the clocks."""
        self.began = time.monotonic()
        self._own, self._all, self._busy = *own_seconds(inside=self.inside), busy_seconds(self.core)

    def row(self) -> Row:
        """Times of the run up to now; its status if it is to be repeated."""
        own, everything = own_seconds(inside=self.inside)
        beside = max(0.0, busy_seconds(self.core) - self._busy - (everything - self._all))
        wall = time.monotonic() - self.began
        facts: Row = {"cpu": own - self._own, "wall": wall, "beside": beside}
        repeated = beside > self.slack + SHARE * wall or self.is_over()
        return facts | ({"status": DISCARDED} if repeated else {})

    def is_over(self) -> bool:
        """Whether the study ends."""
        return time.monotonic() > self.end

    def late(self) -> bool:
        """Whether the study ends, or other work disturbs the run; looks once a second after the first two."""
        now = time.monotonic()
        if now < max(self.seen + 1, self.began + 2):
            return self.is_over()
        self.seen = now
        return self.row().get("status") == DISCARDED


def own_seconds(*, inside: bool) -> tuple[float, float]:
    """CPU seconds of the descendants of this process, with its own if `inside`; and of all together."""
    of: dict[int, tuple[int, float, float]] = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            words = path.read_text().rpartition(")")[2].split()
        except OSError:  # it has just ended
            continue
        ticks = [int(word) / _TICKS for word in words[11:15]]  # the last two are of its ended children
        of[int(path.parent.name)] = int(words[1]), sum(ticks), sum(ticks[:2])
    mine = {os.getpid()}
    while more := {pid for pid, (parent, *_) in of.items() if parent in mine} - mine:
        mine |= more
    everything = sum(of[pid][1] for pid in mine)
    return everything - (0.0 if inside else sum(of[os.getpid()][2:])), everything


def busy_seconds(core: int) -> float:
    """Seconds in which a core was not idle, or was taken by the host of a virtual machine."""
    line = re.search(rf"^cpu{core} (.*)$", Path("/proc/stat").read_text(), re.MULTILINE)
    assert line is not None
    user, nice, system, _idle, _wait, *rest = map(int, line[1].split())
    return (user + nice + system + sum(rest[:3])) / _TICKS


def _norm(run: Run) -> Norm:
    return 1 if run.formulation == "milp-mccormick" else 2


def _certificate(run: Run, folder: Path) -> Path:
    return folder / f"{run.instance.replace(' ', '_')}.{_norm(run)}.npz"


def _proven(run: Run, watch: Watch, certificates: Path) -> Row:
    """The row of a proof, its certificate included."""
    compile_all(orthogonal=False)
    cf.prove(
        make_instance(*QUICK.turned), norm=_norm(run), limits=cf.Limits(gap=0), jobs=1
    )  # loads the functions
    watch.begin()
    limits = cf.Limits(run.limit, gap=0)
    proof = cf.prove(
        make_instance(run.instance, run.turns), norm=_norm(run), limits=limits, jobs=1, stop=watch.late
    )
    cf.write_certificate(proof, _certificate(run, certificates), force=True)
    facts = {"version": program_version(), "status": proof.status, "note": proof.ended}
    return facts | {"objective": proof.energy, "bound": proof.bound} | watch.row()


def _narrowed(run: Run, problem: Problem, watch: Watch, certificates: Path) -> Problem:
    """The problem in the windows of its certificate, which is made again where it is missing."""
    path = _certificate(run, certificates)
    if not path.exists():
        limits = cf.Limits(run.limit, gap=0)
        proof = cf.prove(problem.instance, norm=_norm(run), limits=limits, jobs=1, stop=watch.is_over)
        cf.write_certificate(proof, path)
    return with_windows(problem, _windows(path, problem.instance))


def _windows(path: Path, instance: Instance) -> Windows:
    """The windows of a certificate, kept next to it: its check may take longer than a run."""
    cache = path.with_suffix(".windows.npz")
    if not cache.exists() or cache.stat().st_mtime < path.stat().st_mtime:
        with replacing(cache) as file:
            np.savez(file, **asdict(remaining_windows(read_certificate(path, on=instance))))
    with np.load(cache) as arrays:
        return Windows(**{name: array if array.ndim else array.item() for name, array in arrays.items()})


def _solved(run: Run, problem: Problem, watch: Watch) -> Row:
    """The row of a solver: its answer to the written file."""
    with Solvers() as solvers, tempfile.TemporaryDirectory(prefix="crossfield-study-") as folder:
        facts: Row = {"version": solvers.version(run.solver)}
        watch.begin()
        try:
            solution = solvers.solve(
                problem, run.solver, folder=folder, limits=cf.Limits(run.limit, GAP, 1), stop=watch.late
            )
        except UnsupportedBySolverError as error:
            return facts | {"status": TOO_LARGE, "note": str(error)}
        except (SolverError, SolutionError) as error:
            return facts | {"status": FAILED, "note": str(error).replace(folder, "")} | watch.row()
        facts |= {
            "status": str(solution.status),
            "note": solution.doubt,
            "bound": solution.bound,
            "nodes": solution.nodes,
        }
        facts["objective"] = None if solution.point is None else solution.objective
        facts |= watch.row()
        (log,) = Path(folder).glob("*.log")
        text = log.read_text(errors="replace")
        steps = list(progress(run.solver, text))
        last = (facts["wall"], facts["bound"], facts["objective"])
        area = (
            None if not steps else integral([*steps, last], run.limit, solved=is_solved(facts | asdict(run)))
        )
        return facts | {"integral": area, "root_bound": root_bound(run.solver, text)}
