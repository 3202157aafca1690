"""The command `evaluate` and its function: exact fields, reports, and the effect of Ctrl-C."""

import json

import crossfield as cf
import numpy as np
import pytest
from children import interrupted
from crossfield.export.cli.app import invoke
from crossfield.export.solving.methods import METHODS
from crossfield.models.errors import InputError
from crossfield.models.evaluation.hidden import hidden_curves
from crossfield.models.sketch.tracing import curves_of

LINES = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><g fill="none" stroke="black">'
    + "".join(f'<path d="M{x} 5 L{x + 40} 95"/>' for x in (5, 18, 31, 44, 57))
    + "</g></svg>"
)


def test_a_hidden_line_among_parallel_ones_is_found(tmp_path):
    sketch = tmp_path / "lines.svg"
    sketch.write_text(LINES)
    found = cf.evaluate(cf.read_sketch(sketch, size=24), sketch=sketch, methods=["greedy", "power"])
    assert len(found.curves) == 5
    for method in found.methods:
        assert found.summary(method).count == 5
        assert found.summary(method).mean < 1e-3


def test_the_same_drawing_gives_the_same_report(tmp_path, capsys):
    for name in "ab":
        command = ["evaluate", "saddle", "--size", "16", "-m", "greedy", "-m", "power", "--curves", "3"]
        assert invoke([*command, "--json", "-o", str(tmp_path / name)]) == 0
        printed = json.loads(capsys.readouterr().out)
        assert printed == json.loads((tmp_path / name / "saddle.evaluation.json").read_text())
    assert len({path.read_bytes() for path in tmp_path.glob("*/saddle.evaluation.json")}) == 1
    assert [row["pixels"] for row in printed["curves"]] == sorted(
        (row["pixels"] for row in printed["curves"]), reverse=True
    )
    for method in ("greedy", "power"):
        angles = [row["degrees"][method] for row in printed["curves"]]
        facts = printed["methods"][method]
        assert facts["curves"] == len(angles) == 3
        assert (facts["mean"], facts["median"]) == (pytest.approx(np.mean(angles)), np.median(angles))
        assert 0 < facts["mean"] < 22.5
    assert printed["interrupted"] is False
    assert printed["instance"]["sha256"] == cf.sample("saddle", 16).sha256


def test_the_angles_are_those_of_fields_made_without_the_curve():
    """Each curve by hand: strokes of one number taken out, a greedy field, the nearer line."""
    instance = cf.sample("mouse", 16, stroke_weight=10.0)
    found = cf.evaluate(instance, sketch="mouse", methods=["greedy"], curves=2)
    assert found.document()["instance"]["stroke_weight"] == 10.0
    assert (found.drawn, cf.evaluate(instance, methods=["greedy"], curves=2).drawn) == (True, False)
    curves = hidden_curves(found.instance, curves_of(instance, "mouse"), 2)
    for row, hidden in zip(found.curves, curves, strict=True):
        field = cf.greedy_field(hidden.rest)
        at = instance.stroke_pixels[hidden.stroke]
        pixel = instance.grid.number[at[:, 0], at[:, 1]]
        theta = instance.theta[hidden.stroke]
        way = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
        cosine = np.maximum(*(np.abs((lines[pixel] * way).sum(axis=1)) for lines in (field.u, field.v)))
        angle = np.degrees(np.arccos(np.minimum(cosine, 1)))
        assert row.degrees["greedy"] == pytest.approx(angle.mean(), abs=1e-5)
        assert row.pixels == len(theta)


def test_the_table_has_a_row_for_each_curve_and_the_means(capsys):
    assert invoke(["evaluate", "bottle", "--size", "16", "--method", "greedy"]) == 0
    lines = capsys.readouterr().out.splitlines()
    shown = [line.split() for line in lines]
    assert max(map(len, lines)) <= 80
    for word in ("mean", "median", "standard"):
        assert sum(bool(row) and row[0] == word for row in shown) == 1
    assert "22.5 at random" in lines[-1]


def test_what_cannot_be_is_refused(capsys):
    assert invoke(["evaluate", "mouse", "-m", "wings"]) == 1
    assert "there is no method 'wings'" in capsys.readouterr().err
    with pytest.raises(InputError, match="'wings'; choose one of greedy"):
        cf.evaluate(cf.sample("mouse", 8), methods=["wings"])
    single = cf.Instance("single", np.ones((6, 6)), [[2, 1], [2, 2], [2, 3]], np.zeros(3), np.ones(3))
    with pytest.raises(InputError, match="single has no curve of 3 pixels or more"):
        cf.evaluate(single)


CHILD = """
import signal, socket
import crossfield as cf
ours, theirs = socket.socketpair()
theirs.setblocking(False)
signal.set_wakeup_fd(theirs.fileno())
def show(line):
    if line.startswith("curve 2"):
        print(2, flush=True)
        ours.recv(1)  # until the signal is there
found = cf.evaluate(cf.sample("mouse", 12), sketch="mouse", methods=["greedy"], progress=show)
print(found.interrupted, len(found.curves), found.summary("greedy").count)
"""


def test_ctrl_c_keeps_the_curves_done_so_far():
    assert interrupted(CHILD) == ["True", "1", "1"]


@pytest.mark.slow
def test_every_method_can_be_measured():
    found = cf.evaluate(
        cf.sample("saddle", 12), sketch="saddle", methods=METHODS, curves=1, limits=cf.Limits(10)
    )
    assert not found.curves[0].failures
    assert set(found.curves[0].degrees) == set(METHODS)
