"""Proofs against other solvers, on more pixels than all jumps can be tried of."""

import crossfield as cf
import pytest
from exhaustive import random_instance

pytestmark = pytest.mark.oracles
NORMS = {"miqp-exact": 2, "miqp-mccormick": "mixed"}


@pytest.mark.parametrize(
    "solver, side, formulation",
    [
        pytest.param("gurobi", 3, "miqp-exact", marks=pytest.mark.needs("gurobi")),
        pytest.param("cplex", 3, "miqp-exact", marks=[pytest.mark.needs("cplex"), pytest.mark.slow]),
        pytest.param("scip", 3, "miqp-mccormick", marks=[pytest.mark.needs("scip"), pytest.mark.slow]),
    ],
)
def test_another_solver_proves_the_same_optima(solver, side, formulation):
    for seed in (0, 2):
        instance = random_instance(seed, (side, side))
        solution = cf.solve(cf.formulate(instance, formulation), solver, limits=cf.Limits(250.0, gap=0.0))
        assert solution.status == "optimal-global", seed
        proof = cf.prove(instance, norm=NORMS[formulation], jobs=1)
        assert proof.status == "optimal", seed
        assert proof.energy == pytest.approx(solution.objective, abs=1e-6), seed
