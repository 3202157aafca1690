"""Formulations of orthogonal crosses: the basis of cycles, optima against all jumps, limits, and a file."""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from angles import HALF
from bounded_least_squares import least_in_bounds
from crossfield.export.programs import highs
from crossfield.export.programs.comparison import algebra_difference
from crossfield.models.formulations.choice import list_formulations
from crossfield.models.formulations.residuals import limit_residuals
from crossfield.models.instance.terms import parity_sign
from exhaustive import every_jump, least_energy, random_instance, terms, windows
from loops import for_each
from meshes import box, flat_sheet, icosahedron, mesh_of, on_directions, on_edges, tetrahedron, torus
from scipy.optimize import milp


def on_grid(seed, shape, strokes=6):
    return replace(random_instance(seed, shape, strokes), orthogonal=True)


def with_hole():
    corners = [[x, y, 0] for x in range(4) for y in range(4)]
    squares = [(x, y) for x in range(3) for y in range(3) if (x, y) != (1, 1)]
    quads = [[4 * x + y, 4 * x + y + 4, 4 * x + y + 5, 4 * x + y + 1] for x, y in squares]
    return mesh_of(corners, [face for a, b, c, d in quads for face in ([a, b, c], [a, c, d])])


def part(mesh, faces, **more):
    """An instance with strokes along the first edge of some faces, turned by 0.3, 0.6, ... radians."""
    faces = np.array(faces, dtype=np.int32)
    turned = mesh.vectors(faces, 0.3 * (1 + np.arange(len(faces))))
    return on_directions(mesh, faces, turned, **more)


INSTANCES = {
    "tetrahedron": lambda: part(tetrahedron(), [0, 2]),
    "tetrahedron without strokes": lambda: part(tetrahedron(), []),
    "cube": lambda: on_edges(box(1)),
    "cube with weights": lambda: part(box(1), [0, 5], pair_weights=box(1).dual_weights),
    "icosahedron": lambda: part(icosahedron(), [3]),
    "torus": lambda: part(torus(5, 3), []),
    "torus with strokes": lambda: part(torus(5, 3), [0, 7, 20]),
    "sheet": lambda: on_edges(flat_sheet(3, 2)),
    "sheet with hole": lambda: part(with_hole(), [0, 9]),
    "grid": lambda: on_grid(3, (3, 3)),
    "grid with holes": lambda: on_grid(5, None),
}
# the basis


def incidence(instance):
    """Cycles over pairs and strokes (c, m + s), and the ends of pairs and strokes (m + s, n + 1)."""
    domain, cycles, strokes = instance.domain, instance.cycles, instance.stroke_index
    pairs, ground = len(domain.first), domain.size
    steps = np.zeros((len(cycles.ends), pairs + len(strokes)), int)
    np.add.at(steps, (np.repeat(np.arange(len(steps)), np.diff(cycles.start)), cycles.pair), cycles.sign)
    for number, (start, end) in enumerate(cycles.ends):
        if start >= 0:
            steps[number, pairs + start] -= 1
            steps[number, pairs + end] += 1
    ends = np.zeros((pairs + len(strokes), ground + 1), int)
    ends[np.arange(pairs), domain.first] = 1
    ends[np.arange(pairs), domain.second] -= 1
    ends[pairs + np.arange(len(strokes)), strokes] = 1
    ends[pairs + np.arange(len(strokes)), ground] = -1
    return steps, ends


@for_each("name", INSTANCES)
def test_cycles_are_a_basis_whose_integers_are_free(name):
    """They are closed, as many as independent cycles, and a square part of them has determinant 1 or -1."""
    instance = INSTANCES[name]()
    steps, ends = incidence(instance)
    assert not (steps @ ends).any()
    assert len(steps) == len(ends) - np.linalg.matrix_rank(ends)
    chords = np.ones(len(instance.domain.first), bool)
    in_forest = instance.cycles.forest.pair
    chords[in_forest[in_forest >= 0]] = False
    assert abs(np.linalg.det(steps[:, : len(chords)][:, chords])) == pytest.approx(1)


# optima


