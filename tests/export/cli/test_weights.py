"""The weights of strokes and skew, on the command line and in Python."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.models.errors import InstanceError
from crossfield.models.instance.instance import MOST_WEIGHT
from crossfield.models.sketch.samples import sample_svg

GIVEN = ["--stroke-weight", "10", "--skew-weight", "1e-4"]
WEIGHTS = {"stroke_weight": 10.0, "skew_weight": 1e-4}


@pytest.fixture
def drawing(tmp_path):
    path = tmp_path / "mouse.svg"
    path.write_text(sample_svg("mouse"), encoding="utf-8")
    return path


def test_a_sketch_a_sample_and_an_instance_file_get_the_weights(tmp_path, drawing):
    """An instance file keeps its other properties, and each weight that is not given."""
    file = cf.write_instance(cf.sample("mouse", 8, skew_weight=1e-3), tmp_path / "file.json")
    for source, size, wanted in (
        (drawing, ["--size", "8"], cf.read_sketch(drawing, size=8, **WEIGHTS)),
        ("mouse", ["--size", "8"], cf.sample("mouse", 8, **WEIGHTS)),
        ("wave_sheet", ["--size", "8"], cf.sample("wave_sheet", 8, **WEIGHTS)),
        (file, [], cf.sample("mouse", 8, **WEIGHTS)),
    ):
        path = tmp_path / "made.npz"
        assert invoke(["instance", str(source), *size, *GIVEN, "-o", str(path)]) == 0
        instance = cf.read_instance(path)
        assert instance.sha256 == wanted.sha256
        assert (instance.stroke_weight, instance.skew_weight) == (10.0, 1e-4)
    kept = cf.sample("mouse", 8, skew_weight=1e-3).with_weights(stroke_weight=10)
    assert (kept.stroke_weight, kept.skew_weight) == (10.0, 1e-3)
    assert len({kept.sha256, instance.sha256, cf.read_instance(file).sha256}) == 3


def test_weights_out_of_range_are_refused(tmp_path, capsys, drawing):
    file = cf.write_instance(cf.sample("skew", 4), tmp_path / "skew.json")
    for option, value in (("--stroke-weight", "-1"), ("--skew-weight", "nan"), ("--stroke-weight", "1e7")):
        name = option[2:].replace("-", "_")
        for source in ("skew", drawing, file):
            assert invoke(["instance", str(source), option, value, "-o", str(tmp_path / "out.npz")]) == 1
            assert f"crossfield: {name} is {float(value)}; it must be between 0" in capsys.readouterr().err
        with pytest.raises(InstanceError, match=f"{name} is"):
            cf.read_sketch(drawing, size=8, **{name: float(value)})
    assert not (tmp_path / "out.npz").exists()
    for name, most in (("stroke_weight", MOST_WEIGHT / 6), ("skew_weight", MOST_WEIGHT / 36)):
        weights = {name: MOST_WEIGHT}
        with pytest.raises(
            InstanceError, match=rf"{name} is 1000000.0; .* and {most:g} on a grid of 4 pixels"
        ):
            cf.sample("skew", 4, **weights)
        assert getattr(cf.sample("skew", 4, **{name: most}), name) == pytest.approx(most)
        assert cf.sample("skew", 24, **weights).stroke_coefficient > 0


def test_a_weight_means_the_same_on_every_grid():
    """Each pixel cut in four, its stroke through two of them: the field's energy is the same in all terms."""
    mask = np.ones((5, 7), dtype=bool)
    rows = np.arange(5)
    coarse = cf.Instance.on_pixels(
        "coarse", mask, np.stack([rows, 3 + 0 * rows], axis=1), 0.3 + 0.1 * rows, np.ones(5)
    )
    fine_rows = np.arange(10)
    fine = cf.Instance.on_pixels(
        "fine",
        np.ones((10, 14), dtype=bool),
        np.stack([fine_rows, 6 + 0 * fine_rows], axis=1),
        np.repeat(coarse.theta, 2),
        np.ones(10),
    )
    energies = []
    for instance in (
        coarse.with_weights(stroke_weight=3.0, skew_weight=1e-2),
        fine.with_weights(stroke_weight=3.0, skew_weight=1e-2),
    ):
        scale = 24 / max(instance.mask.shape)
        assert (instance.stroke_coefficient, instance.skew_coefficient) == pytest.approx(
            (3 * scale, 1e-2 * scale**2)
        )
        assert (instance.stroke_weight, instance.skew_weight) == (3.0, 1e-2)
        size = instance.grid.size
        alpha, pairs = np.full(size, 0.5), np.zeros(len(instance.grid.first), dtype=int)
        energies.append(cf.CrossField(instance, alpha, np.full(size, 0.1), pairs).energy())
    assert energies[0].strokes == pytest.approx(energies[1].strokes)
    assert energies[0].beta == pytest.approx(energies[1].beta)
    assert min(energies[0].strokes, energies[0].beta) > 0


def test_an_instance_of_its_own_has_the_coefficients_of_the_paper():
    mask = np.ones((2, 30), dtype=bool)
    instance = cf.Instance.on_pixels("own", mask, np.array([[0, 0]]), np.zeros(1), np.ones(1))
    assert (instance.stroke_coefficient, instance.skew_coefficient) == (1.0, 1e-6)
    assert "stroke weight" not in instance.summary


def test_a_start_under_other_weights_is_refused_with_both(tmp_path, capsys):
    cf.write_field(cf.greedy_field(cf.sample("skew", 4)), tmp_path / "field.npz")
    heavy = str(cf.write_instance(cf.sample("skew", 4, stroke_weight=10), tmp_path / "heavy.json"))
    start = ["--start", str(tmp_path / "field.npz"), "-o", str(tmp_path / "out")]
    assert invoke(["solve", heavy, "-m", "search", *start]) == 1
    printed = capsys.readouterr().err
    assert "stroke weight 10" in printed
    assert "size, gauge and weights" in printed
