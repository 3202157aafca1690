"""Both strokes at a pixel where two meet: the energy, every formulation and file of it, and what searches."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from cases import make_field, make_problem
from crossed import crossed, exchanged
from crossfield.export.bundle.manifest import write_all
from crossfield.export.formats.registry import FORMATS
from crossfield.export.library.documents.check_point import check
from crossfield.export.solvers_table import PROGRAMS
from crossfield.export.verify.verify import Verdict, verify
from crossfield.export.writing.names import column_names
from crossfield.models.errors import InstanceError
from crossfield.models.field.field import CrossField
from crossfield.models.formulations.catalogue import FORMULATIONS, MIXED_NORM, ONE_NORM, declare
from crossfield.models.instance.file import arrays_of, write_instance
from crossfield.models.instance.instance import HALF, QUARTER
from crossfield.models.proof.check_certificate import RefusedError, sketch_of
from crossfield.models.search.box_lp import Residuals
from crossfield.models.search.box_qp import fitted
from crossfield.models.search.energy import energy_at
from crossfield.models.search.landscape import Landscape, Patch
from crossfield.models.smooth.polyvector import polyvector_field
from crossfield.models.smooth.power_field import power_field
from exhaustive import every_jump
from loops import for_each

GAUGES = ["strokes", "box"]


def one(apart, w_beta=1e-6, gauge="strokes", weights=(1.0, 1.0), theta=0.3):
    """One pixel with two strokes so many radians apart."""
    return cf.Instance(
        "one", [[True]], [[0, 0]], [theta], [weights[0]], w_beta=w_beta, gauge=gauge,
        crossings=[0], theta_cross=[theta + apart], w_cross=[weights[1]],
    )  # fmt: skip


def test_two_strokes_at_60_degrees_by_hand():
    """Angles 60 degrees apart need |beta| = 15 degrees; strokes of weight 1 give way for w_beta.

    With x = pi/12 the energy 2 (x - |beta|)^2 + w_beta beta^2 is least at |beta| = 2 x / (2 + w_beta).
    """
    for w_beta in (0.0, 1e-6, 0.5):
        instance = one(np.pi / 3, w_beta)
        found = fitted(CrossField(instance, [0.3], [0.0], []))
        x = np.pi / 12
        assert found.beta == pytest.approx([2 * x / (2 + w_beta)])
        assert found.energy().total == pytest.approx(2 * x**2 * w_beta / (2 + w_beta), rel=1e-9, abs=1e-15)
        if w_beta == 0:
            assert found.stroke_deviation == pytest.approx([0, 0], abs=1e-9)
            assert found.residual_x == pytest.approx([0], abs=1e-9)
    alone = fitted(CrossField(one(np.pi / 3).without_crossings(), [0.3], [0.0], []))
    assert alone.stroke_deviation == pytest.approx([0], abs=1e-9)
    assert alone.energy().total == pytest.approx(0, abs=1e-12)


def norms(field, name):
    """The energy that a formulation minimises, of a field."""
    one, two = field.energy(1), field.energy(2)
    minimises = FORMULATIONS[name].minimises
    if minimises == MIXED_NORM:
        return one.smooth + two.strokes + two.beta
    return one.total if minimises == ONE_NORM else two.total


@for_each("gauge", GAUGES)
@for_each("shape", ["hole", "pixel", "full"])
def test_objectives_are_the_energies_of_the_field(shape, gauge):
    for seed in range(3):
        instance = crossed(shape, gauge, seed)
        field = make_field(instance, seed)
        alone = CrossField(instance.without_crossings(), field.alpha, field.beta, field.p)
        second = instance.w_strokes * instance.w_cross @ field.residual_x**2
        assert field.energy().strokes == pytest.approx(alone.energy().strokes + second)
        for name in FORMULATIONS:
            problem = make_problem(name, instance)
            own = field if problem.jumps is None else replace(field, p=problem.jumps)
            point = problem.point(own)
            assert problem.objective_value(point) == pytest.approx(norms(own, name), rel=1e-12)
            assert problem.violation(point).worst < 1e-12


@for_each("gauge", GAUGES)
def test_sums_of_searches_are_the_energy(gauge):
    """The quadratic at given jumps, up to its constant, and the residuals of the 1-norm."""
    instance = crossed("full", gauge, 4)
    one, other = make_field(instance, 1), make_field(instance, 2)
    other = replace(other, p=one.p)
    form = energy_at(instance, one.p)
    x, y = (np.concatenate([field.alpha, field.beta]) for field in (one, other))
    change = form.change(form.slope(x), y - x)
    assert change == pytest.approx(other.energy().total - one.energy().total)
    terms = Residuals.at(instance, one.p)
    assert terms.weight @ np.abs(terms.matrix @ x + terms.constant) == pytest.approx(one.energy(1).total)


def test_formulations_have_second_strokes_only_where_there_are_some():
    instance = crossed()
    for name in FORMULATIONS:
        assert make_problem(name, instance).formulation == declare(name)
        without = make_problem(name, instance.without_crossings()).formulation
        assert without == declare(name).without_crossings
        assert "chi" not in without.variables
    rows = make_problem("milp-mccormick", instance).rows
    assert [row.family.tag for row in rows if row.family.over == "crossings"] == ["x22", "x23"]


def read_by(programs, instance, folder, formulations, formats=tuple(FORMATS)):
    """What programs say of files of an instance, in every format unless some are named, by verdict."""
    write_all(instance, folder, formulations, formats, start=make_field(instance))
    checks = verify(folder, programs=[name for name in programs if PROGRAMS[name].present]).checks
    return Counter(check.verdict for check in checks)


@pytest.mark.parametrize(
    "program,formats",
    [
        pytest.param("highs", ("lp", "mps"), marks=pytest.mark.needs("highs")),
        pytest.param("asl", ("nl",), marks=pytest.mark.needs("asl")),
    ],
)
def test_readers_read_both_strokes(tmp_path, program, formats):
    """HiGHS reads LP and MPS; the AMPL Solver Library evaluates the .nl file at random points."""
    instance = crossed("hole", "box", 3)
    found = read_by((program,), instance, tmp_path, ("milp-mccormick",), formats)
    assert found.keys() <= {Verdict.AGREES, Verdict.REFUSED}
    assert found[Verdict.AGREES] >= len(formats)


@pytest.mark.oracles
@pytest.mark.slow
@for_each("gauge", GAUGES)
def test_every_reader_reads_both_strokes(tmp_path, gauge):
    """All formulations in all formats, by every program that is here."""
    found = read_by(tuple(PROGRAMS), crossed("hole", gauge, 3), tmp_path / gauge, tuple(FORMULATIONS))
    assert found.keys() <= {Verdict.AGREES, Verdict.REFUSED}


@for_each("gauge", GAUGES)
def test_the_checker_of_points_counts_both_strokes(tmp_path, gauge):
    instance = crossed("hole", gauge, 2)
    field = make_field(instance)
    problem = make_problem("milp-mccormick", instance)
    path = write_instance(instance, tmp_path / f"{gauge}.instance.json")
    names = (bytes(name).strip(b"\0").decode() for name in column_names(problem))
    values = zip(names, problem.point(field).tolist(), strict=True)
    point = tmp_path / f"{gauge}.sol"
    point.write_text("=obj= 0\n" + "".join(f"{name} {value!r}\n" for name, value in values))
    found = check(str(path), str(point))
    assert float(found.objective) == pytest.approx(field.energy(2).total, rel=1e-12)
    assert found.worst < 1e-12


def three_in_a_row(seed):
    """A random instance of three pixels whose second strokes are 60 degrees off the first ones, or more."""
    rng = np.random.default_rng(seed)
    at = np.nonzero(rng.random(3) < 0.6)[0]
    theta = rng.uniform(0, np.pi, 3)
    return cf.Instance(
        "three", [[True] * 3], [[0, 0], [0, 1], [0, 2]], theta, rng.uniform(0.1, 1, 3), w_beta=1e-3,
        crossings=at,
        theta_cross=theta[at] + rng.uniform(np.pi / 3, 2 * np.pi / 3, len(at)),
        w_cross=rng.uniform(0.1, 1, len(at)),
    )  # fmt: skip


def least(instance):
    """The least energy within all bounds: angles fitted to all jumps there are."""
    nothing = np.zeros(instance.grid.size)
    jumps = (p for part in every_jump(instance) for p in part)
    return min(fitted(CrossField(instance, nothing, nothing, p)).energy().total for p in jumps)


def test_which_stroke_comes_first_does_not_matter():
    """Neither exchanging the strokes nor turning or mirroring the sketch changes the optimum."""
    instance = three_in_a_row(1)
    optimum = least(instance)
    for other in (exchanged(instance), instance.turned(), instance.mirrored(), instance.transposed()):
        assert least(other) == pytest.approx(optimum, rel=1e-9)


def test_the_search_finds_the_least_energy_over_all_jumps():
    instance = three_in_a_row(4)
    found = cf.search(instance, rounds=1, jobs=1).field
    assert found.energy().total == pytest.approx(least(instance), rel=1e-9)


def test_a_patch_has_the_energy_of_both_strokes():
    instance = crossed("full", seed=4)
    field = cf.greedy(instance)
    x = np.concatenate([field.alpha, field.beta])
    for pixels in (instance.crossing_index, np.arange(instance.grid.size)):
        free = np.zeros(instance.grid.size, bool)
        free[pixels] = True
        point = Landscape(Patch.of(instance, free), x, field.p).point
        alpha, beta = np.split(point.x, 2)
        assert point.energy == pytest.approx(CrossField(instance, alpha, beta, point.p).energy().total)
        assert point.energy <= field.energy().total + 1e-9


def test_smooth_fields_take_both_strokes():
    """A PolyVector has both as roots; the power field the mean of their crosses."""
    instance = one(np.pi / 3, w_beta=0.0)
    assert polyvector_field(instance, hold=100.0).stroke_deviation == pytest.approx([0, 0], abs=1e-6)
    assert polyvector_field(instance).energy().total == pytest.approx(0, abs=1e-9)
    middle = (0.3 + np.pi / 6 - QUARTER + np.array([0, HALF])) % HALF
    assert power_field(instance).alpha % HALF == pytest.approx(middle[:1], abs=1e-6)
    u, v = np.full(1, 0.3 + np.pi / 3), np.full(1, 0.3 + 5 * np.pi)
    assert CrossField.from_lines(instance, u, v).energy().total == pytest.approx(0, abs=1e-9)


def test_proofs_and_certificates_refuse_crossings():
    instance = crossed()
    with pytest.raises(InstanceError, match=r"1 such pixels; search, or prove instance\.without_crossings"):
        cf.prove(instance)
    with pytest.raises(RefusedError, match="instance_crossings says"):
        sketch_of({f"instance_{name}": array for name, array in arrays_of(instance).items()})
