"""Numbers in messages are plain, and the advice of messages helps."""

import re

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.bundle.problem_files import write_all
from crossfield.models.errors import CrossfieldError

ALL = ["nl", "gms", "lp", "mps", "mod", "osil", "qplib", "bar"]
SCALAR = re.compile(r"np\.|\barray\(|dtype")
"""Marks of the representation of NumPy numbers and arrays, which plain numbers do not have."""


def one_stroke(theta=1.0, w=1.0, **weights):
    return cf.Instance.on_pixels("two", np.ones((1, 2), bool), [[0, 0]], [theta], [w], **weights)


def refusals(instance, folder):
    """Reasons of writers to refuse an instance, except polynomials beyond a format's degree."""
    manifests = write_all(instance, folder, formats=ALL)
    reasons = [reason for manifest in manifests for reason in manifest.document["refused"].values()]
    return [reason for reason in reasons if "nothing beyond" not in reason]


@pytest.mark.slow
@pytest.mark.parametrize(
    "refused, better",
    [
        ({"theta": 2e-8, "w": 1e-3}, {"theta": 0.0, "w": 1e-3}),
        ({"skew_coefficient": 1e-11}, {"skew_coefficient": 1e-8}),
        ({"skew_coefficient": 1e-11}, {"skew_coefficient": 0.0}),
    ],
)
def test_the_advice_of_a_writer_helps(refused, better, tmp_path):
    """A stroke that is nearly horizontal has a tiny cost at all weights; its direction can be changed."""
    reasons = refusals(one_stroke(**refused), tmp_path / "refused")
    assert reasons
    assert all(
        "nearly horizontal exactly 0" in reason and "larger (0 removes a term)" in reason
        for reason in reasons
    )
    assert not any(map(SCALAR.search, reasons))
    assert refusals(one_stroke(**better), tmp_path / "written") == []


def test_messages_about_numbers_of_numpy_are_plain():
    """Values from arrays, passed to every function that prints them."""
    mask, one = np.ones((1, 2), bool), np.float64(1.0)
    instance = one_stroke()
    field = cf.greedy_field(instance)
    wrong = [
        lambda: one_stroke(skew_coefficient=np.float64(-1.0)),
        lambda: one_stroke(stroke_coefficient=np.float64("nan")),
        lambda: one_stroke(theta=np.float64("inf")),
        lambda: one_stroke(w=np.float64(2.0)),
        lambda: cf.Instance.on_pixels("two", mask, np.array([[0, 7]]), [one], [one]),
        lambda: cf.Instance.on_pixels(
            "two", mask, np.array([[0, 0]]), [one], [one], pixel_size=np.float64(0.0)
        ),
        lambda: cf.Instance.on_pixels("two", mask, np.array([[0, 0]]), [one, one], [one]),
        lambda: cf.CrossField(instance, field.alpha[:1], field.beta, field.p),
        lambda: cf.CrossField(instance, field.alpha * np.nan, field.beta, field.p),
        lambda: cf.formulate(instance, "qp-fixed", p=field.p[:0]),
        lambda: cf.formulate(instance, "milp-mccormick", stroke_norm=np.int64(3)),
        lambda: cf.Limits(np.float64(-1.0), np.float64(0.0)),
    ]
    for act in wrong:
        with pytest.raises(CrossfieldError) as reasons:
            act()
        assert not SCALAR.search(str(reasons.value)), str(reasons.value)
