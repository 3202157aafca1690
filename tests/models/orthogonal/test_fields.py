"""Greedy field, power field, descent and search of orthogonal crosses, on pixels and on meshes."""

import os
import signal
import threading
import time
from itertools import product

import crossfield as cf
import numpy as np
import pytest
from cases import make_instance
from crossfield.models.instance.angles import HALF
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.sparse_systems import factor_matrix
from crossfield.models.orthogonal import greedy as greedy_module
from crossfield.models.orthogonal.energy import OrthogonalEnergy, field_of
from crossfield.models.orthogonal.greedy import find_forest_rows, round_greedily
from crossfield.models.search import integer_search as search_module
from crossfield.models.search.integer_search import IntegerSearch
from meshes import (
    box,
    flat_sheet,
    icosahedron,
    mesh_of,
    on_directions,
    on_edges,
    tetrahedron,
    torus,
    turn_corners,
)
from scipy.sparse.csgraph import shortest_path
from small_meshes import random_mesh


def shaken(mesh, seed, size=0.2):
    """The mesh with its vertices moved at random."""
    moved = np.random.default_rng(seed).uniform(-size, size, mesh.vertices.shape)
    return mesh_of(mesh.vertices + moved, mesh.faces)


def octahedron():
    corners = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    top = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]]
    return mesh_of(corners, top + [[b, a, 5] for a, b, _ in top])


TINY = {
    "tetrahedron": lambda: on_edges(shaken(tetrahedron(), 1), sharp=9),
    "octahedron": lambda: on_edges(shaken(octahedron(), 2), sharp=9),
    "cube": lambda: on_edges(shaken(box(1), 3), sharp=9),
    "sheet": lambda: on_edges(shaken(flat_sheet(2, 2), 4), sharp=9),
    "two strokes": lambda: on_directions(
        shaken(box(1), 5), [0, 7], [[1, 2, 0], [0, 1, 3]], stroke_coefficient=2.0
    ),
    "weights": lambda: on_edges(
        shaken(octahedron(), 6), sharp=9, pair_weights=shaken(octahedron(), 6).dual_weights
    ),
}


def least_energy(energy):
    """The energy of the best integers, of all that can be optimal.

    Integers on a spanning tree are 0 after a change of labels. At an optimum no residual exceeds pi/4, and
    the sum of those on the cycle that a further row closes is pi/2 times its integer and a constant.
    """
    tree = spanning_tree(energy)
    weight = np.where(tree, energy.weight, 0.0)
    alpha = -factor_matrix(energy.weighted_matrix(weight), pull=0.0)(
        energy.force(weight, np.zeros(len(tree), int))
    )
    ends = np.zeros((energy.size + 1,) * 2)
    ends[energy.first[tree], energy.second[tree]] = 1
    length = shortest_path(ends, directed=False)[energy.first, energy.second] + 1
    exact = -energy.residuals(alpha, 0) / HALF
    lowest = np.where(tree, 0, np.ceil(exact - length / 2)).astype(int)
    highest = np.where(tree, 0, np.floor(exact + length / 2)).astype(int)
    ranges = [range(low, high + 1) for low, high in zip(lowest, highest, strict=True)]
    rows = energy.matrix.toarray()
    reduced = np.diag(energy.weight) - (energy.weight[:, None] * rows) @ energy.solve_system(
        np.eye(energy.size)
    ) @ (rows.T * energy.weight)
    z = np.array(list(product(*ranges)))
    shifted = energy.constant + HALF * z
    return float(np.einsum("kr,rs,ks->k", shifted, reduced, shifted, optimize=True).min())


def spanning_tree(energy):
    """Rows of a spanning tree of the points and the ground."""
    part = np.arange(energy.size + 1)
    chosen = np.zeros(len(energy.first), dtype=bool)
    for row, (i, j) in enumerate(zip(energy.first, energy.second, strict=True)):
        if part[i] != part[j]:
            chosen[row] = True
            part[part == part[j]] = part[i]
    return chosen


@pytest.mark.parametrize("name", TINY)
def test_search_finds_what_all_integers_together_have_as_their_best(name):
    instance = TINY[name]()
    least = least_energy(OrthogonalEnergy.of(instance))
    result = cf.search(instance, rounds=3)
    assert result.field.energy().total == pytest.approx(least, abs=1e-8)
    assert cf.greedy_field(instance).energy().total >= least - 1e-8
    assert cf.power_field(instance).energy().total >= least - 1e-8


def test_search_finds_the_proven_optimum_of_a_torus_without_strokes():
    assert cf.search(cf.sample("doughnut"), rounds=20).field.energy().total == pytest.approx(
        2.0605952, abs=1e-6
    )


@pytest.mark.parametrize(
    "mesh, count, energy", [(tetrahedron(), 4, 0.0), (box(2), 8, 0.0), (icosahedron(), 8, None)]
)
def test_singularities_of_solids(mesh, count, energy):
    """A cube's corners have a quarter each, a tetrahedron's a half, and 8 of an icosahedron's a quarter."""
    field = cf.search(on_edges(mesh, sharp=9), rounds=2).field
    assert len(field.singularities.index) == count
    assert field.singularities.index.sum() == 2
    assert not field.beta.any()
    if energy is not None:
        assert field.energy().total == pytest.approx(energy, abs=1e-12)


