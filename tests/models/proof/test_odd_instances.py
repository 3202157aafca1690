"""Tiny odd instances through prove, write, check and read: masks in parts, parts without strokes, one pixel,
extreme weights, every norm and gauge.

The optimum of the smallest is found without the prover: by trying every jump, or with HiGHS.
"""

import crossfield as cf
import pytest
from crossfield.models.proof.checkers import check_certificate
from exhaustive import least_absolute, least_squares
from odd_instances import NORMS, odd_instance

pytestmark = pytest.mark.numeric

WORK = 30_000  # labels after which a proof ends with a gap
LARGER = 41  # one whose proof ends with a gap
RESTARTED = 99  # one whose proof ends in the first level round a better field, after levels round another one
MOST_PAIRS = 4  # of an instance whose jumps are all tried


def optimum(instance, norm):
    """The least energy of all fields in the gauge `strokes`, without code of the prover; None if unknown."""
    instance = instance.with_gauge("strokes")
    if len(instance.grid.first) > MOST_PAIRS or norm == "mixed":
        return None
    return least_squares(instance) if norm == 2 else least_absolute(instance)


def assert_round_trip(seed, folder):
    instance, norm = odd_instance(seed), NORMS[seed % len(NORMS)]
    proof = cf.prove(instance, norm=norm, jobs=1, work=WORK)
    path = folder / f"{seed}.npz"
    written = cf.write_certificate(proof, path)
    claim = check_certificate.check_arrays(check_certificate.read_arrays(str(path)))
    read = cf.read_certificate(path, on=instance.with_gauge("strokes"))
    claims = [(record.status, record.bound, record.gap, record.forced) for record in (proof, written, read)]
    assert claims[0] == claims[1] == claims[2]
    assert claim.status == proof.status
    assert proof.bound <= claim.bound
    assert (proof.gap == 0) == (proof.status == "optimal") == (proof.ended == "optimal")
    energy = read.field.energy(norm).total
    assert energy == proof.energy
    assert read.energy == pytest.approx(energy, rel=1e-12, abs=1e-12)
    least = optimum(instance, norm)
    if least is not None:
        assert proof.bound <= least + 1e-9 * max(1.0, least)
        if proof.status == "optimal":
            assert proof.energy <= least + 1e-8 * max(1.0, least)
    return proof


def test_few_odd_instances_are_proven_written_checked_and_read(tmp_path):
    few = [seed for seed in range(100) if odd_instance(seed).grid.size <= MOST_PAIRS][:24]
    proofs = [assert_round_trip(seed, tmp_path) for seed in (*few, LARGER, RESTARTED)]
    assert {proof.norm for proof in proofs} == set(NORMS)
    assert {proof.status for proof in proofs} == {"optimal", "gap"}


@pytest.mark.slow
@pytest.mark.parametrize("block", range(6))
def test_odd_instances_are_proven_written_checked_and_read(block, tmp_path):
    for seed in range(20 * block, 20 * block + 20):
        assert_round_trip(seed, tmp_path)