def least_of_all_jumps(instance, norm):
    """The least energy over all jumps of the pairs outside a forest, by least squares or linear programs."""
    steps, _ = incidence(instance)
    pairs, strokes = instance.pair_terms, instance.stroke_terms
    weight = np.concatenate([pairs.weighted(np.full(len(pairs.first), 2.0)), strokes.weight])
    fixed = np.concatenate([np.broadcast_to(pairs.offset(0), len(pairs.first)), -strokes.goal])
    reach = np.floor(np.abs(steps).sum(axis=1) / 2 + np.abs(steps @ fixed) / HALF).astype(int)
    ranges = [range(-most, most + 1) for most in reach]
    right = np.stack([axis.ravel() for axis in np.meshgrid(*ranges, indexing="ij")], axis=1) * HALF
    right = right + steps @ fixed  # the sums of residuals along cycles
    if norm == 2:  # the least sum of w r^2 with C r = b is b' (C W^-1 C')^-1 b
        inverse = np.linalg.inv((steps / weight) @ steps.T)
        return float(np.einsum("ki,ij,kj->k", right, inverse, right).min())
    size = steps.shape[1]
    both, cost = np.hstack([steps, -steps, -HALF * np.eye(len(steps))]), np.r_[weight, weight, 0 * reach]
    ends = np.r_[np.zeros(2 * size), -reach], np.r_[np.full(2 * size, np.inf), reach]
    whole = np.r_[np.zeros(2 * size), np.ones(len(reach))]
    goal = steps @ fixed
    return milp(cost, constraints=(both, goal, goal), bounds=ends, integrality=whole).fun


LIMITED = {"limits": True}
WAYS = [
    ("milp-orthogonal", {}, 1, "highs"),
    ("milp-cycle", {}, 1, "highs"),
    *(
        pytest.param(name, options, 2, "gurobi", marks=pytest.mark.needs("gurobi"))
        for name in ("miqp-orthogonal", "miqp-cycle")
        for options in ({}, LIMITED)
    ),
]
"""Formulations with options, their norms, and solvers."""


@pytest.mark.parametrize("formulation, options, norm, solver", WAYS)
@pytest.mark.parametrize("name", ["tetrahedron", "tetrahedron without strokes"])
def test_optima_are_the_least_of_all_jumps(name, formulation, options, norm, solver):
    instance = INSTANCES[name]()
    problem = cf.formulate(instance, formulation, **options)
    solution = cf.solve(problem, solver, limits=cf.Limits(60.0, gap=1e-9))
    least = least_of_all_jumps(instance, norm)
    assert solution.objective == pytest.approx(least, abs=1e-6)
    assert solution.field.energy(norm).total == pytest.approx(least, abs=1e-6)


def indices_of(field):
    spots = field.singularities
    return dict(zip(spots.vertex.tolist(), np.round(4 * spots.index).astype(int).tolist(), strict=True))


@pytest.mark.parametrize("name", ["tetrahedron", pytest.param("sheet", marks=pytest.mark.slow)])
def test_the_best_of_all_indices_of_a_vertex_is_the_optimum(name):
    """A vertex whose ring is not in the basis by default, where one is left out."""
    instance = INSTANCES[name]()
    vertex = int(instance.mesh.ring_vertices[0])
    free = cf.solve(cf.formulate(instance, "milp-cycle"), "highs", limits=cf.Limits(60.0, gap=1e-9))
    energies = {}
    for turns in range(-1, 4):
        try:
            problem = cf.formulate(replace(instance, indices=[(vertex, turns)]), "milp-cycle")
        except cf.InstanceError:  # residuals of at most pi/4 do not reach it
            continue
        solution = cf.solve(problem, "highs", limits=cf.Limits(60.0, gap=1e-9))
        assert indices_of(solution.field).get(vertex, 0) == turns
        energies[turns] = solution.objective
    assert energies[indices_of(free.field).get(vertex, 0)] == pytest.approx(free.objective, abs=1e-6)
    assert min(energies.values()) == pytest.approx(free.objective, abs=1e-6)


