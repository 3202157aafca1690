"""The weights of strokes and skew, on the command line and in Python."""

import crossfield as cf
import numpy as np
import pytest
from command_line import invoke
from small_drawings import sample_svg

GIVEN = ["--stroke-weight", "10", "--skew-weight", "1e-4"]
WEIGHTS = {"stroke_weight": 10.0, "skew_weight": 1e-4}


def test_a_sketch_a_sample_and_an_instance_file_get_the_weights(tmp_path):
    """An instance file keeps its other properties, and each weight that is not given."""
    drawing = tmp_path / "mouse.svg"
    drawing.write_text(sample_svg("mouse"), encoding="utf-8")
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


def test_the_greatest_weights_depend_on_the_size_of_the_grid():
    for name, most in (("stroke_weight", 1e6 / 6), ("skew_weight", 1e6 / 36)):
        with pytest.raises(
            cf.InstanceError, match=rf"{name} is 1000000.0; .* and {most:g} on a grid of 4 pixels"
        ):
            cf.sample("skew", 4, **{name: 1e6})
        assert getattr(cf.sample("skew", 4, **{name: most}), name) == pytest.approx(most)
        assert cf.sample("skew", 24, **{name: 1e6}).stroke_coefficient > 0


def test_a_weight_means_the_same_on_every_grid():
    """Each pixel cut in four, its stroke through two of them: the field's energy is the same in all terms."""
    rows, energies = np.arange(5), []
    for cells in (1, 2):
        pixels = np.stack([np.arange(5 * cells), np.full(5 * cells, 3 * cells)], axis=1)
        theta = np.repeat(0.3 + 0.1 * rows, cells)
        mask = np.ones((5 * cells, 7 * cells), dtype=bool)
        plain = cf.Instance.on_pixels("grid", mask, pixels, theta, np.ones(len(theta)))
        instance = plain.with_weights(stroke_weight=3.0, skew_weight=1e-2)
        scale = 24 / max(mask.shape)
        assert instance.stroke_coefficient == pytest.approx(3 * scale)
        assert instance.skew_coefficient == pytest.approx(1e-2 * scale**2)
        assert (instance.stroke_weight, instance.skew_weight) == (3.0, 1e-2)
        size = instance.domain.size
        jumps = np.zeros(len(instance.domain.first), dtype=int)
        energies.append(cf.CrossField(instance, np.full(size, 0.5), np.full(size, 0.1), jumps).energy())
    assert energies[0].strokes == pytest.approx(energies[1].strokes)
    assert energies[0].beta == pytest.approx(energies[1].beta)
    assert min(energies[0].strokes, energies[0].beta) > 0


def test_an_instance_of_its_own_has_the_coefficients_of_the_paper():
    mask = np.ones((2, 30), dtype=bool)
    instance = cf.Instance.on_pixels("own", mask, np.array([[0, 0]]), np.zeros(1), np.ones(1))
    assert (instance.stroke_coefficient, instance.skew_coefficient) == (1.0, 1e-6)
    assert "stroke weight" not in instance.summary
