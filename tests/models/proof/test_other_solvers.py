"""Proofs against other solvers, on more pixels than all jumps can be tried of."""

import crossfield as cf
import pytest
from exhaustive import random_instance
from small_meshes import form_of_charges, random_hull, strokeless, torus_of_seven

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


@pytest.mark.needs("gurobi")
@pytest.mark.parametrize(
    "points, stretch",
    [(8, (1, 1, 0.01)), (8, (1, 1, 10)), pytest.param(16, (1, 1, 1), marks=pytest.mark.slow)],
)
def test_closed_surfaces_have_the_least_energy_of_charges(points, stretch):
    import gurobipy

    mesh = random_hull(points, points, stretch)
    form, turns, total = form_of_charges(mesh)
    with gurobipy.Env(params={"OutputFlag": 0, "MIPGap": 0}) as own, gurobipy.Model(env=own) as model:
        charges = model.addMVar(points, lb=-50, vtype="I")
        model.addConstr(charges.sum() == total)
        model.setObjective((charges - turns) @ form @ (charges - turns))
        model.optimize()
        proof = cf.prove(strokeless(mesh), jobs=1)
        assert (proof.status, proof.energy) == ("optimal", pytest.approx(model.ObjVal, abs=1e-7))


@pytest.mark.needs("gurobi")
def test_bounds_on_a_surface_of_genus_two_do_not_exceed_its_optimum():
    instance = strokeless(torus_of_seven(genus=2))
    optimum = cf.solve(cf.formulate(instance, "miqp-cycle"), "gurobi", limits=cf.Limits(60.0, gap=0.0))
    proof = cf.prove(instance, limits=cf.Limits(2.0), jobs=1)
    assert (optimum.status, proof.field.singularities.index.sum()) == ("optimal-global", -2)
    assert 0 < proof.bound <= optimum.objective + 1e-6
    assert proof.energy >= optimum.objective - 1e-6
