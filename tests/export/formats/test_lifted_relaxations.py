"""Without integrality a lifted product is a relaxation, as files, manifests, tables and `verify` state."""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.solving.local import choose_solver
from crossfield.export.verify.checks import Verdict
from crossfield.export.verify.verify import judge_solves, verify
from instance_kinds import grid

RELAXED = {"relax": True}


@pytest.fixture(scope="module")
def two():
    """Two pixels whose strokes pull p1 between 0 and 1, where the hull of the product is larger than it."""
    return grid("//", [0.5, 2.2], stroke_coefficient=1.0, skew_coefficient=1.0, gauge="box")


@pytest.mark.parametrize("name", ["minlp-quartic", "minlp-cubic"])
def test_a_lifted_relaxation_is_called_one_and_whole_jumps_exact(name, two, tmp_path):
    for relax, right, wrong in ((True, "a relaxation", "exact"), (None, "exact", "a relaxation")):
        problem = cf.formulate(two, name, relax=relax)
        for suffix in ("nl", "lp", "mps", "qplib"):
            path = tmp_path / f"{relax}.{suffix}"
            lifted = cf.write(problem, path).lifted
            if suffix == "nl":
                assert lifted == ""
                continue
            head = "\n".join(path.read_text().splitlines()[:6])
            assert right in lifted
            assert right in head
            assert wrong not in lifted + head
            assert (f"continuous relaxation of {name}" in head) == bool(relax)


def test_no_other_relaxation_is_called_the_same_problem(two, tmp_path):
    """cos(pi p) between whole p is another function than (1 - 2 p1)."""
    formats = ["nl", "lp", "mps", "qplib"]
    (manifest,) = cf.write_all(two, tmp_path, formulations=["minlp-parity"], formats=formats, options=RELAXED)
    reasons = manifest.document["refused"]
    assert sorted(reasons) == ["lp", "mps", "qplib"]
    assert not any("same problem" in reason for reason in reasons.values())


def test_the_hull_is_larger_and_a_solver_is_chosen_that_reads_the_products(two):
    """The lifted point, p1 = 1/2 and z off p1 beta_i, is feasible and lower than any of the products.

    HiGHS solves the weaker problem of the .mps on request only, and the facts state it.
    """
    problem = cf.formulate(two, "minlp-quartic", relax=True)
    assert choose_solver(problem).formats[0] == "nl"
    lifted = cf.solve(problem, "highs")
    assert "a relaxation" in lifted.problem.formulation.lifted
    assert lifted.violation.worst < 1e-6
    assert lifted.objective == pytest.approx(0.198, abs=1e-3)
    z, p1, beta = (lifted.point[lifted.problem.blocks[name].slice] for name in ("z", "p1", "beta"))
    assert abs(z - p1 * beta[:1]).max() > 0.01
    best = min(cf.solve(problem, "ipopt", start=start).objective for start in starts(two))
    assert best == pytest.approx(0.247, abs=1e-3)


def starts(instance):
    """Fields at every jump that the pair may have."""
    middle = (instance.alpha_lower + instance.alpha_upper) / 2
    for p in range(int(instance.p_min[0]), int(instance.p_max[0]) + 1):
        yield cf.CrossField(instance, middle, np.zeros(2), [p])


@pytest.mark.slow
@pytest.mark.needs("scip")
def test_verify_compares_optima_across_formats(two, tmp_path):
    """SCIP finds 0.247 on the .nl, HiGHS proves 0.198 on the .mps: a relaxation, not another optimum."""
    options = {"formulations": ["minlp-quartic"], "formats": ["nl", "mps"], "options": RELAXED}
    cf.write_all(two, tmp_path, **options)
    verification = verify(tmp_path, seconds=4.0, programs=["scip", "highs"])
    assert verification.failed_checks == []
    solves = {f.file.rpartition(".")[2]: f for f in verification.checks if f.step == "solve" and f.objective}
    weak, whole = solves["mps"], solves["nl"]
    assert weak.relaxes == whole.group != weak.group
    assert weak.objective < whole.objective - 0.04
    assert weak.reason.startswith("a relaxation")
    called_exact = [replace(weak, group=whole.group, relaxes=""), replace(whole, proven=True)]
    assert Verdict.DIFFERS in {check.verdict for check in judge_solves(called_exact)}
    too_high = [replace(weak, objective=0.3, bound=None), whole]
    assert [check.verdict for check in judge_solves(too_high)] == [Verdict.DIFFERS, whole.verdict]
