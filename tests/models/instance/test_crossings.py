"""Second strokes of an instance: rules, files, moves of the sketch, and the target of line v."""

from __future__ import annotations

import json
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from cases import make_instance
from crossed import crossed, exchanged
from crossfield.models.errors import InstanceError
from crossfield.models.evaluation.hidden import HiddenCurve
from crossfield.models.field.field import CrossField
from crossfield.models.field.file import read_field, write_field
from crossfield.models.instance.file import arrays_of, of_json, read_instance, to_json, write_instance
from crossfield.models.instance.instance import HALF, QUARTER
from crossfield.models.search.excerpt import excerpt

NONE = np.zeros(0)


def second(instance):
    """Directions and weights by pixel: {(row, column): (theta, w)} of second strokes."""
    at = instance.stroke_pixels[instance.crossings]
    return {
        tuple(pixel): (theta, w)
        for pixel, theta, w in zip(at.tolist(), instance.theta_cross, instance.w_cross, strict=True)
    }


def test_an_instance_without_crossings_is_what_it_was():
    """Hash, JSON and arrays know nothing of crossings where there are none."""
    instance = make_instance()
    assert instance.sha256 == "035960043126af6228e3ed84e94b7cd91824a80bed27eb86a08e049f13c8352a"
    assert "crossings" not in to_json(instance)
    assert not {"crossings", "theta_cross", "w_cross"} & arrays_of(instance).keys()
    crossing = crossed()
    assert crossing.sha256 != crossing.without_crossings().sha256 == instance.sha256
    assert "3 with strokes (1 with two)" in crossing.summary
    assert crossing.with_weights(2.0).theta_cross == pytest.approx(crossing.theta_cross)


@pytest.mark.parametrize("gauge", ["strokes", "box"])
def test_the_second_stroke_has_one_target(gauge):
    """Line v of every label in the window is within the range of the target, and reaches its ends."""
    for seed in range(5):
        instance = crossed("full", gauge, seed)
        at = instance.crossing_index
        lowest, highest = (
            end[at] + HALF - beta
            for end, beta in ((instance.alpha_lower, QUARTER), (instance.alpha_upper, -QUARTER))
        )
        assert highest - lowest == pytest.approx(np.full(len(at), np.pi))
        assert ((instance.cross_target >= lowest - 1e-9) & (instance.cross_target <= highest + 1e-9)).all()
        turns = (instance.cross_target - instance.theta_cross) / np.pi
        assert turns == pytest.approx(np.round(turns), abs=1e-12)


def test_second_strokes_obey_the_rules_of_the_first():
    one = {"name": "one", "mask": [[True, True]], "stroke_pixels": [[0, 0], [0, 1]], "theta": [0.3, 2.0]}
    one |= {"w": [0.5, 1.0]}
    for wrong, said in (
        ({"crossings": [0], "theta_cross": [1.0], "w_cross": [2.0]}, r"\[0, 0\]: w_cross is not in"),
        (
            {"crossings": [1], "theta_cross": [np.nan], "w_cross": [1]},
            r"\[0, 1\]: theta_cross is not a finite",
        ),
        ({"crossings": [1], "theta_cross": [1e9], "w_cross": [1]}, "theta_cross is beyond"),
        ({"crossings": [2], "theta_cross": [1.0], "w_cross": [1]}, "no stroke pixel; the last is 1"),
        ({"crossings": [1, 0], "theta_cross": [1, 1], "w_cross": [1, 1]}, "out of order"),
        ({"crossings": [0, 0], "theta_cross": [1, 1], "w_cross": [1, 1]}, "listed twice"),
        ({"crossings": [0.5], "theta_cross": [1.0], "w_cross": [1]}, "whole numbers"),
        ({"crossings": [0], "theta_cross": NONE, "w_cross": [1]}, "1 crossings need as many"),
    ):
        with pytest.raises(InstanceError, match=said):
            cf.Instance(**one, **wrong)
    given = {"crossings": [0, 1], "theta_cross": [0.3 - HALF + 1e-9, HALF - 1e-9], "w_cross": [0.5 + 1e-9, 1]}
    instance = cf.Instance(**one, **given)
    assert (instance.cross_target - HALF)[0] == pytest.approx(0.3, abs=1e-15)
    assert instance.theta_cross[1] == HALF
    assert instance.w_cross.tolist() == [0.5, 1]
    assert replace(instance).sha256 == instance.sha256
    assert not instance.theta_cross.flags.writeable


@pytest.mark.parametrize("ending", ["json", "npz"])
def test_files_keep_second_strokes(tmp_path, ending):
    for gauge in ("strokes", "box"):
        instance = crossed("full", gauge, 4)
        path = write_instance(instance, tmp_path / f"one.{ending}")
        again = read_instance(path)
        assert again.sha256 == instance.sha256
        assert second(again) == second(instance)
        field = cf.greedy(instance)
        kept = read_field(write_field(field, tmp_path / f"field.{ending}"), on=instance)
        assert kept.energy().total == field.energy().total


def test_documents_with_wrong_second_strokes_are_refused():
    document = json.loads(to_json(crossed()))
    first = document["strokes"][0][:2]
    for rows, said in (
        ([[0, 0, 1]], r"\$.crossings\[0\]"),
        ([[*first, 1, 2]], r"\$.crossings\[0\]\[3\]"),
        ([[1, 1, 1, 1]], r"crossing \[1, 1\] has no first stroke"),
        ([[*first, 1, 1]] * 2, "listed twice"),
        (document["strokes"] * 2, "list each stroke pixel once"),
        ({}, r"\$.crossings"),
    ):
        with pytest.raises(InstanceError, match=said):
            of_json(json.dumps(document | {"crossings": rows}))


def test_moves_of_the_sketch_take_second_strokes_along():
    for seed in range(4):
        instance = crossed("full", seed=seed)
        for move in ("turned", "mirrored", "transposed"):
            moved = getattr(instance, move)()
            back = moved
            for _ in range(3 if move == "turned" else 1):
                back = getattr(back, move)()
            assert second(back) == {key: pytest.approx(value) for key, value in second(instance).items()}
            first = replace(instance, theta=instance.theta * 0 + 1, w=instance.w * 0 + 1)
            assert len(second(getattr(first, move)())) == len(second(instance))
            between = [
                np.exp(2j * (each.theta_cross - each.theta[each.crossings])) for each in (instance, moved)
            ]
            assert sorted(between[0].real) == pytest.approx(sorted(between[1].real))


def test_parts_of_an_instance_keep_their_crossings():
    instance = crossed("full", seed=4)
    kept = np.arange(len(instance.theta)) != instance.crossings[0]
    rest = HiddenCurve(0, instance, np.array([instance.crossings[0]])).rest
    assert second(rest) == dict(list(second(instance).items())[1:]) == second(instance.with_strokes(kept))
    free = np.zeros(instance.grid.size, bool)
    free[instance.crossing_index[0]] = True
    field = cf.greedy(instance)
    piece = excerpt(field, free).field
    assert second(piece.instance).items() <= second(instance).items()
    assert second(piece.instance)


def test_deviation_gives_each_of_two_strokes_a_line_of_its_own():
    one = cf.Instance(
        "one", [[True]], [[0, 0]], [0.0], [1.0], crossings=[0], theta_cross=[0.2], w_cross=[1.0]
    )
    for alpha, beta in ((0.1, 0.0), (0.1 + HALF, 0.0)):
        field = CrossField(one, [alpha], [beta], [])
        assert sorted(field.stroke_deviation) == pytest.approx([0.1, HALF - 0.1])
    assert exchanged(one).theta_cross == [0.0]
