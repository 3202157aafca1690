"""Without integrality a lifted product is a relaxation, as files, manifests, tables and `verify` state."""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.bundle.problem_files import write_all
from crossfield.export.formats.registry import FORMATS, problem_in_format
from crossfield.export.solving.local import choose_solver
from crossfield.export.verify.checks import Verdict
from crossfield.export.verify.verify import judge_solves, verify

LIFTED = ("minlp-quartic", "minlp-cubic")


@pytest.fixture(scope="module")
def two():
    """Two pixels whose strokes pull p1 between 0 and 1, where the hull of the product is larger than it."""
    mask, pixels = np.ones((1, 2), dtype=bool), [[0, 0], [0, 1]]
    return cf.Instance.on_pixels(
        "two", mask, pixels, [0.5, 2.2], [1.0, 1.0], skew_coefficient=1.0, gauge="box"
    )


@pytest.fixture(scope="module")
def written(two, tmp_path_factory):
    folder = tmp_path_factory.mktemp("relaxed")
    manifests = write_all(
        two,
        folder,
        formulations=[*LIFTED, "minlp-parity"],
        formats=["nl", "lp", "mps", "qplib"],
        options={"relax": True},
    )
    return {manifest.formulation: manifest for manifest in manifests}


@pytest.mark.parametrize("name", LIFTED)
def test_a_lifted_relaxation_is_called_one(name, written):
    manifest = written[name]
    for file in manifest.document["files"]:
        if file["format"] == "nl":
            assert file["lifted"] == ""
            continue
        assert "a relaxation" in file["lifted"]
        assert "exact" not in file["lifted"]
        head = (manifest.folder / file["name"]).read_text().splitlines()[:6]
        assert any("a relaxation" in line for line in head)
        assert not any("exact" in line for line in head)
        assert any(f"continuous relaxation of {name}" in line for line in head)


def test_no_other_relaxation_is_called_the_same_problem(written):
    """cos(pi p) between whole p is another function than (1 - 2 p1)."""
    reasons = written["minlp-parity"].document["refused"]
    assert sorted(reasons) == ["lp", "mps", "qplib"]
    for reason in reasons.values():
        assert "same problem" not in reason
        assert "choose nl or gms" in reason


def test_the_hull_is_larger(two):
    """The lifted point, p1 = 1/2 and z off p1 beta_i, is feasible and lower than any of the products."""
    problem = cf.formulate(two, "minlp-quartic", relax=True)
    lifted = cf.solve(problem, "highs")
    assert lifted.violation.worst < 1e-6
    assert lifted.objective == pytest.approx(0.198, abs=1e-3)
    z, p1, beta = (lifted.point[lifted.problem.blocks[name].slice] for name in ("z", "p1", "beta"))
    assert abs(z - p1 * beta[:1]).max() > 0.01
    best = min(cf.solve(problem, "ipopt", start=start).objective for start in starts(two))
    assert best == pytest.approx(0.247, abs=1e-3)


def starts(instance):
    """Fields at every jump that the pair may have."""
    p_min, p_max = int(instance.p_min[0]), int(instance.p_max[0])
    for p in range(p_min, p_max + 1):
        yield cf.CrossField(instance, (instance.alpha_lower + instance.alpha_upper) / 2, np.zeros(2), [p])


def test_a_solver_is_chosen_that_reads_the_products(two):
    """HiGHS would solve the weaker problem of the .mps; it does so on request, and the facts state it."""
    problem = cf.formulate(two, "minlp-quartic", relax=True)
    assert choose_solver(problem).formats[0] == "nl"
    assert "a relaxation" in cf.solve(problem, "highs").problem.formulation.lifted
    assert (
        problem_in_format(cf.formulate(two, "minlp-quartic"), FORMATS["mps"]).formulation.is_weakened is False
    )


@pytest.mark.slow
@pytest.mark.needs("scip")
def test_verify_compares_optima_across_formats(written, two, tmp_path):
    """SCIP finds 0.247 on the .nl, HiGHS proves 0.198 on the .mps: a relaxation, not another optimum."""
    write_all(two, tmp_path, formulations=["minlp-quartic"], formats=["nl", "mps"], options={"relax": True})
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
