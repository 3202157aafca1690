"""First fields: on large grids they grow from coarse ones, are valid, low, repeatable, and end in time."""

import crossfield as cf
import numpy as np
from crossfield.models.proof.descent.descent import Descent
from crossfield.models.search import starts
from crossfield.models.search.starts import first_field, polyvector_start


def test_many_hasty_fields_made_one_are_well_below_the_improved_greedy_one():
    instance = cf.sample("mouse", 56)
    assert starts._SMALL < instance.grid.size < 4 * starts._SMALL
    assert (
        first_field(instance).energy().total
        < 0.9 * cf.improved_field(cf.greedy_field(instance)).energy().total
    )


def test_first_fields_of_large_grids_are_the_same_each_time(monkeypatch):
    monkeypatch.setattr(starts, "_SMALL", 150)
    instance = cf.sample("mouse", 24)
    first, again = first_field(instance), first_field(instance)
    for name in ("alpha", "beta", "p"):
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes()


def test_proofs_and_searches_begin_at_most_at_the_polyvector_start():
    instance = cf.sample("mouse", 16)
    polyvector = cf.improved_field(polyvector_start(instance)).energy().total
    assert polyvector < first_field(instance).energy().total - 1e-3
    assert Descent.first_field(instance, 2, None, lambda: False).energy().total <= polyvector + 1e-9
    assert cf.search(instance, rounds=0).field.energy().total <= polyvector + 1e-9


def test_a_first_field_of_no_time_is_a_field_after_few_questions():
    calls = []
    field = first_field(cf.sample("mouse", 96), lambda: bool(calls.append(None)) or True)
    assert np.isfinite(field.energy().total)
    assert len(calls) <= 30
