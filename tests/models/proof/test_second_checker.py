"""Certificates of `crossfield prove`, checked by a second program that follows the documentation."""

import ast
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import places
import pytest
import second_checker
from allowed_labels import with_allowed
from crossfield.models.field.field import CrossField
from crossfield.models.processes.limits import Limits
from crossfield.models.proof.certificate import read_certificate, write_certificate
from crossfield.models.proof.prove import prove
from crossfield.models.proof.tightening import windows_left
from crossfield.models.sketch.samples import sample
from exhaustive import optimum, random_instance, sketch
from plain_prover import proof_in_parts, proof_of
from second_checker import Refused, arrays_of, check

pytestmark = pytest.mark.numeric

SHIPPED = places.ROOT / "export" / "library" / "plan" / "known" / "points"
DENSE = 300_000  # bytes of a certificate; the dense tables of larger ones take too long


@pytest.fixture(scope="module")
def arrays(tmp_path_factory):
    """A certificate of four pixels and four levels, which needs all of them."""
    path = tmp_path_factory.mktemp("certificate") / "it.npz"
    write_certificate(proof_of(optimum(random_instance(1, (2, 2), 4)), levels=4), path)
    return arrays_of(path)


def confirmed(instance, path):
    """The field of a proof whose certificate the second checker confirms as optimal."""
    proof = prove(instance, limits=Limits(120.0, gap=0))
    written = write_certificate(proof, path)
    bound = check(arrays_of(path))
    assert written.status == "optimal"
    assert written.bound <= bound <= written.energy
    assert bound >= written.energy - 1e-10 * max(1, written.energy)
    return proof.field


@pytest.mark.parametrize("seed", [305, 306])
def test_optima_of_nine_pixels_are_confirmed(seed, tmp_path):
    confirmed(random_instance(seed, (3, 3), strokes=9), tmp_path / "it.npz")


@pytest.mark.parametrize("norm", [2, 1, "mixed"])
def test_a_part_without_strokes_has_no_cost_at_the_optimum(norm, tmp_path):
    """A field that has one there is not optimal, and the windows of that part stay whole."""
    theta = np.full((2, 5), np.nan)
    theta[0, 3], theta[1, 4] = 0.3, 1.2
    mask = np.ones((2, 5), bool)
    mask[:, 2] = False
    instance, path = sketch(mask, theta, 0.5), tmp_path / "it.npz"
    proof = prove(instance, norm=norm, jobs=1)
    written = write_certificate(proof, path)
    assert written.status == "optimal"
    assert written.bound <= check(arrays_of(path)) <= written.energy
    windows, apart = windows_left(written), instance.grid.columns < 2
    assert (windows.alpha_lower[apart] == instance.alpha_lower[apart]).all()
    assert (windows.alpha_upper[apart] == instance.alpha_upper[apart]).all()
    assert (np.abs([windows.beta_lower[apart], windows.beta_upper[apart]]) == np.pi / 4).all()
    assert (windows.alpha_upper - windows.alpha_lower)[~apart].min() < 1.0
    beta = proof.field.beta + np.where(instance.grid.rows + instance.grid.columns == 0, 0.1, 0.0)
    worse = CrossField(instance, proof.field.alpha, beta, proof.field.p)
    first = {"levels": proof.levels[:1], "branches": proof.branches[:1]}  # later ones hold for the energy
    found = write_certificate(replace(proof, field=worse, energy=worse.energy(norm).total, **first), path)
    assert (found.status, read_certificate(path).status) == ("gap", "gap")
    assert found.bound <= check(arrays_of(path)) <= written.energy


@pytest.mark.parametrize("gauge, seed", [("strokes", 6), ("box", 3)])
def test_the_bound_of_a_certificate_with_a_gap_is_confirmed(gauge, seed, tmp_path):
    """The convex step ends below the energy of the field, because a window binds."""
    path, instance = tmp_path / "it.npz", random_instance(seed, (2, 2), 4, gauge)
    written = write_certificate(proof_of(optimum(instance), levels=3, most=800), path)
    assert written.status == "gap"
    assert 0 < written.bound <= check(arrays_of(path)) <= written.bound + 1e-9


