"""Proofs whose passes are slow and whose next level of lattices would be too large."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.proof.descent import descent


@pytest.mark.slow
def test_where_no_finer_level_fits_a_smaller_one_raises_the_bound(monkeypatch, tmp_path):
    """The bound rises once more on the labels that are left, and the certificate has one more level."""
    instance = cf.sample("ring", 12)
    monkeypatch.setattr(descent, "MOST_LABELS", 30_000)
    proof = cf.prove(instance, jobs=1)
    assert proof.ended == "labels"
    assert [round(np.pi / 2 / level.h) for level in proof.levels] == [16, 32, 32]
    before, last = proof.levels[-2:]
    assert last.size < before.size
    assert last.bound > before.bound
    # The checker has the best shares of later pixels, so it may prove more than the rounded ones.
    assert last.bound * (1 - 1e-5) <= proof.bound <= proof.energy
    assert cf.write_certificate(proof, tmp_path / "it.npz").bound == proof.bound
