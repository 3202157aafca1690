"""Curves that cross, where the instance knows both strokes: hiding one of them leaves the other."""

from __future__ import annotations

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.evaluation.hidden import hidden_curves
from crossfield.models.field.field import CrossField
from crossfield.models.instance.instance import HALF
from crossfield.models.sketch.tracing import chains, curves_of

SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 90"><g fill="none" stroke="black">'
    '<path d="M5 45 H85"/><path d="M45 5 V85"/><path d="M5 15 H85"/></g></svg>'
)


def plus(tmp_path):
    """A level and an upright curve through the middle of 9 x 9 pixels, both known there; a level one above.

    Where the upright curve meets the upper one only the upper one is known.
    """
    path = tmp_path / "plus.svg"
    path.write_text(SVG)
    pixels = sorted({(4, k) for k in range(9)} | {(k, 4) for k in range(9)} | {(1, k) for k in range(9)})
    theta = [0.0 if row in (1, 4) else HALF for row, _ in pixels]
    theta[pixels.index((4, 4))] = HALF
    return path, cf.Instance(
        "plus", np.ones((9, 9), bool), pixels, theta, np.linspace(0.5, 1, len(pixels)), pixel_size=10.0,
        crossings=[pixels.index((4, 4))], theta_cross=[0.0], w_cross=[0.25],
    )  # fmt: skip


def test_hiding_a_curve_leaves_the_other_stroke_of_a_crossing(tmp_path):
    path, instance = plus(tmp_path)
    (at,) = instance.crossings
    for curve in (curves_of(instance, path), chains(instance)):
        assert len(curve) == len(instance.theta) + 1
        level, upright = curve[-1], curve[at]
        assert level != upright
        assert np.abs(instance.every_stroke[1][curve == level]).max() < 1e-9
        assert np.abs(instance.every_stroke[1][curve == upright] - HALF).max() < 1e-9
        found = {hidden.number: hidden for hidden in hidden_curves(instance, curve, 9)}
        for number, theta, w in ((level, HALF, instance.w[at]), (upright, 0.0, 0.25)):
            rest = found[number].rest
            assert not len(rest.crossings)
            middle = (rest.stroke_pixels == 4).all(axis=1)
            assert rest.theta[middle] == pytest.approx([theta], abs=1e-9)
            assert rest.w[middle] == pytest.approx([w])
            assert len(rest.theta) == len(instance.theta) + 1 - len(found[number].stroke)
            straight = CrossField(rest, np.full(81, 0.1), np.zeros(81), np.zeros(144, int))
            assert found[number].deviation(straight) == pytest.approx(0.1)
