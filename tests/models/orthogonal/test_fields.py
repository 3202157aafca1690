"""Greedy field, power field, descent and search of orthogonal crosses, on pixels and on meshes."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.orthogonal import greedy as greedy_module
from crossfield.models.orthogonal.energy import OrthogonalEnergy, field_of
from crossfield.models.orthogonal.greedy import find_forest_rows, round_greedily
from crossfield.models.search import integer_search as search_module
from crossfield.models.search.integer_search import IntegerSearch
from meshes import box, flat_sheet, icosahedron, mesh_of, on_directions, on_edges, tetrahedron, torus
from small_meshes import form_of_charges, random_hull, random_mesh, strokeless, try_all_integers

FINDERS = {
    "greedy": cf.greedy_field,
    "power": cf.power_field,
    "power, 9 steps": lambda instance: cf.power_field(instance, steps=9),
    "search": lambda instance: cf.search(instance, rounds=3, jobs=1).field,
}


def shaken(mesh, seed, size=0.2):
    """The mesh with its vertices moved at random."""
    moved = np.random.default_rng(seed).uniform(-size, size, mesh.vertices.shape)
    return mesh_of(mesh.vertices + moved, mesh.faces)


def small_torus():
    return on_edges(shaken(torus(12, 6), 1, 0.05), sharp=9)


TINY = {
    "tetrahedron": lambda: on_edges(shaken(tetrahedron(), 1), sharp=9),
    "hull": lambda: on_edges(random_hull(2), sharp=9),
    "sheet": lambda: on_directions(shaken(flat_sheet(2, 2), 4), [0, 3, 6], [[1, 0, 0], [1, 1, 0], [1, 2, 0]]),
    "strokes": lambda: on_directions(random_hull(5), [0, 7], [[1, 2, 0], [0, 1, 3]], stroke_coefficient=2.0),
    "weights": lambda: on_edges(random_hull(6), sharp=9, pair_weights=random_hull(6).dual_weights),
}


@pytest.mark.parametrize("name", TINY)
def test_search_finds_what_all_integers_together_have_as_their_best(name):
    instance = TINY[name]()
    least, _ = try_all_integers(instance)
    found = {key: find(instance).energy().total for key, find in FINDERS.items()}
    assert found["search"] == pytest.approx(least, abs=1e-8)
    assert min(found.values()) >= least - 1e-8


@pytest.mark.parametrize(
    "mesh, count, energy", [(tetrahedron(), 4, 0.0), (box(2), 8, 0.0), (icosahedron(), 8, None)]
)
def test_singularities_of_solids(mesh, count, energy):
    """A cube's corners have a quarter each, a tetrahedron's a half, and 8 of an icosahedron's a quarter."""
    field = cf.search(on_edges(mesh, sharp=9), rounds=2, jobs=1).field
    assert len(field.singularities.index) == count
    assert field.singularities.index.sum() == 2
    if energy is not None:
        assert field.energy().total == pytest.approx(energy, abs=1e-12)


def test_each_part_without_strokes_gets_a_power_field():
    one, other = shaken(box(1), 1, 0.4), random_hull(2)
    both = mesh_of(
        np.concatenate([one.vertices, other.vertices + 9]), np.concatenate([one.faces, other.faces + 8])
    )
    parts = [cf.power_field(on_edges(mesh, sharp=9)).energy().total for mesh in (one, other)]
    assert cf.power_field(on_edges(both, sharp=9)).energy().total == pytest.approx(sum(parts))


@pytest.mark.parametrize("seed", range(4))
def test_steps_lower_the_energy_of_power_fields_far_from_strokes(seed):
    instance = on_edges(shaken(torus(40, 16), seed, 0.03), sharp=9)
    energies = [cf.power_field(instance, steps=steps).energy().total for steps in (0, 10)]
    assert energies[1] < 0.97 * energies[0]


# The work on integers


