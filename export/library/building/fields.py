"""Fields and certificates of an instance, by the work that its sketch asks for: greedy, search or proof.

The work is limited in rounds, nodes and labels, never in time, so every build finds the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import Final

import numpy as np

from ....models.field.field import NORMS, CrossField, Norm
from ....models.formulations.problem import Problem, formulate
from ....models.instance.instance import Instance
from ....models.proof.certificate import write_certificate
from ....models.search.greedy import greedy_field
from ....models.search.reproducible_angles import reproducible_field
from ....models.search.search import search
from ....models.storage import temporary_folder
from ..ledger.known_points import InstancePoints
from ..ledger.points import (
    METHOD,
    CheckedCertificate,
    KnownField,
    certificate_file,
    clipped_field,
    finder,
)
from ..plan.recipe import InstanceRecipe

_ROUNDS: Final = 8
_NODES: Final = {"tiny": 1000, "small": 20}  # of the branch and bound in the 1-norm, by rung
_LP_UP_TO: Final = 1000  # pixels up to which the angles are fitted in the 1-norm
_MOST_WORK: Final = 20_000_000  # labels, counted at each rounding, after which a proof ends: some minutes
_MOST_BYTES: Final = 2_000_000  # of a certificate that leaves a gap; those of optima are kept

InstanceFields = tuple[KnownField, list[KnownField], list[CheckedCertificate]]
"""The baseline, fields of low energy, and certificates."""


def search_fields(
    instance: Instance, recipe: InstanceRecipe, sent: Sequence[CheckedCertificate]
) -> InstanceFields:
    """Find the fields that the sketch of a recipe asks for. sent: certificates that replace proofs."""
    effort = recipe.sketch.points
    baseline = KnownField(reproducible_field(greedy_field(instance)), *finder("greedy"))
    if effort == "greedy":
        return baseline, [baseline], []
    if effort == "proven":
        low, proven = _prove_norms(baseline, recipe, sent)
        return baseline, [baseline, *low], proven
    low_2norm = search(instance, rounds=_ROUNDS, jobs=1).field
    searched = KnownField(reproducible_field(low_2norm), *finder("search"))
    low, proven = _prove_norms(searched, recipe, sent)
    if instance.orthogonal:
        return baseline, [searched, *low], proven
    fitted = improve_in_1norm(searched.field, recipe.rung)
    staged = [KnownField(reproducible_field(known.field), *finder("two stages")) for known in fitted]
    return baseline, [searched, *low, *fitted, *staged], proven


def given_fields(points: InstancePoints, instance: Instance, recipe: InstanceRecipe) -> InstanceFields:
    """Return the given points, without any search; a certificate is checked."""
    low = [points.field(f"least_{norm}") for norm in NORMS]
    return points.field("baseline"), low, points.certificates(instance, recipe.prove)


def _prove_norms(
    start: KnownField, recipe: InstanceRecipe, sent: Sequence[CheckedCertificate]
) -> tuple[list[KnownField], list[CheckedCertificate]]:
    """Prove the optima in the norms of the recipe that no submitted certificate is in."""
    norms = [norm for norm in recipe.prove if norm not in {certificate.norm for certificate in sent}]
    proofs = [_prove(start.field, certificate_file(recipe.name, norm), norm) for norm in norms]
    certificates = [certificate for _, certificate in proofs if certificate is not None]
    return [known for known, _ in proofs], certificates


def improve_in_1norm(start: CrossField, rung: str) -> list[KnownField]:
    """Find fields of lower 1-norm energy by HiGHS: best angles for the jumps, and on low rungs a search."""
    if start.instance.domain.size > _LP_UP_TO:
        return []
    problem = formulate(start.instance, "milp-mccormick")  # whose objective is the 1-norm energy
    fitted = _solve_by_highs(problem.with_integers_fixed(start))
    fields = [fitted]
    if rung in _NODES:
        fields.append(_solve_by_highs(problem, mip_max_nodes=_NODES[rung], start=fitted or start))
    return [KnownField(field, "HiGHS", version("highspy")) for field in fields if field is not None]


def _solve_by_highs(problem: Problem, start: CrossField | None = None, **options: int) -> CrossField | None:
    """The field that HiGHS finds under options, or None."""
    import highspy

    from ...programs.highs import set_options

    highs = problem.to_highs()
    set_options(highs, threads=1, parallel="off", mip_rel_gap=1e-6, mip_abs_gap=1e-9, **options)
    if start is not None:
        first = highspy.HighsSolution()
        first.col_value = problem.point(start).tolist()
        highs.setSolution(first)
    highs.run()
    if highs.getInfo().primal_solution_status != highspy.SolutionStatus.kSolutionStatusFeasible:
        return None
    return clipped_field(problem, np.array(highs.getSolution().col_value))


def _prove(start: CrossField, file: str, norm: Norm = 2) -> tuple[KnownField, CheckedCertificate | None]:
    """Prove the optimum in a norm from a field; return the best field and the certificate.

    file: name in a library. The certificate is None if it is large and leaves a gap.
    """
    from ....models.proof.prove import prove  # loads compiled functions

    proof = prove(start.instance, norm=norm, start=start, work=_MOST_WORK, jobs=1)
    field = reproducible_field(proof.field) if norm == 2 else proof.field
    if not field.instance.orthogonal:  # their levels are pruned for the energy of the field
        proof = replace(proof, field=field, energy=field.energy(norm).total)
    with temporary_folder() as folder:
        path = folder / "a.certificate.npz"
        claim = write_certificate(proof, path)
        data = path.read_bytes()
    known = KnownField(field, *finder(METHOD))
    if claim.status != "optimal" and len(data) > _MOST_BYTES:
        return known, None
    return known, CheckedCertificate.of(claim, file, data)
