"""Patches that exact solvers solve: pieces of a field, the search over them, and what it promises."""

import json

import crossfield as cf
import numpy as np
import pytest
from children import interrupted
from crossfield.export.cli.app import invoke
from crossfield.export.solving.patches import PATCH_SOLVERS, search_patches
from crossfield.models.field.field import CrossField
from crossfield.models.instance.instance import QUARTER
from crossfield.models.search.excerpt import excerpt
from crossfield.models.search.starts import first_field
from exhaustive import exact, random_instance
from hypothesis import given, settings
from hypothesis import strategies as st

pytestmark = pytest.mark.numeric

SEEDS = st.integers(0, 2**32 - 1)


@given(seed=SEEDS, gauge=st.sampled_from(["strokes", "box"]))
@settings(deadline=None, max_examples=40)
def test_a_piece_changes_its_energy_as_the_whole_field_does(seed, gauge):
    rng = np.random.default_rng(seed)
    field = first_field(random_instance(seed, gauge=gauge))
    free = rng.random(field.instance.grid.size) < 0.3
    free[rng.integers(len(free))] = True
    piece = excerpt(field, free)
    own = piece.field
    changed = CrossField(
        own.instance,
        np.where(piece.free, rng.uniform(own.instance.alpha_lower, own.instance.alpha_upper), own.alpha),
        np.where(piece.free, rng.uniform(-QUARTER, QUARTER, len(own.beta)), own.beta),
        np.where(_touched(own.instance.grid, piece.free), rng.integers(-2, 3, len(own.p)), own.p),
    )
    whole = piece.put_back(changed, field)
    for norm in (1, 2):
        assert whole.energy(norm).total - field.energy(norm).total == pytest.approx(
            changed.energy(norm).total - own.energy(norm).total, abs=1e-9
        )
    outside = ~free
    assert (whole.alpha[outside] == field.alpha[outside]).all()
    assert (whole.beta[outside] == field.beta[outside]).all()
    assert (whole.p == field.p)[~_touched(field.instance.grid, free)].all()


def _touched(grid, free):
    return free[grid.first] | free[grid.second]


def test_a_piece_without_strokes_takes_the_nearest_one_along():
    field = first_field(cf.Instance("row", [[True] * 9], [[0, 0], [0, 8]], [0.3, 1.0], [1.0, 1.0]))
    free = np.arange(9) == 4
    piece = excerpt(field, free)
    assert np.nonzero(piece.pixels)[0].tolist() == [0, 3, 4, 5]
    assert piece.field.instance.theta.tolist() == [0.3]
    assert np.nonzero(piece.pairs)[0].tolist() == [3, 4]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_patches_as_large_as_the_grid_reach_the_optimum_over_all_jumps(seed):
    instance = random_instance(seed, shape=(2, 2), strokes=4)
    start = instance_start(instance, seed)
    found = search_patches(start, seconds=1000, jobs=1)
    least = exact(instance)
    assert found.ended == "patches"
    assert found.closed == found.patches
    assert found.lower > 0
    assert found.field.energy().total >= least - 1e-9
    if np.abs(found.field.beta).max() < QUARTER - 1e-3:
        assert found.field.energy().total == pytest.approx(least, rel=1e-5, abs=1e-9)


def instance_start(instance, seed):
    """A poor field to start from: random crosses with random jumps."""
    rng = np.random.default_rng(seed)
    alpha = rng.uniform(instance.alpha_lower, instance.alpha_upper)
    p = rng.integers(instance.p_min, instance.p_max + 1)
    return CrossField(instance, alpha, np.zeros(instance.grid.size), p)


@pytest.mark.slow
@pytest.mark.parametrize("solver", PATCH_SOLVERS)
def test_patches_never_raise_the_energy_and_stay_inside_the_bounds(solver):
    start = first_field(cf.sample("mouse", 10))
    told = []
    found = search_patches(
        start, seconds=2.0, solver=solver, jobs=2, progress=lambda *line: told.append(line)
    )
    field = found.field
    assert field.energy().total <= start.energy().total
    assert found.lower == 0 or field.energy().total < start.energy().total
    assert (np.abs(field.beta) <= QUARTER).all()
    assert (field.alpha >= field.instance.alpha_lower).all()
    assert (field.alpha <= field.instance.alpha_upper).all()
    # On a busy machine no patch ends within the time, and nothing is told.
    assert told[-1:] == [(found.patches, field.energy().total)] * bool(found.patches)
    assert 0 <= found.closed <= found.patches
    assert found.ended in {"time", "patches"}


@pytest.mark.parametrize(
    "given", [{"seconds": 0}, {"seconds": 1, "jobs": 0}, {"seconds": 1, "solver": "ipopt"}]
)
def test_limits_and_solvers_that_cannot_be_are_refused(given):
    with pytest.raises(cf.CrossfieldError, match=r"positive|solves no patches; choose one of highs, bonmin"):
        search_patches(first_field(cf.sample("skew", 6)), **given)


@pytest.mark.slow
def test_from_the_command_line_with_highs(tmp_path, capsys):
    """On a grid as small as a patch all patches are solved to the end, long before the limit."""
    instance = random_instance(1, shape=(2, 2), strokes=4)
    path = cf.write_instance(instance, tmp_path / "small.json")
    command = ["solve", str(path), "--method", "patches", "--solver", "highs", "--time-limit", "1000"]
    assert invoke([*command, "--json", "-o", str(tmp_path)]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["patches"] == facts["patches_closed"] > 0
    assert facts["patches_lower"] >= 0
    assert facts["energy_2_norm"] <= first_field(instance).energy().total


CHILD = """
import crossfield as cf
from crossfield.export.cli.app import invoke
from crossfield.export.solving.patches import search_patches
from crossfield.models.search.starts import first_field
if True:
    tell = lambda patches, energy: print(patches, flush=True)
    found = search_patches(first_field(cf.sample("mouse", 12)), seconds=600, solver="highs", progress=tell)
    print(found.ended, found.field.energy().total)
"""


@pytest.mark.slow
def test_ctrl_c_gives_the_best_field_so_far():
    ended, energy = interrupted(CHILD)
    assert ended == "interrupted"
    assert float(energy) <= first_field(cf.sample("mouse", 12)).energy().total + 1e-9