def test_a_level_in_two_parts_is_confirmed_and_none_may_be_left_out(tmp_path):
    """A part without a level counts with the bound of the level that was cut."""
    path, field = tmp_path / "it.npz", optimum(random_instance(1, (2, 2), 4))
    proof = proof_in_parts(field)
    whole = write_certificate(proof, path)
    assert whole.bound <= check(arrays_of(path)) <= whole.bound + 1e-9
    assert whole.bound > proof.bound + 0.1 * (field.energy().total - proof.bound)
    for kept in (0, 1), (0, 2):
        levels, branches = ([each[k] for k in kept] for each in (proof.levels, proof.branches))
        half = write_certificate(replace(proof, levels=levels, branches=branches), path)
        assert half.bound <= check(arrays_of(path)) <= half.bound + 1e-9
        assert half.bound < proof.bound + 1e-3


@pytest.mark.slow
def test_all_certificates_of_the_library_are_confirmed():
    paths = [path for path in sorted(SHIPPED.glob("*.certificate.npz")) if path.stat().st_size < DENSE]
    assert len(paths) > 70
    for path in paths:
        claimed = json.loads(arrays_of(path)["head"].tobytes())
        assert claimed["bound"] <= check(arrays_of(path)) <= claimed["energy"]


@pytest.mark.slow
@pytest.mark.parametrize("name, size", [("bottle", 24), ("saddle", 20)])
def test_samples_are_confirmed(name, size, tmp_path):
    """The last boxes of `saddle` are cut at four strokes."""
    confirmed(sample(name, size=size), tmp_path / "it.npz")


@pytest.mark.slow
def test_a_field_with_a_vortex_is_confirmed(tmp_path):
    field = confirmed(sample("cylinder_bend", size=16), tmp_path / "it.npz")
    assert len(field.singularities.row) == 1


def with_head(arrays, **changes):
    head = json.loads(arrays["head"].tobytes()) | changes
    return arrays | {"head": np.frombuffer(json.dumps(head).encode(), np.uint8)}


def test_a_bound_or_an_energy_raised_by_one_percent_is_refused(arrays):
    claimed = json.loads(arrays["head"].tobytes())
    with pytest.raises(Refused, match="head: the bound is"):
        check(with_head(arrays, bound=1.01 * claimed["energy"]))
    with pytest.raises(Refused, match="head: the energy is"):
        check(with_head(arrays, energy=1.01 * claimed["energy"]))


def test_shares_changed_by_a_hundredth_are_refused(arrays):
    """At every second label of one pair, so that a constant does not move from one pixel to the other."""
    level = json.loads(arrays["head"].tobytes())["levels"] - 2
    steps = arrays[f"level_{level}_steps_32"].copy()
    labels = arrays[f"level_{level}_ranges"][0, 1::2].prod()
    count = np.unpackbits(arrays[f"level_{level}_allowed"], count=labels).sum(dtype=int)
    jump = round(0.01 / arrays[f"level_{level}_scale"][0])
    steps[:count] += np.where(np.arange(count) % 2, jump, -jump).astype(np.int32)
    with pytest.raises(Refused, match=rf"level_{level + 1}_allowed: does not cover"):
        check(arrays | {f"level_{level}_steps_32": steps})


def test_a_dropped_label_is_refused(arrays):
    """The label of the field at the last pixel, at the second level."""
    ranges = arrays["level_1_ranges"].astype(int)
    before = ranges[:-1, 1::2].prod(axis=1).sum()
    k, _, low, lows = ranges[-1]
    bits = np.unpackbits(arrays["level_1_allowed"])
    assert bits[before - k * lows - low] == 1
    bits[before - k * lows - low] = 0
    with pytest.raises(Refused, match=r"level_1_allowed: does not cover .* at pixel \[1 1\]"):
        check(with_allowed(arrays, 1, bits))


def test_a_coarser_first_level_is_refused(arrays):
    """Labels that are left out at the edge of the strip."""
    bits = np.unpackbits(arrays["level_0_allowed"])
    bits[0] = 0
    with pytest.raises(Refused, match=r"level_0_allowed: does not cover the strip at pixel \[0 0\]"):
        check(with_allowed(arrays, 0, bits))


def test_it_imports_nothing_but_numpy_and_the_standard_library():
    imported = set()
    for node in ast.walk(ast.parse(Path(second_checker.__file__).read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            imported |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            imported.add(node.module)
    assert imported - {"numpy"} <= sys.stdlib_module_names
