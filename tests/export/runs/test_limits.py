"""Every method ends at its time limit, by a clock of the test, and returns a valid field."""

import json

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.formats.registry import write
from crossfield.export.runs.methods import METHODS, Request
from crossfield.export.runs.proven import certify
from crossfield.export.solving.local import SolveFiles, Solvers
from crossfield.models.errors import SolverError
from crossfield.models.processes.deadline import Deadline
from crossfield.models.processes.limits import Limits
from crossfield.models.proof.certificate import write_certificate
from crossfield.models.search.greedy import greedy_field
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
    request = Request(cf.sample("mouse", 12), tmp_path, Limits(seconds, threads=1), clock=clock)
    *_, candidate = METHODS[method].find(request)
    assert clock.now <= 1 + seconds + LATE[method]
    assert np.isfinite(candidate.field.energy().total)
    assert (candidate.field.alpha >= request.instance.alpha_lower - 1e-12).all()
    assert (candidate.field.alpha <= request.instance.alpha_upper + 1e-12).all()
    assert (np.abs(candidate.field.beta) <= np.pi / 4 + 1e-12).all()


def test_two_stages_without_time_return_the_start(tmp_path):
    start = greedy_field(cf.sample("mouse", 12))
    request = Request(start.instance, tmp_path, Limits(1e-3), start=start, clock=Ticking())
    (only,) = METHODS["two-stage"].find(request)
    assert only.field.energy(1).total == pytest.approx(start.energy(1).total, rel=1e-9)


def test_a_solver_process_is_told_seconds_and_no_time_of_this_clock(tmp_path):
    """The deadline is far away, although its clock began long after that of other processes."""
    field = greedy_field(cf.sample("mouse", 6))
    problem = cf.formulate(field.instance, "qp-fixed", p=field.p)
    held = write(problem, tmp_path / "model.nl", start=field).problem
    files, deadline = (
        SolveFiles.for_model(tmp_path / "model.nl", "ipopt"),
        Deadline.after(600.0, lambda: -1e9),
    )
    with Solvers() as solvers:
        solvers.solve_file(held, "ipopt", files, Limits(600.0), deadline, start=field)
    first = files.log.read_text().splitlines()[0]
    assert 500 < float(first.rpartition("at most ")[2].removesuffix(" s")) <= 600


UNPROVEN = "nothing was proven, and there is no certificate: the time limit ended before a bound was proven"


@pytest.fixture
def passed():
    """A deadline in the past."""
    return Deadline(0.0, lambda: 1.0)


def test_a_proof_without_time_has_no_bound_and_no_certificate(passed, tmp_path):
    proof = cf.prove(cf.sample("mouse", 24), limits=cf.Limits().until(passed))
    assert (proof.bound, proof.status, proof.levels, proof.ended) == (0.0, "gap", (), "time")
    path = tmp_path / "certificate.npz"
    with pytest.raises(SolverError, match="nothing was proven"):
        write_certificate(proof, path)
    with pytest.raises(SolverError, match=UNPROVEN):
        certify(proof, path)
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
