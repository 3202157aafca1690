"""Proofs of MIP solvers from the written files: cold, and with the windows of a certificate.

Each solve runs in a separate process, on two threads if the solver has threads.
"""

from __future__ import annotations

import math
import multiprocessing
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

import crossfield as cf
from crossfield.export.solvers_table import PROGRAMS
from crossfield.models.errors import InstanceError
from crossfield.models.field.field import Norm
from crossfield.models.formulations.problem import Problem, tightened
from crossfield.models.instance.instance import Instance
from crossfield.models.proof.certificate import Certificate, write_certificate
from crossfield.models.proof.prove import prove
from crossfield.models.proof.tightening import windows_left
from drawings import Sketch

THREADS: Final = 2
PROVEN: Final = 1e-6
"""Gap, relative to 1 or the objective if that is more, of an optimum that is proven."""
FREE: Final = {"gurobi": (2000, 200), "cplex": (1000, 1000)}
"""Columns and rows of free editions, and columns of problems with quadratic terms."""
Options = dict[str, Any]


@dataclass(frozen=True)
class Answer:
    """Result of a solver: best objective and dual bound, if any, and seconds."""

    objective: float | None
    bound: float | None
    nodes: int
    seconds: float

    @property
    def proven(self) -> bool:
        """Whether the bound equals the objective up to rounding."""
        if self.objective is None or self.bound is None:
            return False
        return self.objective - self.bound <= PROVEN * max(1.0, abs(self.objective))


def highs(path: Path, seconds: float, options: Options) -> tuple[float | None, float | None, int]:
    """Objective, dual bound and nodes of HiGHS."""
    from crossfield.export.programs.highs import loaded

    model = loaded(path, threads=THREADS, time_limit=seconds, mip_rel_gap=1e-7, **options)
    model.run()
    info = model.getInfo()
    return _finite(info.objective_function_value), _finite(info.mip_dual_bound), info.mip_node_count


def scip(path: Path, seconds: float, options: Options) -> tuple[float | None, float | None, int]:
    """Objective, dual bound and nodes of SCIP, which has one thread here."""
    import pyscipopt

    model = pyscipopt.Model()
    model.hideOutput()
    model.readProblem(str(path))
    for name, value in ({"limits/time": seconds, "limits/gap": 1e-7} | options).items():
        model.setParam(name, value)
    model.optimize()
    objective = model.getObjVal() if model.getNSols() else None
    return objective, _finite(model.getDualbound()), model.getNTotalNodes()


def gurobi(path: Path, seconds: float, options: Options) -> tuple[float | None, float | None, int]:
    """Objective, dual bound and nodes of Gurobi."""
    import gurobipy

    with (
        gurobipy.Env(params={"OutputFlag": 0}) as environment,
        gurobipy.read(str(path), environment) as model,
    ):
        for name, value in ({"TimeLimit": seconds, "MIPGap": 1e-7, "Threads": THREADS} | options).items():
            model.setParam(name, value)
        model.optimize()
        objective = model.ObjVal if model.SolCount else None
        return objective, _finite(model.ObjBound), int(model.NodeCount)


def cplex(path: Path, seconds: float, options: Options) -> tuple[float | None, float | None, int]:
    """Objective, dual bound and nodes of CPLEX."""
    import cplex as package

    model = package.Cplex()
    for stream in ("log", "results", "warning", "error"):
        getattr(model, f"set_{stream}_stream")(None)
    model.read(str(path))
    chosen = {"timelimit": seconds, "threads": THREADS, "mip.tolerances.mipgap": 1e-7} | options
    for name, value in chosen.items():
        attrgetter(name)(model.parameters).set(value)
    model.solve()
    answer = model.solution
    objective = answer.get_objective_value() if answer.is_primal_feasible() else None
    return objective, _finite(answer.MIP.get_best_objective()), answer.progress.get_num_nodes_processed()


def _finite(value: float) -> float | None:
    return None if abs(value) >= 1e19 else float(value)


SOLVES: Final[dict[str, Callable[[Path, float, Options], tuple[float | None, float | None, int]]]] = {
    each.__name__: each for each in (highs, scip, gurobi, cplex)
}


def _work(task: tuple[str, Path, float, Options]) -> Answer:
    solver, path, seconds, options = task
    begin = time.perf_counter()
    found = SOLVES[solver](path, seconds, options)
    return Answer(*found, time.perf_counter() - begin)


def solved(problem: Problem, solver: str, seconds: float, options: Options) -> Answer:
    """Solve the MPS file of a problem."""
    with (
        tempfile.TemporaryDirectory() as folder,
        ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as alone,
    ):
        path = Path(folder) / "model.mps"
        cf.write(problem, path)
        return alone.submit(_work, (solver, path, seconds, options)).result()


def fits(problem: Problem, solver: str) -> bool:
    """Whether the free edition of the solver takes the problem."""
    if solver not in FREE:
        return True
    most, most_quadratic = FREE[solver]
    linear = problem.objective_degree == 1
    return max(problem.n_columns, problem.n_rows) <= most and (linear or problem.n_columns <= most_quadratic)


