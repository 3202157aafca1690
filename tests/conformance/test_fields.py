"""Fields of every method on every kind of instance: energies, their order, symmetric copies."""

import itertools
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from hypothesis import given, settings
from independent_energy import Formulas, angle_in
from instance_kinds import (
    KINDS,
    MANY,
    SMALL,
    TINY,
    crossed,
    first_field,
    instances,
    is_provable,
    kind,
    on_mesh,
)

NORMS = (1, 2, "mixed")
WORK = 4000
"""Labels after which a proof ends."""
METHODS = {
    "greedy": lambda instance, stop: cf.greedy_field(instance, stop=stop),
    "improved": lambda instance, stop: cf.improved_field(cf.greedy_field(instance), stop=stop),
    "power": lambda instance, _: cf.power_field(instance),
    "power, 9 steps": lambda instance, _: cf.power_field(instance, steps=9),
    "polyvector": lambda instance, _: cf.polyvector_field(instance),
    "bend": lambda instance, stop: cf.bend_field(cf.polyvector_field(instance), stop=stop),
    "search": lambda instance, stop: cf.search(instance, rounds=0, jobs=1, stop=stop).field,
    "prove": lambda instance, stop: prove(instance, stop).field,
}


def patience(questions=4000):
    """A request to stop that fails the test after so many questions: the work would not end."""
    asked = itertools.count()

    def stop():
        assert next(asked) < questions, "the work does not end"
        return False

    return stop


def prove(instance, stop=None, norm=2):
    return cf.prove(instance, norm=norm, work=WORK, jobs=1, stop=stop)


def refusal(method, instance):
    """The error by which a method refuses an instance, as it documents; None where it must not."""
    if method in {"polyvector", "bend"}:
        return cf.InstanceError if on_mesh(instance) else None
    if method == "prove" and not is_provable(instance):
        return cf.InstanceError if instance.pair_weights is None else cf.InputError
    return None


def field_of(method, instance):
    """The field of a method; None where it may refuse the instance, and does."""
    try:
        return METHODS[method](instance, patience())
    except (cf.InstanceError, cf.InputError) as error:
        if not isinstance(error, refusal(method, instance) or ()):
            raise
        return None


def assert_field(field):
    """A field keeps its windows, and has the energies of the formulas."""
    instance, formulas = field.instance, Formulas(field.instance)
    close = 1e-12 + 4e-12 * sum(formulas.omega)  # kappa has 12 decimals
    assert (field.alpha >= formulas.lower - 1e-12).all()
    assert (field.alpha <= formulas.upper + 1e-12).all()
    assert np.abs(field.beta).max() <= (0 if instance.orthogonal else np.pi / 4)
    assert all(p in jumps for p, jumps in zip(field.p.tolist(), formulas.jumps, strict=True))
    for norm in NORMS:
        energy = field.energy(norm)
        expected = formulas.energy(field, norm)
        assert (energy.smooth, energy.strokes, energy.beta) == pytest.approx(expected, rel=1e-9, abs=close)
        assert energy.total == pytest.approx(sum(expected), rel=1e-9, abs=close)


@pytest.mark.parametrize("name, method", crossed(KINDS, METHODS, every=5))
def test_a_field_has_the_energies_of_the_formulas(name, method):
    field = field_of(method, kind(name))
    if field is not None:
        assert_field(field)


@pytest.mark.parametrize("name, method", crossed(SMALL, METHODS, every=9))
def test_a_method_gives_the_same_bits_again_and_a_field_when_it_has_to_end(name, method):
    one, two = (field_of(method, kind(name)) for _ in range(2))
    if one is None:
        return
    for array in ("alpha", "beta", "p"):
        assert getattr(one, array).tobytes() == getattr(two, array).tobytes()
    for questions in (0, 2):
        asked = itertools.count()
        field = METHODS[method](kind(name), lambda asked=asked, most=questions: next(asked) >= most)
        assert_field(field)
        assert next(asked) <= questions + 40