@pytest.mark.parametrize("find", [cf.greedy_field, cf.power_field, lambda i: cf.search(i, rounds=1).field])
@pytest.mark.parametrize("mesh", [box(2), torus(6, 4), flat_sheet(3, 2)])
def test_indices_add_up_to_the_euler_characteristic(find, mesh):
    field = find(on_edges(mesh))
    closed = not len(mesh.boundary)
    assert not closed or field.singularities.index.sum() == mesh.euler_characteristic


def test_a_turned_sheet_has_the_same_energies():
    energies = []
    for angle in (0.0, 0.7):
        sheet, turn = flat_sheet(4, 3, angle), np.array([np.cos(angle), np.sin(angle), 0])
        along = [[turn[0], turn[1], 0], [0.6 * turn[0] - 0.8 * turn[1], 0.8 * turn[0] + 0.6 * turn[1], 0]]
        instance = on_directions(sheet, [0, 20], along)
        found = [cf.greedy_field(instance), cf.power_field(instance), cf.search(instance, rounds=1).field]
        energies.append([field.energy().total for field in found])
    np.testing.assert_allclose(*energies, atol=1e-9)


@pytest.mark.parametrize("strokes", [[], [0, 17, 30]])
@pytest.mark.parametrize("mesh", [shaken(torus(6, 4), 1, 0.1), shaken(box(2), 2, 0.1)])
def test_frames_do_not_change_the_best_energy(mesh, strokes):
    turned, along = turn_corners(mesh, np.random.default_rng(3)), [[1, 2, 0], [0, 1, 3], [2, 0, 1]]
    instances = [on_directions(one, strokes, along) for one in (mesh, turned)]
    best = [cf.search(instance, rounds=3).field.energy().total for instance in instances]
    assert best[0] == pytest.approx(best[1], abs=1e-9)
    if strokes:
        power = [cf.power_field(instance).energy().total for instance in instances]
        assert power[0] == pytest.approx(power[1], abs=1e-9)


def test_each_part_without_strokes_gets_a_power_field():
    one, other = shaken(box(1), 1, 0.4), shaken(octahedron(), 2, 0.4)
    both = mesh_of(
        np.concatenate([one.vertices, other.vertices + 9]), np.concatenate([one.faces, other.faces + 8])
    )
    parts = [cf.power_field(on_edges(mesh, sharp=9)).energy().total for mesh in (one, other)]
    assert cf.power_field(on_edges(both, sharp=9)).energy().total == pytest.approx(sum(parts))


@pytest.mark.parametrize("orthogonal", [True, False])
@pytest.mark.parametrize("faces", [[[0, 1, 2]], [[0, 1, 2], [3, 4, 5]], [[0, 1, 2], [0, 2, 1]]])
def test_single_faces_have_fields(faces, orthogonal):
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [6, 0, 0], [5, 1, 0]]
    mesh = mesh_of(corners[: 1 + np.max(faces)], faces)
    for boundary in (True, False):
        instance = on_edges(mesh, sharp=9, boundary=boundary, orthogonal=orthogonal)
        for field in (
            cf.greedy_field(instance),
            cf.power_field(instance),
            cf.search(instance, rounds=2).field,
        ):
            assert field.energy().total == pytest.approx(0.0, abs=1e-9)


def test_greedy_is_one_solution_of_exact_rounds_and_one_of_many_at_once(monkeypatch):
    energy = OrthogonalEnergy.of(on_edges(shaken(torus(12, 6), 1, 0.05), sharp=9))
    exact = round_greedily(energy)
    assert not exact[find_forest_rows(energy)].any()
    monkeypatch.setattr(greedy_module, "MOST_DENSE", 0)
    many, at_once = round_greedily(energy), round_greedily(energy, is_over=lambda: True)
    totals = [energy.least_total(z) for z in (exact, many, at_once)]
    assert totals[0] <= 1.3 * totals[1]
    assert totals[1] <= totals[2]


def test_the_rounds_of_greedy_have_the_best_angles_in_between():
    """The rounds of a plain program, which solves again after each."""
    energy = OrthogonalEnergy.of(on_edges(shaken(box(2), 1, 0.1), sharp=9))
    known, z = find_forest_rows(energy), np.zeros(len(energy.first), dtype=np.int32)
    while not known.all():
        weight = energy.weight * known
        alpha = np.linalg.solve(energy.weighted_matrix(weight).toarray(), -energy.force(weight, z))
        turns = np.where(known, np.nan, energy.turns(alpha))
        row = np.nanargmin(np.round(np.abs(turns - np.round(turns)), 9))
        z[row], known[row] = np.round(turns[row]), True
    np.testing.assert_array_equal(round_greedily(energy), z)


