"""Proofs round a given field, which need not be a good one: `prove` would search for a better one."""

from crossfield.models.processes.compilation import crew
from crossfield.models.proof.bound.dual import Dual
from crossfield.models.proof.bound.lattice import Lattice
from crossfield.models.proof.bound.pruning import finer_lattice
from crossfield.models.proof.checkers.check_certificate import has_forced_jump
from crossfield.models.proof.descent.last_step import energy_terms, last_step_on
from crossfield.models.proof.descent.record import LevelRecord, Proof


def prove_round(field, levels, steps=8):
    """A proof in the 2-norm on so many levels round a field, the first with `steps` in pi/2."""
    energy, records = field.energy().total, []
    with crew(1) as hands:
        dual = Dual(Lattice.whole(field, steps), hands)
        while True:
            dual.ascend(8)
            records.append(LevelRecord.of_dual(dual, energy))
            left = dual.remaining_cells(records[-1].bound, energy)
            if len(records) == levels or left.is_empty:
                break
            dual.move(finer_lattice(left))
    terms = energy_terms(field.instance, 2)
    step, bound = last_step_on(left, terms, field), max(record.bound for record in records)
    forced = int(has_forced_jump(terms, step.p, step.boxes).sum())
    return Proof(field, energy, bound, forced, tuple(records), 0.0, "gap")
