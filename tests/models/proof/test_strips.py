"""A proof in strips: the same numbers for any strips, and proofs on the workers of a cluster."""

from itertools import pairwise

import crossfield as cf
import numpy as np
import pytest
from clusters import cluster
from crossfield.models.processes.compiled import crew
from crossfield.models.proof.dual import Dual, Here
from crossfield.models.proof.lattice import Lattice
from crossfield.models.proof.pruning import finer
from crossfield.models.proof.strip import Strip, part_of
from crossfield.models.proof.workers import strips
from crossfield.models.search.starts import first_field


def divided(count, hands):
    """A function that divides a lattice into strips in this process."""
    return lambda lattice: [
        Here(Strip(part_of(lattice, own), hands)) for own in strips(lattice.instance.grid, count)
    ]


def numbers_of(dual, energy):
    """All numbers of a level that follow from the shares, as bytes, and the cells that are left."""
    bound = dual.ascend(4)
    crosses = [each.tobytes() for forwards in (True, False) for each in dual.decoded(forwards=forwards)]
    quanta = dual.quantise(1e-3)
    arrays = [each.tobytes() for part in dual.arrays(quanta) for each in part.values()]
    left = dual.remaining_cells(dual.bound(), energy)
    return (bound, dual.bound(), quanta, crosses, arrays, left.cells.tobytes()), left


@pytest.mark.parametrize("name, norm", [("mouse", 2), ("ring", 2), ("saddle", "mixed")])
def test_any_strips_give_the_same_numbers(name, norm):
    instance = cf.sample(name, 12)
    field = first_field(instance)
    energy = field.energy(norm).total
    with crew(2) as hands:
        found = []
        for count in (1, 2, 3, 12):
            lattice = (
                Lattice.whole(field, 4)
                if norm == 2
                else Lattice.common(field, norm, np.zeros(len(instance.theta)), 4)
            )
            dual = Dual(lattice, hands, divided(count, hands))
            assert len(dual.places) >= min(count, 4)
            first, left = numbers_of(dual, energy)
            dual.move(finer(left))
            second, _ = numbers_of(dual, energy)
            found.append((first, second))
    assert all(each == found[0] for each in found)


def test_strips_are_whole_rows_and_about_equal():
    grid = cf.sample("mouse", 24).grid
    for count in (1, 2, 3, 7):
        found = strips(grid, count)
        assert [found[0].start, found[-1].stop] == [0, grid.size]
        assert all(one.stop == other.start for one, other in pairwise(found))
        cuts = [each.start for each in found[1:]]
        assert all(grid.rows[cut] > grid.rows[cut - 1] for cut in cuts)
        assert len(found) == count
        sizes = [each.stop - each.start for each in found]
        assert max(sizes) - min(sizes) <= 2 * grid.width
    assert len(strips(grid, 1000)) == len(np.unique(grid.rows))


def test_clusters_are_on_quads_inside_strips():
    instance = cf.sample("mouse", 10)
    field = first_field(instance)
    grid = instance.grid
    with crew(1) as hands:
        dual = Dual(Lattice.whole(field, 16), hands, divided(2, hands))
        dual.ascend(9)
        dual.add_clusters(8, field)
        numbers = [place.strip.state.clusters.quads for place in dual.places]
        assert np.array_equal(np.concatenate(numbers), dual.quads)
        assert len(dual.quads) == 8
        for place, quads in zip(dual.places, numbers, strict=True):
            pixels = np.array([grid.first[quads], grid.second[quads]])
            assert (place.pixels.start <= pixels).all()
            assert (pixels < place.pixels.stop).all()
        dual.ascend(20)
        assert dual.bound() <= cf.prove(instance, jobs=1).energy


@pytest.mark.needs("distributed")
def test_workers_prove_the_same_with_the_same_certificate(tmp_path):
    bottle, ring = cf.sample("bottle", 16), cf.sample("ring", 12)
    with cluster(tmp_path) as (address, _):
        found = cf.prove(bottle, jobs=1, scheduler=address)
        vortices = cf.prove(ring, jobs=1, scheduler=address)
    cf.write_certificate(found, tmp_path / "there.npz")
    cf.write_certificate(cf.prove(bottle, jobs=1), tmp_path / "here.npz")
    assert (tmp_path / "there.npz").read_bytes() == (tmp_path / "here.npz").read_bytes()
    assert any(len(level.tables["quads"]) for level in vortices.levels)
    assert cf.write_certificate(vortices, tmp_path / "ring.npz").status == "optimal"


@pytest.mark.needs("distributed")
def test_a_lost_worker_ends_a_proof_with_what_is_proven(tmp_path):
    levels = []
    with cluster(tmp_path) as (address, (first, _)):

        def shown(line):
            levels.append(line.startswith("energy"))
            if sum(levels) == 6:  # during passes: a worker that is lost during a search is replaced in time
                first.kill()

        found = cf.prove(cf.sample("mouse", 20), jobs=1, scheduler=address, progress=shown)
    assert found.ended == "workers"
    assert 0 < found.bound < found.energy
    assert cf.write_certificate(found, tmp_path / "it.npz").status == "gap"


@pytest.mark.needs("distributed")
def test_an_address_without_a_scheduler_or_workers_is_refused(tmp_path):
    with pytest.raises(cf.InputError, match="no scheduler answers at nonsense"):
        cf.prove(cf.sample("mouse", 5), scheduler="nonsense")
    with cluster(tmp_path, workers=0) as (address, _), pytest.raises(cf.InputError, match="has no worker"):
        cf.prove(cf.sample("mouse", 5), scheduler=address)