def test_patches_of_a_large_mesh_lower_the_energy(monkeypatch):
    instance = on_edges(shaken(torus(12, 6), 1, 0.05), sharp=9)
    energy = OrthogonalEnergy.of(instance)
    start = energy.nearest(np.zeros(energy.size))
    monkeypatch.setattr(search_module, "MOST_DENSE", 0)
    monkeypatch.setattr(search_module, "_PATCH", 60)
    monkeypatch.setattr(search_module, "_KICKS", 100)
    hunt = IntegerSearch(energy, instance.domain.rings, [start], 0)
    totals = [hunt.best.energy]
    for _ in range(12):
        hunt.explore(lambda: False)
        totals.append(hunt.best.energy)
    assert totals == sorted(totals, reverse=True)
    assert totals[-1] < 0.5 * totals[0]
    assert field_of(instance, hunt.best.p, energy).energy().total == pytest.approx(totals[-1])


@pytest.mark.parametrize("instance", [on_edges(torus(6, 4), sharp=9), make_instance(orthogonal=True)])
def test_the_same_seed_gives_the_same_field(instance):
    one, other = (cf.search(instance, rounds=2, seed=5) for _ in range(2))
    np.testing.assert_array_equal(one.field.p, other.field.p)
    assert one.energies == other.energies
    assert one.ended == "rounds"


def test_a_search_is_no_worse_than_its_start_and_keeps_to_its_limits():
    instance = on_edges(shaken(torus(12, 6), 1, 0.05), sharp=9)
    start = cf.greedy_field(instance)
    began = time.monotonic()
    result = cf.search(instance, start=start, limits=cf.Limits(0.5))
    assert time.monotonic() - began < 5
    assert result.ended == "time"
    assert result.field.energy().total <= start.energy().total


def test_ctrl_c_keeps_the_best_field_so_far():
    instance = on_edges(shaken(torus(12, 6), 1, 0.05), sharp=9)
    timer = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        result = cf.search(instance, limits=cf.Limits(60))
    finally:
        timer.cancel()
    assert result.ended == "interrupted"
    assert result.field.energy().total <= cf.power_field(instance).energy().total


@pytest.mark.parametrize("gauge", ["strokes", "box"])
def test_pixels_with_right_angles(gauge):
    instance = make_instance(orthogonal=True, gauge=gauge)
    result = cf.search(instance, rounds=1)
    for field in (cf.greedy_field(instance), cf.power_field(instance), cf.improved_field(result.field)):
        assert not field.beta.any()
        assert result.field.energy().total <= field.energy().total + 1e-9


def test_meshes_with_skew_have_fields_too():
    mesh = shaken(box(2), 1, 0.1)
    more = {"orthogonal": False, "skew_coefficient": 0.01}
    instance = on_edges(mesh, **more)
    orthogonal = cf.search(on_edges(mesh, skew_coefficient=0.01), rounds=1).field
    result = cf.search(instance, rounds=1)
    assert result.field.energy().total < orthogonal.energy().total
    assert cf.greedy_field(instance).energy().total >= result.field.energy().total - 1e-9


@pytest.mark.parametrize("seed", [5, 13])
def test_searches_end_where_weights_differ_by_twelve_orders_of_magnitude(seed):
    """Gains lose their digits there; steps that only rounding calls lower must not follow each other."""
    rng = np.random.default_rng(seed)
    mesh = random_mesh(rng, int(rng.integers(5, 14)))
    weights = 10 ** rng.uniform(-9, 3, len(mesh.first))
    count = int(rng.integers(0, 5))
    faces = np.sort(rng.choice(mesh.size, count, replace=False))
    strokes = rng.uniform(0, np.pi, count), rng.uniform(0.1, 1, count)
    instance = Instance.on_faces("spread", mesh, faces, *strokes, pair_weights=weights)
    asked = []
    result = cf.search(instance, rounds=0, stop=lambda: asked.append(None) or len(asked) > 5000)
    assert result.ended == "rounds"
    assert result.field.energy().total <= cf.power_field(instance).energy().total


@pytest.mark.parametrize("orthogonal", [True, False])
@pytest.mark.parametrize("gauge", ["strokes", "box"])
@pytest.mark.parametrize("shape", ["hole", "box"])
def test_a_search_reports_the_energies_of_fields(shape, gauge, orthogonal):
    instance = make_instance(shape, gauge, orthogonal=orthogonal)
    result = cf.search(instance, rounds=1, jobs=1, start=cf.greedy_field(instance))
    energies = [energy for _, energy in result.energies]
    assert energies[-1] == pytest.approx(result.field.energy().total, rel=1e-8)
    assert energies[0] <= cf.greedy_field(instance).energy().total + 1e-9
    assert energies == sorted(energies, reverse=True)


def test_many_triangles_apart_are_searched():
    """So many that patches are explored, and without a pair or a stroke there is none."""
    flat = np.column_stack(
        [np.tile([0.0, 1, 0], 6001), np.tile([0.0, 0, 1], 6001), np.repeat(np.arange(6001.0), 3)]
    )
    instance = on_edges(mesh_of(flat, np.arange(18003).reshape(-1, 3)), sharp=9, boundary=False)
    assert cf.search(instance, rounds=1).field.energy().total == 0