@pytest.mark.needs("gurobi")
@pytest.mark.parametrize(
    "name, count", [("tetrahedron", 2), ("cube", 5), ("torus with strokes", 4), ("grid", 3)]
)
def test_searches_and_proofs_find_the_least_energy_with_given_indices(name, count):
    """Far from those of the free optimum; on the first two, residuals are at their limits."""
    instance, rng = INSTANCES[name](), np.random.default_rng(1)
    vertices, defect = instance.domain.ring_vertices, instance.domain.rings.defect
    some = rng.choice(len(vertices), count, replace=False)
    wanted = np.round(defect[some] / HALF).astype(int) + rng.integers(-1, 2, count)
    instance = replace(instance, indices=np.stack([vertices[some], wanted], axis=1))
    least = cf.solve(cf.formulate(instance, "miqp-cycle"), "gurobi", limits=cf.Limits(60.0, gap=1e-9))
    field = cf.search(instance, rounds=2).field
    field.check_instance(instance)
    assert field.energy().total == pytest.approx(least.objective, rel=1e-6)
    proof = cf.prove(instance, start=field, work=500)
    assert 0.8 * least.objective < proof.bound < (1 + 1e-6) * least.objective
    with pytest.raises(cf.InstanceError, match=r"has index .*/4 at vertex .* is prescribed"):
        cf.search(instance, rounds=0, start=cf.power_field(instance))


@pytest.mark.parametrize("seed", range(3))
def test_fields_with_given_indices_have_the_energy_of_charges(seed):
    """On a closed surface of genus 0, residuals are gradients of the potential of the charges, the indices
    less the curvatures: a Poisson equation on the graph of the vertices, whose edges are the pairs.
    """
    corners = icosahedron().vertices + np.random.default_rng(seed).uniform(-0.2, 0.2, (12, 3))
    mesh = mesh_of(corners, icosahedron().faces)
    weights = np.random.default_rng(seed).uniform(0.5, 2, len(mesh.first))
    indices = dict.fromkeys(range(12), 0) | indices_of(cf.power_field(part(mesh, [])))
    instance = part(mesh, [], pair_weights=weights, indices=[*indices.items()])
    edges = np.eye(12)[mesh.pair_vertices[:, 0]] - np.eye(12)[mesh.pair_vertices[:, 1]]
    charges = np.array(list(indices.values())) - 2 * mesh.defect / np.pi
    potential = np.linalg.lstsq(edges.T @ (edges / weights[:, None]), charges, rcond=None)[0]
    solution = cf.solve(cf.formulate(instance, "miqp-cycle", relax=True), "highs")
    assert solution.objective == pytest.approx(np.pi**2 / 2 * charges @ potential, rel=1e-6)
    searched = cf.search(instance, rounds=0).field
    assert searched.energy().total == pytest.approx(solution.objective, rel=1e-6)
    for field in (solution.field, searched):
        assert {v: q for v, q in indices.items() if q} == indices_of(field)


@for_each(
    "name,indices,message",
    [
        ("grid", [(0, 0)], "vertex 0 has no index: it is on the boundary or in no pixel"),
        ("sheet", [(0, 0)], "vertex 0 has no index: it is on the boundary"),
        ("sheet", [(99, 0)], "vertex 99 has no index"),
        ("sheet", [(4, 0), (4, 1)], "list vertex 4 twice"),
        ("sheet", [(4, 0.25)], "whole numbers"),
        ("sheet", [4, 5], "give pairs of a vertex"),
        (
            "sheet",
            [(4, 3)],
            "vertex 4 cannot have the index 3/4: with residuals of at most pi/4 it is -2/4 to 2",
        ),
        (
            "cube",
            [(vertex, 1 + (vertex == 3)) for vertex in range(8)],
            "closed part with face 0 add up to 9/4 instead of 8/4",
        ),
    ],
)
def test_indices_that_no_field_has_are_refused(name, indices, message):
    with pytest.raises(cf.InstanceError, match=message):
        replace(INSTANCES[name](), indices=indices)


