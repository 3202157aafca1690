"""Proofs whose levels are cut into branches: the cells that they hold together, and their check."""

from dataclasses import replace

import numpy as np
import pytest
import second_checker
from crossfield.models.errors import InputError
from crossfield.models.processes.compiled import crew
from crossfield.models.proof.certificate import read_certificate, write_certificate
from crossfield.models.proof.lattice import Lattice
from crossfield.models.proof.pruning import branches, finer, prolonged, remaining_cells
from crossfield.models.proof.record import LevelRecord, Proof
from crossfield.models.proof.sweep import Dual
from crossfield.models.search.starts import first_field
from exhaustive import optimum, random_instance

pytestmark = pytest.mark.numeric


INSTANCE = random_instance(305, (3, 3), strokes=9)


@pytest.fixture(scope="module")
def cut():
    """A proof of three generations: a level, four branches of it, and one level after each of these."""
    field = first_field(INSTANCE)
    energy, records, parents = field.energy().total, [], [-1]
    with crew(1) as hands:
        root = Dual(Lattice.whole(field, 8), hands)
        root.ascend(5)
        records.append(LevelRecord.of(root, energy))
        parts = branches(root, 4)
        for part in parts:
            part.ascend(5)
            records.append(LevelRecord.of(part, energy))
            parents.append(0)
        for number, part in enumerate(parts, 1):
            after = prolonged(part, finer(remaining_cells(part, records[number].bound, energy)))
            after.ascend(5)
            records.append(LevelRecord.of(after, energy))
            parents.append(number)
    leaves = [records[number].bound for number in set(range(len(records))) - set(parents)]
    bound = min(energy, *leaves)
    return Proof(field, energy, bound, "gap", 0, tuple(records), 0.0, "gap", 2, tuple(parents))


def test_branches_cut_one_pixel_and_hold_all_cells_together(cut):
    whole, *parts = cut.levels[:5]
    pixel = np.repeat(np.arange(9), whole.alpha_count * whole.beta_count)
    missing = [set(pixel[whole.allowed & ~part.allowed]) for part in parts]
    assert len(set().union(*missing)) == 1
    assert np.any([part.allowed for part in parts], axis=0).tolist() == whole.allowed.tolist()
    # Records round both shares of 12 pairs to a quantum: off by half of one, at a pixel and at the pair.
    rounded = 2 * 12 * max(level.quantum for level in cut.levels[:5])
    assert min(part.bound for part in parts) >= whole.bound - rounded


def test_no_branch_is_below_its_level():
    """Before the cells of the branches are rounded in their turn."""
    field = first_field(INSTANCE)
    with crew(1) as hands:
        root = Dual(Lattice.whole(field, 8), hands)
        root.ascend(5)
        whole = LevelRecord.of(root, field.energy().total)
        for part in branches(root, 4):
            assert part.bound() >= whole.bound - 1e-9
            part.ascend(5)
            assert part.bound() >= whole.bound - 1e-9


def test_a_certificate_that_is_cut_off_has_all_branches_of_a_level_or_none(cut, tmp_path):
    parts = len(cut.parents) - 1
    whole = write_certificate(cut, tmp_path / "whole.npz")
    for checked in range(1, parts + 2):
        asked = iter(range(checked * len(cut.field.alpha)))
        found = write_certificate(
            cut, tmp_path / "it.npz", stop=lambda asked=asked: next(asked, None) is None
        )
        kept = len(found.verdict.levels)
        assert kept == (1 if checked < 5 else checked)
        assert read_certificate(tmp_path / "it.npz").bound == found.bound <= whole.bound


def test_no_cut_lifts_the_least_bound_above_the_optimum():
    """Against optima over all jumps; each branch is cut again, and raised."""
    for seed in range(8):
        best = optimum(random_instance(seed, (2, 2), 4))
        with crew(1) as hands:
            root = Dual(Lattice.whole(best, 8), hands)
            root.ascend(3)
            bounds = []
            for part in branches(root, 4):
                part.ascend(3)
                for each in branches(part, 2) or [part]:
                    each.ascend(20)
                    bounds.append(each.bound())
        assert len(bounds) > 1
        assert min(bounds) <= best.energy().total + 1e-9, seed


def test_a_certificate_of_branches_proves_the_least_of_their_bounds(cut, tmp_path):
    path = tmp_path / "cut.npz"
    written = write_certificate(cut, path)
    assert cut.bound - 1e-4 <= written.bound <= cut.energy
    assert written.bound <= second_checker.check(second_checker.arrays_of(path)) <= cut.energy
    assert read_certificate(path).bound == written.bound
    chain = replace(cut, levels=cut.levels[:1], parents=(-1,))
    assert write_certificate(chain, path).bound < written.bound


def test_a_branch_left_out_or_of_another_level_is_refused(cut, tmp_path):
    path = tmp_path / "cut.npz"
    last = len(cut.levels) - 1
    wrong = [
        ([0, 1, 2, 3], [-1, 0, 0, 0]),
        ([0, 1], [-1, 0]),
        (range(last + 1), [-1, *range(last)]),
        (range(last + 1), [-1, 0, 0, 0, 0, *(1,) * (last - 4)]),
    ]
    for levels, parents in wrong:
        proof = replace(cut, levels=tuple(cut.levels[number] for number in levels), parents=tuple(parents))
        with pytest.raises(InputError, match="is not covered"):
            write_certificate(proof, path)
    for parents in ([-1, 0, 0, 0, 5], [0, 0, 0, 0, 0], [-1, 0, 0, 0, -1]):
        proof = replace(cut, levels=cut.levels[:5], parents=tuple(parents))
        with pytest.raises(InputError, match="parents"):
            write_certificate(proof, path)
    assert not path.exists()
