"""Costs of strokes on a lattice: the prover and the checker have the same."""

import crossfield as cf
import numpy as np
from crossfield.models.field.field import CrossField
from crossfield.models.processes.compilation import crew
from crossfield.models.proof.bound.dual import Dual
from crossfield.models.proof.bound.lattice import Lattice
from crossfield.models.proof.checkers import check_certificate
from crossfield.models.proof.descent.descent import record_of
from crossfield.models.proof.descent.record import Chain
from proofs_round_fields import proof_of


def test_a_centre_whose_other_line_carries_the_stroke_has_a_certificate(tmp_path):
    """The prover pruned more than the checker there, and its certificate was refused."""
    instance = cf.random_instance(978, size=5, stroke_weight=5 / 24, skew_weight=1e-6 * (5 / 24) ** 2)
    proof = cf.prove(instance, jobs=1)
    assert cf.write_certificate(proof, tmp_path / "it.npz").status == "optimal"


def test_every_label_costs_what_the_checker_computes():
    """At centres in any direction, beyond the windows of the strokes too."""
    instance, rng = cf.random_instance(3, size=4, share=1.0), np.random.default_rng(3)
    lines = rng.uniform(0, np.pi, (2, instance.grid.size))
    field = CrossField.from_lines(instance, *lines)
    with crew(1) as hands:
        level, energy = Lattice.whole(field, 16), field.energy().total
        chain = Chain(arrays=level.centre_arrays())
        chain.add(*record_of(Dual(level, hands), energy))
    arrays = proof_of(field, energy, chain).certificate()
    terms, _ = check_certificate.terms_of(arrays)
    same = check_certificate.level_of(arrays, 0, terms)
    mine = np.split(level.unary_costs(), level.start[1:-1])
    for i, cost in enumerate(mine):
        checked, _ = check_certificate.pixel_costs(same, terms, i)
        assert np.allclose(cost, checked.ravel(), rtol=0, atol=1e-12)
