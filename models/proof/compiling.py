"""Compilation of the functions of proofs, once per machine, in a child process that can be stopped.

Two such processes wait for each other, and the second finds everything compiled.
"""

from __future__ import annotations

import gc
import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import numpy as np
from filelock import FileLock

from ..errors import CrossfieldError, SolverError
from ..instance.instance import Instance
from ..instance.mesh import Mesh
from ..processes.child import Child, KilledError
from ..processes.child_program import WorkerError
from ..processes.compilation import cache_folder, crew, is_all_compiled
from ..processes.deadline import Deadline, IsOver, Progress, never, silent
from ..search.greedy import greedy_field
from ..storage import temporary_folder
from .bound import branches, charges, orthogonal_dual
from .bound.dual import Dual
from .bound.lattice import Lattice
from .bound.pruning import finer_lattice
from .bound.rounding import decode
from .descent.descent import Termination
from .descent.orthogonal import prove_orthogonal


@contextmanager
def compile_in_background(*, orthogonal: bool) -> Iterator[None]:
    """Compile the functions of proofs in the background, unless they are; stop at the end of the context."""
    if _is_compiled(orthogonal):
        yield
        return
    with Child() as child:
        threading.Thread(target=_compile_in, args=(child, orthogonal), daemon=True).start()
        yield


def _compile_in(child: Child, orthogonal: bool) -> None:
    with suppress(CrossfieldError):  # the child was ended, or fails again when a proof needs the functions
        child.call(compile_all, orthogonal)


def compile_proofs(progress: Progress, stop: IsOver = never, *, orthogonal: bool) -> bool:
    """Compile the functions of proofs unless they are; return False where `stop` or Ctrl-C ended that.

    orthogonal: whether of crosses with right angles, which have proofs of their own. It takes up to half a
    minute, and no time limit includes it. What is compiled by the end stays. progress: receives a line if
    there is something to compile. Raises SolverError when the work fails.
    """
    if _is_compiled(orthogonal):
        return True
    progress("compiling the functions of proofs, once on this machine, before the time limit begins")
    with temporary_folder() as folder, Child() as child:
        log = folder / "log"
        try:
            return not child.call(compile_all, orthogonal, log=log, stop=stop).interrupted
        except KilledError:
            return False
        except WorkerError as error:
            lines = log.read_text("utf-8", "replace").split("\n") if log.exists() else []
            words = "; ".join([str(error), *filter(None, lines[-2:])])
            raise SolverError(f"the functions of proofs were not compiled: {words}") from error


def compile_all(orthogonal: bool) -> None:
    """Compile the functions of proofs, by a proof of a few pixels or by the steps of one."""
    if _is_compiled(orthogonal):
        return
    with FileLock(cache_folder() / "compiling.lock"), _without_collection():
        if _is_compiled(orthogonal):
            return
        corners, theta = [[0, 0], [0, 2], [2, 0], [2, 2]], [0.1, 0.9, 0.8, 0.0]  # a proof that uses rings
        mask, w = np.ones((3, 3), dtype=bool), np.ones(4)
        instance = Instance.on_pixels("small", mask, corners, theta, w, orthogonal=orthogonal)
        if orthogonal:
            points = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 1], [1, 1, 1]], float)
            faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 4], [2, 3, 4], [3, 1, 4]]
            pyramids, none = Mesh(points, np.array(faces, np.int32)), np.zeros(0)
            strokeless = Instance.on_faces("small", pyramids, none.astype(int), none, none, orthogonal=True)
            for small in (instance, strokeless):  # the second has charges, and branches on them
                prove_orthogonal(small, None, Termination(Deadline(), never, gap=0.0, work=math.inf), silent)
            return
        field = greedy_field(instance)
        with crew(1) as thread:
            dual = Dual(Lattice.whole(field, 2), thread)
            dual.add_clusters(1, field)
            dual.ascend(1)
            decode(dual.state, forwards=True)
            dual.move(finer_lattice(dual.remaining_cells(dual.bound(), field.energy().total)))


@contextmanager
def _without_collection() -> Iterator[None]:
    """Context without the search for unused cycles of objects, a sixth of the time of a compiler."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _is_compiled(orthogonal: bool) -> bool:
    """Whether the functions of one of the two kinds of proofs are; they are in separate modules."""
    names = [module.__name__ for module in (branches, charges, orthogonal_dual)]
    return is_all_compiled(lambda module: (module in names) == orthogonal)
