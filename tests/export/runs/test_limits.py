"""Every method ends at its time limit, by a clock of the test, and returns a valid field."""

import json

import crossfield as cf
import numpy as np
import pytest
from command_line import invoke
from crossfield.export.runs.methods import METHODS, Request
from crossfield.models.processes.deadline import Deadline
from folders import contents


class Ticking:
    """A clock that advances by one second whenever it is read."""

    def __init__(self, start=0.0):
        self.now = start

    def __call__(self):
        self.now += 1.0
        return self.now


LATE = {"greedy": 8, "power": 4, "polyvector": 4, "bend": 4, "search": 40, "prove": 40}
"""Most readings of the clock after the limit; a two-stage solve ends in the processes of its solvers."""


@pytest.mark.parametrize("method", LATE)
@pytest.mark.parametrize("seconds", [0.5, 6.0, 20.0])
def test_a_method_ends_at_its_limit_with_a_valid_field(method, seconds, tmp_path):
    clock = Ticking()
    request = Request(cf.sample("mouse", 12), tmp_path, cf.Limits(seconds, threads=1), clock=clock)
    *_, candidate = METHODS[method].find(request)
    assert clock.now <= 1 + seconds + LATE[method]
    assert np.isfinite(candidate.field.energy().total)
    assert (candidate.field.alpha >= request.instance.alpha_lower - 1e-12).all()
    assert (candidate.field.alpha <= request.instance.alpha_upper + 1e-12).all()
    assert (np.abs(candidate.field.beta) <= np.pi / 4 + 1e-12).all()


def test_a_solver_states_whether_it_returned_its_start_and_the_gap_of_another_point():
    problem = cf.formulate(cf.sample("skew", 4), "milp-mccormick")
    start = cf.power_field(problem.instance).with_best_jumps()
    given_back = cf.solve(problem, limits=cf.Limits(1e-6), start=start)
    assert (given_back.start_returned, given_back.gap) == (True, None)
    solved = cf.solve(problem, limits=cf.Limits(60, threads=1), start=start)
    assert (str(solved.status), solved.start_returned) == ("optimal-global", False)
    assert solved.gap == pytest.approx((solved.objective - solved.bound) / solved.objective)
    assert solved.gap < 1e-3


UNPROVEN = "nothing was proven, and there is no certificate: it ended (time) before a bound was proven"


def test_a_proof_without_time_has_no_bound_and_no_certificate(tmp_path):
    proof = cf.prove(cf.sample("mouse", 24), limits=cf.Limits().until(Deadline(0.0, lambda: 1.0)))
    assert (proof.bound, proof.status, proof.levels, proof.ended) == (0.0, "gap", (), "time")
    with pytest.raises(cf.SolverError, match="nothing was proven"):
        cf.write_certificate(proof, tmp_path / "certificate.npz")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("norm", ["1", "2"])
def test_the_command_prove_reports_that_nothing_was_proven(norm, tmp_path, capsys):
    command = ["prove", "mouse", "--size", "24", "--norm", norm, "--time-limit", "0.1", "--json"]
    assert invoke([*command, "-o", str(tmp_path)]) == 1
    output = capsys.readouterr()
    assert UNPROVEN in output.err
    assert UNPROVEN in json.loads(output.out)["reason"]
    document = json.loads(output.out)
    assert document == json.loads((tmp_path / "mouse.proof.json").read_text())
    assert (document["status"], document["bound"], document["levels"]) == ("unproven", 0.0, [])
    assert contents(tmp_path).keys() == {"mouse.proof.field.npz", "mouse.proof.json"}
    if norm == "1":
        return
    field = cf.read_field(tmp_path / "mouse.proof.field.npz")
    better = cf.search(field.instance, start=field, rounds=0, jobs=1).field
    cf.write_field(better, tmp_path / "mouse.proof.field.npz")
    before = contents(tmp_path)
    assert invoke([*command, "-o", str(tmp_path)]) == 1
    assert contents(tmp_path) == before  # a report stays with the better field
