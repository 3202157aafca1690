"""Proofs round a given field, which need not be a good one: `prove` would search for a better one."""

from crossfield.models.processes.compilation import crew
from crossfield.models.proof.bound.dual import Dual
from crossfield.models.proof.bound.lattice import Lattice
from crossfield.models.proof.bound.pruning import finer_lattice
from crossfield.models.proof.checkers.check_certificate import has_forced_jump
from crossfield.models.proof.descent.descent import record_of
from crossfield.models.proof.descent.last_step import energy_terms, last_step_on
from crossfield.models.proof.descent.record import Chain, Proof


def prove_round(field, levels, steps=8):
    """A proof in the 2-norm on so many levels round a field, the first with `steps` in pi/2."""
    energy = field.energy().total
    with crew(1) as hands:
        dual = Dual(Lattice.whole(field, steps), hands)
        chain = Chain(arrays=dual.lattice.centre_arrays())
        while True:
            dual.ascend(8)
            chain.add(*record_of(dual, energy))
            left = dual.remaining_cells(chain.levels[-1].bound, energy)
            if len(chain.levels) == levels or left.is_empty:
                break
            dual.move(finer_lattice(left))
    terms = energy_terms(field.instance, 2)
    step = last_step_on(left, terms, field)
    forced = int(has_forced_jump(terms, step.p, step.boxes).sum())
    return proof_of(field, energy, chain, forced)


def proof_of(field, energy, chain, forced=0):
    """The proof of a chain in the 2-norm, which is not checked."""
    bound = max(level.bound for level in chain.levels)
    return Proof(
        field=field, energy=energy, bound=bound, forced=forced, levels=tuple(chain.levels), seconds=0.0,
        ended="gap", arrays=chain.arrays,
    )  # fmt: skip