def largest(name: str, size: int, formulation: str, solver: str) -> Instance:
    """The sample at that size, or at the greatest size below it that the solver's free edition takes."""
    for smaller in range(size, 4, -1):
        try:
            instance = Sketch(name, name).instance(smaller)
        except InstanceError:  # the outline leaves no room on so coarse a grid
            continue
        if fits(cf.formulate(instance, formulation), solver):
            return instance
    raise InstanceError(f"{name} has no size that {solver} takes")


SHIFT: Final = 1.0
SETTINGS: Final[tuple[tuple[str, str, str, Options], ...]] = (
    ("highs", "milp-mccormick", "default", {}),
    ("highs", "milp-mccormick", "`mip_heuristic_effort` 0", {"mip_heuristic_effort": 0.0}),
    ("highs", "milp-mccormick", "`mip_pscost_minreliable` 32", {"mip_pscost_minreliable": 32}),
    ("scip", "miqp-exact", "default", {}),
    (
        "scip",
        "miqp-exact",
        "full strong branching",
        {"branching/fullstrong/priority": 10**6},
    ),
    ("cplex", "miqp-exact", "default", {}),
    ("cplex", "miqp-exact", "`mip.strategy.miqcpstrat` 1 (QP at nodes)", {"mip.strategy.miqcpstrat": 1}),
    ("cplex", "miqp-exact", "`mip.strategy.miqcpstrat` 2 (LP at nodes)", {"mip.strategy.miqcpstrat": 2}),
    ("cplex", "miqp-exact", "`emphasis.mip` 3 (best bound)", {"emphasis.mip": 3}),
    (
        "cplex",
        "miqp-exact",
        "strong branching",
        {"mip.strategy.variableselect": 3},
    ),
)
"""Solver, formulation, the setting in words, and the setting."""


def settings(instances: list[Instance], seconds: float) -> Iterator[tuple[str, dict[str, Any]]]:
    """Results of every setting on some instances: proofs, and the shifted geometric mean of seconds."""
    for solver, formulation, words, options in SETTINGS:
        if not PROGRAMS[solver].present:
            continue
        found = [solved(cf.formulate(each, formulation), solver, seconds, options) for each in instances]
        taken = [each.seconds for each in found]
        yield f"{solver} {words}", {
            "solver": solver, "formulation": formulation, "setting": words, "instances": len(found),
            "proven": sum(each.proven for each in found), "limit": seconds,
            "mean": math.exp(sum(math.log(each + SHIFT) for each in taken) / len(taken)) - SHIFT,
        }  # fmt: skip


USES: Final = (
    ("highs", "milp-mccormick"),
    ("scip", "miqp-exact"),
    ("gurobi", "milp-mccormick"),  # of the other one its free edition takes no more than some 20 pixels
    ("cplex", "miqp-exact"),
)
"""Formulations for each solver."""


def certificate(instance: Instance, seconds: float) -> Certificate:
    """The certificate of an instance."""
    with tempfile.TemporaryDirectory() as folder:
        return write_certificate(
            prove(instance, limits=cf.Limits(seconds, gap=0)), Path(folder) / "certificate.npz"
        )


def here(instance: Instance, norm: Norm, seconds: float) -> Answer:
    """Result of `crossfield prove` for an instance, in the norm that a formulation minimises."""
    proof = prove(instance, norm=norm, limits=cf.Limits(seconds, gap=0))
    return Answer(proof.energy, proof.bound, 0, proof.seconds)


def both(name: str, size: int, seconds: float, proof_seconds: float) -> Iterator[dict[str, Any]]:
    """Proofs of each installed solver for a sample: from the files as they are, and tightened."""
    proofs: dict[str, Certificate] = {}
    for solver, formulation in USES:
        if not PROGRAMS[solver].present:
            continue
        instance = largest(name, size, formulation, solver)
        if instance.sha256 not in proofs:
            proofs[instance.sha256] = certificate(instance, proof_seconds)
        proof = proofs[instance.sha256]
        cold = cf.formulate(instance, formulation)
        narrow = tightened(cold, windows_left(proof))
        row = {
            "name": name, "width": instance.grid.width, "height": instance.grid.height,
            "pixels": instance.grid.size, "solver": solver, "formulation": formulation,
            "columns": cold.n_columns, "rows": cold.n_rows, "seconds": seconds,
            "energy": proof.energy, "proof": proof.bound, "status": proof.status,
            "free_jumps": int((narrow.data["p_min"] < narrow.data["p_max"]).sum()),
            "pairs": len(instance.grid.first),
        }  # fmt: skip
        answers = {
            "cold": solved(cold, solver, seconds, {}),
            "tightened": solved(narrow, solver, seconds, {}),
            "here": here(instance, 1 if formulation == "milp-mccormick" else 2, seconds),
        }
        row |= {what: asdict(found) | {"proven": found.proven} for what, found in answers.items()}
        yield row
