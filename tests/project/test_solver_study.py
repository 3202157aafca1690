"""The study of solvers: its statistics, and its reading of logs."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest


@pytest.fixture(scope="module")
def study(docs_module):
    """The modules of the study."""
    names = ("logs", "plan", "statistics")
    return SimpleNamespace(**{name: docs_module(f"studying.solvers.{name}") for name in names})


def row(study, seconds, status="optimal-global", objective=2.0, bound=2.0, limit=300.0, **more):
    values = {"cpu": seconds, "status": status, "objective": objective, "bound": bound, "limit": limit}
    return dict.fromkeys(study.plan.ASKED + study.plan.FOUND) | values | more


def test_means_and_intervals_are_those_calculated_by_hand(study):
    stopped = {"status": "limit-with-point", "bound": 1.0}
    rows = [row(study, 1.0), row(study, 7.0), row(study, 299.0, **stopped)]
    seconds = study.statistics.seconds(rows)
    assert seconds.tolist() == [1.0, 7.0, 300.0]
    mean = study.statistics.shifted_geometric_mean(seconds)
    assert mean == pytest.approx((2 * 8 * 301) ** (1 / 3) - 1)
    penalised = study.statistics.seconds(rows, study.statistics.PENALTY)
    assert study.statistics.mean(penalised) == pytest.approx((1 + 7 + 3000) / 3)
    # The mean of three draws of 0, 0, 3 is 0 with probability 8/27, 1 with 12/27, 2 with 6/27, 3 with 1/27.
    assert study.statistics.interval(np.array([0.0, 0.0, 3.0]), study.statistics.mean) == (0.0, 3.0)
    assert study.statistics.interval(np.full(5, 4.0), study.statistics.mean) == (4.0, 4.0)


def test_only_proven_and_unrefuted_answers_within_the_limit_are_solved(study):
    solved = study.statistics.is_solved
    assert solved(row(study, 300.0))
    assert solved(row(study, 5.0, "limit-with-point", bound=2.0 - 1e-6))
    assert not solved(row(study, 5.0, "limit-with-point", bound=2.0 - 1e-5))
    assert not solved(row(study, 5.0, "unknown"))
    assert not solved(row(study, 400.0))
    assert not solved(row(study, 5.0, objective=None))
    wrong = study.statistics.contradicted
    assert not wrong(row(study, 5.0), 2.0, 2.0)
    assert wrong(row(study, 5.0, objective=2.1), 2.0, 1.5)
    assert wrong(row(study, 5.0, objective=1.9, bound=1.0), 2.5, 2.0)
    assert wrong(row(study, 5.0, "limit-with-point", objective=3.0, bound=2.5), 2.0, 1.5)
    assert wrong(row(study, 5.0, "limit-with-point", objective=3.0, root_bound=2.5), 2.0, 1.5)


def test_the_integral_of_the_gap_is_that_of_its_steps(study):
    steps = [(2.0, 0.0, 4.0), (4.0, 2.0, 4.0), (8.0, 3.0, 4.0)]
    assert study.statistics.integral([*steps, (9.0, 4.0, 4.0)], 20.0, solved=True) == pytest.approx(
        2 * 1 + 2 * 1 + 4 * 0.5 + 1 * 0.25
    )
    assert study.statistics.integral(steps, 20.0, solved=False) == pytest.approx(2 + 2 + 2 + 12 * 0.25)
    assert study.statistics.gap(-1.0, 1.0) == study.statistics.gap(None, 1.0) == 1.0
    assert study.statistics.gap(0.0, 0.0) == 0.0


CBC = """\
Continuous objective value is 0 - 0.00 seconds
Cbc0012I Integer solution of 6.5 found by DiveCoefficient after 0 iterations and 0 nodes (0.01 seconds)
Cbc0013I At root node, 30 cuts changed objective from 0 to 1.25 in 99 passes
Cbc0010I After 0 nodes, 1 on tree, 6.5 best solution, best possible 1.25 (0.17 seconds)
"""
BONMIN = """\
NLP0014I             1         OPT 0.5        9 0.003807
Cbc0010I After 0 nodes, 1 on tree, 1e+50 best solution, best possible -1.7976931e+308 (0.12 seconds)
Cbc0004I Integer solution of 1.5 found after 658 iterations and 49 nodes (0.29 seconds)
Cbc0010I After 100 nodes, 18 on tree, 1.5 best solution, best possible 0.75 (0.53 seconds)
"""
HIGHS = """\
         0       0         0   0.00%   0               inf                  inf        0      0      0         0     0.0s
 L       0       0         0   0.00%   0.75            4.5                83.33%      862     90      0       519     0.1s
        89       0        44 100.00%   3.25            3.25                0.00%     1245     65    146     10701     0.4s
"""  # noqa: E501
SCIP = """\
 time | node  | left  |LP iter|LP it/n|mem/heur|mdpt |vars |cons |rows |cuts |sepa|confs|strbr|  dualbound   | primalbound  |  gap   | compl.
r 0.0s|     1 |     0 |   110 |     - |shifting|   0 |  92 | 129 | 129 |   0 |  0 |   0 |   0 | 0.750000e+00 | 4.500000e+00 |    Inf | unknown
d 0.5s|    11 |    10 |  1255 |  38.6 |shifting|  10 |  92 | 129 | 164 | 142 |  0 |   0 |  64 | 1.250000e+00 | 4.500000e+00 |  90.00%| unknown
"""  # noqa: E501


@pytest.mark.parametrize(
    "solver, log, root, steps",
    [
        ("cbc", CBC, 1.25, [(0.01, None, 6.5), (0.17, 1.25, 6.5)]),
        ("bonmin", BONMIN, None, [(0.12, None, None), (0.29, None, 1.5), (0.53, 0.75, 1.5)]),
        ("highs", HIGHS, 0.75, [(0.0, 0.0, None), (0.1, 0.75, 4.5), (0.4, 3.25, 3.25)]),
        ("scip", SCIP, 0.75, [(0.0, 0.75, 4.5), (0.5, 1.25, 4.5)]),
    ],
)
def test_logs_give_the_bound_at_the_root_and_all_steps(study, solver, log, root, steps):
    assert study.logs.root_bound(solver, log) == root
    assert list(study.logs.progress(solver, log)) == steps
