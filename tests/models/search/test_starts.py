"""First fields: on large grids they grow from coarse ones, are valid, low, repeatable, and end in time."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.proof.descent import Descent
from crossfield.models.search import starts
from crossfield.models.search.coarse import grow_field, halve_resolution, prolong_field
from crossfield.models.search.greedy import greedy_field
from crossfield.models.search.improvement import improved_field
from crossfield.models.search.starts import first_field, polyvector_start
from exhaustive import assert_feasible, random_instance

pytestmark = pytest.mark.numeric


@pytest.mark.slow
@pytest.mark.parametrize("name, size", [("mouse", 96), ("saddle", 128)])
def test_on_a_large_grid_the_first_field_is_at_most_the_improved_greedy_one(name, size):
    instance = cf.sample(name, size)
    assert (
        first_field(instance).energy().total <= improved_field(greedy_field(instance)).energy().total + 1e-9
    )


def test_many_hasty_fields_made_one_are_well_below_the_improved_greedy_one():
    instance = cf.sample("mouse", 56)
    assert starts._SMALL < instance.grid.size < 4 * starts._SMALL
    assert first_field(instance).energy().total < 0.9 * improved_field(greedy_field(instance)).energy().total


def test_the_larger_the_grid_the_fewer_strategies_are_tried(monkeypatch):
    tried = []
    one = starts._STRATEGIES[0]

    def counted(instance, over):
        tried.append(instance.grid.size)
        return one(instance, over)

    monkeypatch.setattr(starts, "_STRATEGIES", (counted,) * 10)
    monkeypatch.setattr(starts, "_SMALL", 40)
    monkeypatch.setattr(starts, "_EFFORT", 900)
    first_field(cf.sample("mouse", 24))
    assert [tried.count(size) for size in sorted(set(tried))] == [10, 10, 3]
    assert max(tried) == cf.sample("mouse", 24).grid.size == 298


def test_first_fields_of_large_grids_are_the_same_each_time(monkeypatch):
    monkeypatch.setattr(starts, "_SMALL", 150)
    instance = cf.sample("mouse", 24)
    first, again = first_field(instance), first_field(instance)
    for name in ("alpha", "beta", "p"):
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes()


def test_proofs_and_searches_begin_at_most_at_the_polyvector_start():
    instance = cf.sample("mouse", 16)
    polyvector = improved_field(polyvector_start(instance)).energy().total
    assert polyvector < first_field(instance).energy().total - 1e-3
    assert Descent.first_field(instance, None, lambda: False).energy().total <= polyvector + 1e-9
    assert cf.search(instance, rounds=0).field.energy().total <= polyvector + 1e-9


@pytest.mark.slow
def test_ragged_grids_grow_from_coarse_ones_to_valid_fields(monkeypatch):
    monkeypatch.setattr(starts, "_SMALL", 40)
    for seed in range(12):
        instance = random_instance(seed, (9, 14), strokes=14, gauge=("strokes", "box")[seed % 2])
        field = first_field(instance)
        assert_feasible(field)
        coarse = halve_resolution(instance)
        assert coarse is not None
        below = first_field(coarse)
        assert (
            prolong_field(below, instance).energy().total <= grow_field(below, instance).energy().total + 1e-9
        )


def test_a_first_field_of_no_time_is_a_field_after_few_questions():
    calls = []
    field = first_field(cf.sample("mouse", 96), lambda: bool(calls.append(None)) or True)
    assert np.isfinite(field.energy().total)
    assert len(calls) <= 30