@pytest.mark.parametrize("name", ["hull", "strokes", "weights"])
def test_gains_and_residuals_are_those_of_solving_again(name):
    energy = OrthogonalEnergy.of(TINY[name]())
    z = np.random.default_rng(0).integers(-2, 3, len(energy.first)).astype(np.int32)
    residual = energy.residuals(energy.fit_angles(z), z)
    np.testing.assert_allclose(energy.matrix.T @ (energy.weight * residual), 0.0, atol=1e-9)  # no slope
    gains = energy.gains(residual)
    for row in range(0, len(z), 3):
        changes = []
        for step in (1, -1):
            moved = z.copy()
            moved[row] += step
            again = energy.residuals(energy.fit_angles(moved), moved)
            changes.append(energy.total(again) - energy.total(residual))
            stepped = energy.step_residuals(residual, np.array([row]), np.array([step]))
            np.testing.assert_allclose(stepped, again, atol=1e-9)
        assert min(changes) == pytest.approx(gains[row], abs=1e-8)


def test_greedy_is_one_solution_of_exact_rounds_and_one_of_many_at_once(monkeypatch):
    energy = OrthogonalEnergy.of(small_torus())
    exact = round_greedily(energy)
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
    instance = small_torus()
    energy = OrthogonalEnergy.of(instance)
    monkeypatch.setattr(search_module, "MOST_DENSE", 0)
    monkeypatch.setattr(search_module, "_PATCH", 60)
    monkeypatch.setattr(search_module, "_KICKS", 100)
    hunt = IntegerSearch(energy, instance.domain.rings, [energy.nearest(np.zeros(energy.size))], 0)
    totals = [hunt.best.energy]
    for _ in range(12):
        hunt.explore(lambda: False)
        totals.append(hunt.best.energy)
    assert totals == sorted(totals, reverse=True)
    assert totals[-1] < 0.5 * totals[0]
    assert field_of(instance, hunt.best.p, energy).energy().total == pytest.approx(totals[-1])


@pytest.mark.parametrize("seed, stretch", [(3, (1, 1, 1)), (5, (1, 1, 3))])
def test_a_search_on_a_closed_surface_begins_where_no_charge_can_be_moved(seed, stretch):
    mesh = random_hull(seed, 200, stretch)
    field = cf.search(strokeless(mesh), rounds=0).field
    form, turns, _ = form_of_charges(mesh)
    charge = -turns
    charge[field.singularities.vertex] += 4 * field.singularities.index
    assert charge @ form @ charge == pytest.approx(field.energy().total)
    potential, own = 2 * form @ charge, np.diagonal(form)
    assert (own + own[:, None] - 2 * form + potential - potential[:, None]).min() > -1e-7


def on_a_row(weight):
    row, stroke = [[1, 0, 1, 1]], ([[0, 0]], [0.3], [1.0])
    return cf.Instance.on_pixels("apart", row, *stroke, orthogonal=True, stroke_coefficient=weight)


TRIANGLE = on_edges(mesh_of(np.eye(3), [[0, 1, 2]]), sharp=9, boundary=False)


@pytest.mark.parametrize("instance", [on_a_row(0.0), on_a_row(1.0), TRIANGLE])
def test_patches_without_pairs_change_nothing(instance, monkeypatch):
    monkeypatch.setattr(search_module, "MOST_DENSE", 0)
    monkeypatch.setattr(search_module, "_PATCH", 1)
    assert cf.search(instance, rounds=4, jobs=1).field.energy().total == 0


def test_meshes_with_skew_have_lower_energies():
    mesh = shaken(box(2), 1, 0.1)
    right, skewed = (
        cf.search(on_edges(mesh, orthogonal=orthogonal, skew_coefficient=0.01), rounds=1, jobs=1).field
        for orthogonal in (True, False)
    )
    assert skewed.energy().total < right.energy().total


@pytest.mark.parametrize("seed", [5, 13])
def test_searches_end_where_weights_differ_by_twelve_orders_of_magnitude(seed):
    """Gains lose their digits there; steps that only rounding calls lower must not follow each other."""
    rng = np.random.default_rng(seed)
    mesh = random_mesh(rng, int(rng.integers(5, 14)))
    weights = 10 ** rng.uniform(-9, 3, len(mesh.first))
    count = int(rng.integers(0, 5))
    faces = np.sort(rng.choice(mesh.size, count, replace=False))
    strokes = rng.uniform(0, np.pi, count), rng.uniform(0.1, 1, count)
    instance = cf.Instance.on_faces("spread", mesh, faces, *strokes, pair_weights=weights)
    asked = []
    result = cf.search(instance, rounds=0, stop=lambda: asked.append(None) or len(asked) > 5000)
    assert result.ended == "rounds"
    assert result.field.energy().total <= cf.power_field(instance).energy().total