OF_INTEGERS = [name for name in SMALL if kind(name).orthogonal or on_mesh(kind(name))]
"""Kinds that are searched in one process, which can end at any step."""


@pytest.mark.parametrize("name", crossed(OF_INTEGERS, every=3))
def test_a_search_that_has_to_end_returns_its_best_field(name):
    is_free = kind(name).indices is None  # else no power field has them
    first = cf.power_field(kind(name)).energy().total if is_free else np.inf
    for questions in (0, 10, 100, 300):
        asked = itertools.count()
        result = cf.search(kind(name), jobs=1, stop=lambda asked=asked, most=questions: next(asked) >= most)
        assert result.ended in {"interrupted", "patience"}
        stated, energy = result.energies[-1][1], result.field.energy().total
        assert energy == pytest.approx(stated, rel=1e-6, abs=1e-9)
        result.field.check_instance(kind(name))
        assert (is_free and not questions) or energy <= first * (1 + 1e-6) + 1e-9
        first = first if is_free else min(first, energy)


def assert_order(instance):
    """Bound <= optimum <= search <= greedy, and the search states the energies of its own fields."""
    greedy = first_field(instance).energy().total
    found = cf.search(instance, rounds=1, jobs=1, stop=patience())
    energy = found.field.energy().total
    close = 1e-9 * (1 + greedy)
    assert energy <= greedy + close
    assert found.energies[-1][1] == pytest.approx(energy, rel=1e-6, abs=1e-9)
    least = Formulas(instance).least(2)
    assert least is None or energy >= least - close
    if is_provable(instance):
        proof = prove(instance, patience())
        assert proof.bound <= min(proof.energy, energy if least is None else least) + close
        assert proof.status != "optimal" or proof.energy <= energy + 10 * close


@pytest.mark.parametrize("name", crossed([*TINY, *MANY], every=5))
def test_bound_optimum_search_and_greedy_keep_their_order(name):
    assert_order(kind(name))


@settings(max_examples=10)
@given(instances())
def test_fields_of_instances_of_any_kind(instance):
    for method in ("greedy", "improved", "power", "polyvector", "bend"):
        if (field := field_of(method, instance)) is not None:
            assert_field(field)


@pytest.mark.slow
@settings(max_examples=25)
@given(instances())
def test_instances_of_any_kind_keep_the_order(instance):
    assert_order(instance)


PROVEN_IN_OTHER_NORMS = [name for name in TINY if not kind(name).orthogonal and is_provable(kind(name))]


@pytest.mark.parametrize("name", crossed(PROVEN_IN_OTHER_NORMS, every=4))
@pytest.mark.parametrize("norm", [1, "mixed"])
def test_bounds_in_other_norms(name, norm):
    instance = kind(name)
    proof = prove(instance, patience(), norm)
    least = Formulas(instance.with_gauge("strokes")).least(1) if norm == 1 else None
    assert_field(proof.field)
    assert proof.bound <= proof.energy + 1e-9
    assert least is None or proof.bound <= least + 1e-7 <= proof.energy + 2e-7


# Symmetric copies: each with the function that takes angles of lines (n,) to those of the copy.


def copies(instance):
    """Copies of an instance that have its energies, and how angles of lines change."""
    return copies_of_mesh(instance) if on_mesh(instance) else copies_of_grid(instance)


def copies_of_grid(instance):
    """The sketch turned by a quarter, mirrored, and transposed."""
    number = np.full(instance.mask.shape, -1)
    number[instance.mask] = np.arange(instance.domain.size)
    yield moved(instance, np.rot90(number), 1, np.pi / 2)
    yield moved(instance, number[:, ::-1], -1, np.pi)
    yield moved(instance, number.T, -1, -np.pi / 2)


def moved(instance, number, sense, turn):
    """The sketch whose pixels have these numbers in the old one, [height, width], -1 outside."""
    old = number[number >= 0]
    place = dict(zip(instance.stroke_index.tolist(), range(len(instance.theta)), strict=True))
    kept = [place[i] for i in old.tolist() if i in place]
    copy = cf.Instance.on_pixels(
        instance.name,
        number >= 0,
        np.argwhere(np.isin(number, [*place])),
        sense * instance.theta[kept] + turn,
        instance.w[kept],
    )
    return with_weights_of(copy, instance, old), lambda angles: sense * angles[old] + turn