def test_what_cannot_prescribe_indices_refuses_them():
    instance = replace(INSTANCES["sheet"](), indices=[(4, 0)])
    assert list_formulations(instance) == ["miqp-cycle", "milp-cycle"]
    with pytest.raises(cf.FormulationError, match="limits only where every jump may change"):
        cf.formulate(instance, "miqp-cycle", limits=True)
    with pytest.raises(cf.FormulationError, match="choose miqp-cycle or milp-cycle"):
        cf.formulate(instance, "miqp-orthogonal")
    for change in ({"orthogonal": False}, {"gauge": "box"}):
        with pytest.raises(cf.InstanceError, match="orthogonal crosses under the gauge strokes only"):
            replace(instance, **change)


@for_each("name", INSTANCES)
def test_limits_are_where_a_changed_jump_gains_nothing(name):
    """A residual at its limit: the change of one jump and of all angles leaves the energy as it is."""
    instance = INSTANCES[name]()
    _, ends = incidence(instance)
    pairs, strokes = instance.pair_terms, instance.stroke_terms
    root = np.sqrt(np.concatenate([pairs.weighted(np.full(len(pairs.first), 2.0)), strokes.weight]))
    rows = root[:, None] * ends[:, :-1]
    for number, limit in enumerate(np.concatenate(limit_residuals(instance))):
        turn = np.zeros(len(root))
        turn[number] = HALF * root[number]
        gain = np.sum((turn - rows @ np.linalg.lstsq(rows, turn, rcond=None)[0]) ** 2)
        assert gain == pytest.approx(2 * root[number] ** 2 * HALF * limit, abs=1e-7 * root[number] ** 2)
    assert limit_residuals(instance)[0].max() < 0.75


def optimum_in_windows(instance):
    """The angles and jumps of least energy, by least squares in the windows for jumps that may be better."""
    jumps = np.concatenate(list(every_jump(instance)))
    free = np.concatenate([least_energy(instance, part) for part in every_jump(instance)])
    least, best = np.inf, None
    for number in np.argsort(free, kind="stable"):
        if free[number] >= least:
            return best
        x, energy = least_in_bounds(*terms(instance, jumps[number]), windows(instance))
        if energy < least:
            least, best = energy, (*np.split(x, 2), jumps[number])
    return best


@for_each("seed", range(12))
def test_limits_of_skewed_crosses_hold_in_the_optimum(seed):
    """2 pi |A| <= pi^2/2 (1 - r) + 8 (-1)^p beta_i beta_j, |A| <= pi/2 (1 - r) (docs/mathematics.md, 14)."""
    instance = random_instance(seed, [(2, 2), (1, 4), (2, 3)][seed % 3], strokes=3)
    instance = replace(instance, stroke_coefficient=[0.1, 1.0, 20.0][seed % 3])
    alpha, beta, p = optimum_in_windows(instance)
    pairs = instance.pair_terms
    a = np.abs(pairs.residual_a(alpha, p))
    product = parity_sign(p) * beta[pairs.first] * beta[pairs.second]
    limit = limit_residuals(instance)[0]
    assert (2 * np.pi * a <= 2 * np.pi * limit + 8 * product + 1e-7).all()
    assert (a <= 2 * limit + 1e-7).all()


def test_only_formulations_with_limits_are_limited(tmp_path):
    right = replace(cf.sample("mouse", 4), orthogonal=True)
    names = ("miqp-orthogonal", "milp-orthogonal", "miqp-cycle", "milp-cycle")
    more = {"formulations": names, "formats": ["mps"], "options": LIMITED}
    manifests = cf.write_all(right, tmp_path, **more)
    problems = [manifest.problem() for manifest in manifests if "limited" in manifest.document]
    assert [problem.name for problem in problems] == ["miqp-orthogonal", "miqp-cycle"]
    assert all("the optimum stays" in problem.limited for problem in problems)
    relaxed = cf.formulate(right, "miqp-orthogonal", relax=True, **LIMITED)
    assert relaxed.limited.endswith("the relaxation may rise")


# rows and files


@pytest.mark.parametrize("suffix", ["lp", "mps"])
def test_highs_reads_rows_of_many_steps(suffix, tmp_path):
    problem = cf.formulate(part(torus(40, 3), []), "milp-cycle")
    assert max(family.family.steps for family in problem.rows) == 80
    cf.write(problem, tmp_path / f"it.{suffix}")
    assert algebra_difference(highs.read(tmp_path / f"it.{suffix}"), problem) == ""