def copies_of_mesh(instance):
    """The surface with other numbers of faces and vertices, other first corners, in another pose and unit."""
    mesh, rng = instance.domain, np.random.default_rng(5)
    vertex, face = rng.permutation(len(mesh.vertices)), rng.permutation(mesh.size)
    pose = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    pose *= np.sign(np.linalg.det(pose))
    vertices = np.empty_like(mesh.vertices)
    vertices[vertex] = 2.5 * mesh.vertices @ pose.T
    corner = (np.arange(3) + rng.integers(3, size=(mesh.size, 1))) % 3
    rolled = np.take_along_axis(mesh.faces, corner, axis=1)
    first = [
        angle_in(mesh.vertices[old], mesh.vertices[new[1]] - mesh.vertices[new[0]])
        for old, new in zip(mesh.faces, rolled, strict=True)
    ]
    at = np.argsort(face)[instance.stroke_index]
    order = np.argsort(at)
    copy = cf.Instance.on_faces(
        instance.name,
        cf.Mesh(vertices, vertex[rolled][face]),
        at[order],
        (instance.theta - np.take(first, instance.stroke_index))[order],
        instance.w[order],
    )
    yield with_weights_of(copy, instance, face), lambda angles: (angles - first)[face]


def with_weights_of(copy, instance, old):
    """The copy with the weights of an instance; old: the old number of each point."""
    names = ("orthogonal", "stroke_coefficient", "skew_coefficient", "pair_weights")
    same = {name: getattr(instance, name) for name in names}
    if instance.pair_weights is not None:
        ends = [frozenset(pair[:2]) for pair in Formulas(instance).pairs]
        by_ends = dict(zip(ends, instance.pair_weights, strict=True))
        moved_ends = [frozenset(old[[i, j]].tolist()) for i, j, _ in Formulas(copy).pairs]
        same["pair_weights"] = np.array([by_ends[pair] for pair in moved_ends])
    return replace(copy, **same)


SYMMETRIC = [name for name in KINDS if kind(name).gauge == "strokes"]
"""Kinds whose energies do not depend on the choice of axes: not those of the gauge `box`."""


@pytest.mark.parametrize("name", crossed(SYMMETRIC, every=1))
def test_symmetric_copies_have_the_same_energies(name):
    instance = kind(name)
    u = np.random.default_rng(3).uniform(0, np.pi, instance.domain.size)
    v = u + np.pi / 2 - (0 if instance.orthogonal else np.random.default_rng(4).uniform(-0.7, 0.7, len(u)))
    field = cf.CrossField.from_lines(instance, u, v)
    for copy, turned in copies(instance):
        same = cf.CrossField.from_lines(copy, turned(u), turned(v))
        assert_field(same)
        fields = [(field, same), (cf.power_field(instance), cf.power_field(copy))]
        if not on_mesh(instance) and not instance.orthogonal:
            fields.append((cf.polyvector_field(instance), cf.polyvector_field(copy)))
            fields.append(tuple(map(cf.bend_field, fields[-1])))
            for one, other in fields[-2:]:
                assert other.cross_error(turned(one.u_angle), turned(one.v_angle)).max() <= 1e-6
        for one, other in fields:
            assert vars(one.energy()) == pytest.approx(vars(other.energy()), rel=1e-6, abs=1e-8)


@pytest.mark.parametrize(
    "name", crossed([n for n in SYMMETRIC if is_provable(kind(n)) and n in TINY], every=3)
)
def test_a_bound_holds_for_symmetric_copies(name):
    proof = prove(kind(name))
    for copy, _ in copies(kind(name)):
        other = prove(copy)
        close = 1e-8 * (1 + proof.energy)
        assert other.bound <= proof.energy + close
        assert proof.bound <= other.energy + close
