"""Logs of solvers: content, trust in rounded bounds, and files that are not logs."""

import math
from contextlib import suppress

import places
import pytest
from crossfield.export.solutions.logs.registry import LOG_READERS, parse_log, read_log
from crossfield.export.solutions.logs.run_log import MOST_STEPS, Step, at_least, thinned
from crossfield.models.errors import CrossfieldError, SolutionError

LOGS = places.DATA / "logs"
OPTIMUM = 0.26710785
"""Optimum of the problem of five of the logs, as found by Gurobi, HiGHS and SCIP."""

KNOWN = {
    "highs": ("highs", "1.15.1", "optimal", 0.267104325999, 0.267107849905, 6.06, 1, None, 280, 421),
    "highs_without_banner": ("highs", None, "optimal", 6.63162859167, 6.63170540734, 3.86, 2, None, 149, 217),
    "gurobi": ("gurobi", "13.0.3", "optimal", 0.2671078499054, 0.2671078499054, 0.82, 2, 8.0, 280, 421),
    "scip": ("scip", None, "optimal", 0.267107849905365, 0.267107849905365, 6.45, None, None, 280, 421),
    "xpress": ("xpress", "9.9.1", "optimal", 0.2671176690572225, 0.2671176690572219, 2.1, 1, 8.0, 280, 421),
    "cplex_gams": ("cplex", "22.2.0.0", "optimal", 0.2671075, 0.267108, 0.32, 1, 8.0, None, None),
    "cplex_python": ("cplex", "22.2.0.0", None, 0.03785, None, 5.88, 1, 8.0, None, None),
    "baron_gams": ("baron", "26.5.27", "limit", -18.5273977027651, 2.03053261316199e-7, 8.45) + (None,) * 4,
    "baron_preprocessed": ("baron", "26.5.27", "optimal", 2.030525e-7, None, 0.02) + (None,) * 4,
}
FACTS = ["solver", "version", "ended", "bound", "objective", "seconds", "threads", "limit", "columns", "rows"]


def test_every_log_is_read_as_its_solver_wrote_it():
    assert {path.stem for path in LOGS.glob("*.log")} == set(KNOWN)
    for name, expected in KNOWN.items():
        found = read_log(LOGS / f"{name}.log")
        assert tuple(getattr(found, fact) for fact in FACTS) == expected, name
    assert {each.title for each in LOG_READERS} == {"HiGHS", "Gurobi", "SCIP", "Xpress", "CPLEX", "BARON"}


def test_traces_go_on_in_time_and_stay_below_the_bound_at_the_end():
    for name, (*_, bound, _, seconds, _, _, _, _) in KNOWN.items():
        trace = read_log(LOGS / f"{name}.log").trace
        assert 1 <= len(trace) <= MOST_STEPS
        times = [step.seconds for step in trace]
        assert times == sorted(set(times))
        assert times[-1] <= seconds
        assert all(step.bound is None or step.bound <= bound for step in trace)


def test_a_bound_that_a_log_rounds_is_the_least_one_that_is_shown_so():
    assert at_least("0.0379") == 0.03785
    assert at_least("-1762.1424") == -1762.14245
    assert at_least("0.203053E-06") == 2.030525e-7
    assert at_least("Cuts:") is at_least("1e+20") is at_least("nan") is None
    assert read_log(LOGS / "cplex_gams.log").bound < OPTIMUM


CLAIMED = {
    "gurobi": (
        "Best objective 2.671078499054e-01, best bound 2.671078499054e-01, gap 0.0000%",
        "Best objective 2.671078499054e-01, best bound {bound}, gap 40.0%",
    ),
    "highs": ("Dual bound        0.267104325999", "Dual bound        {bound}"),
    "scip": ("Dual Bound         : +2.67107849905365e-01", "Dual Bound         : {bound}"),
    "xpress": (
        "bound                       : 2.671176690572225e-01",
        "bound                       : {bound}",
    ),
    "cplex_gams": ("Best possible:           0.267108", "Best possible:           {bound:.6f}"),
}


@pytest.mark.parametrize("name", CLAIMED)
def test_an_optimum_far_above_its_bound_is_a_limit(name):
    text = (LOGS / f"{name}.log").read_text()
    stated, other = CLAIMED[name]
    assert stated in text
    for bound, ended in ((0.16, "limit"), (0.26705, "limit"), (0.2671, "optimal")):
        found = parse_log(text.replace(stated, other.format(bound=bound)).encode())
        assert (found.ended, found.bound) == (ended, pytest.approx(bound, abs=1e-5))


def test_the_tolerance_of_a_log_counts_where_its_objective_is_missing():
    text = (LOGS / "gurobi.log").read_text()
    text = text.replace("Best objective 2.671078499054e-01,", "Best objective -,")
    assert parse_log(text.encode()).ended == "optimal"
    loose = parse_log(text.replace("(tolerance 1.00e-04)", "(tolerance 5.00e-01)").encode())
    assert (loose.ended, loose.bound) == ("limit", KNOWN["gurobi"][3])
    text = (
        (LOGS / "highs.log").read_text().replace("Primal bound      0.267107849905", "Primal bound      inf")
    )
    assert parse_log(text.encode()).ended == "optimal"
    assert parse_log(text.replace("tolerance: 0.01%", "tolerance: 50%").encode()).ended == "limit"


@pytest.mark.parametrize(
    "status, ended",
    [
        ("problem is solved [optimal solution found]", "optimal"),
        ("solving was interrupted [time limit reached]", "limit"),
        ("solving was interrupted [gap limit reached]", "limit"),
        ("problem is solved [infeasible]", "limit"),
    ],
)
def test_a_log_has_the_status_that_the_file_of_its_solver_has(status, ended):
    text = (LOGS / "scip.log").read_text()
    stated = "problem is solved [optimal solution found]"
    assert stated in text
    assert parse_log(text.replace(stated, status).encode()).ended == ended


def test_a_log_to_which_runs_are_added_tells_of_the_last():
    first = (LOGS / "gurobi.log").read_bytes()
    second = first.replace(b"best bound 2.671078499054e-01", b"best bound 2.5e-01")
    assert parse_log(first + second).bound == 0.25
    assert parse_log(second + first).bound == KNOWN["gurobi"][3]


def test_the_shell_of_cplex_tells_the_bound_with_its_digits():
    text = (LOGS / "cplex_python.log").read_text()
    end = "MIP - Time limit exceeded, integer feasible:  Objective =  4.5934185295e-02\n"
    end += "Current MIP best bound =  3.7912345678e-02 (gap = 0.0080, 17.46%)\n"
    found = parse_log((text + end).encode())
    assert (found.ended, found.bound, found.objective) == ("limit", 0.037912345678, 0.045934185295)
    end = "MIP - Integer optimal solution:  Objective =  4.5934185295e-02\n"
    found = parse_log((text + end).encode())
    assert (found.ended, found.bound) == ("optimal", 0.045934185295)


def test_other_versions_are_read_as_well():
    """SCIP's shell says its version before a run; up to SCIP 6 its table had other columns; HiGHS 1.5."""
    scip = (LOGS / "scip.log").read_text()
    found = parse_log(("SCIP version 9.2.0 [precision: 8 byte]\n" + scip).encode())
    assert (found.version, found.columns, found.trace) == ("9.2.0", 280, read_log(LOGS / "scip.log").trace)
    head = scip[: scip.index(" time | node")]
    old = head + (
        " time | node  | left  |LP iter| mem |mdpt |frac |vars |cons |dualbound   | primalbound  |  gap\n"
        "* 0.5s|     1 |     0 |   341 | 4M  |   0 |  19 | 280 | 413 | 1.250000e-01 | 2.500000e-01 | 100%\n"
    )
    assert parse_log(old.encode()).trace == (Step(0.5, 0.125, 0.25),)
    highs = (
        (LOGS / "highs.log").read_text().replace("Timing            6.06", "Timing            6.06 (total)")
    )
    assert parse_log(highs.encode()).seconds == 6.06


def test_long_traces_keep_their_ends_and_drop_what_does_not_change():
    steps = [Step(float(at), at / 1000, 1.0) for at in range(1000)]
    found = thinned(steps, 0.999)
    assert len(found) == MOST_STEPS
    assert (found[0], found[-1]) == (steps[0], steps[-1])
    assert thinned([Step(0.0, 0.0, 1.0), Step(1.0, 0.0, 1.0)], 0.0) == (Step(0.0, 0.0, 1.0),)


@pytest.mark.parametrize("name", KNOWN)
def test_a_log_that_is_cut_off_is_read_or_refused(name):
    data = (LOGS / f"{name}.log").read_bytes()
    for end in range(0, len(data), max(1, len(data) // 60)):
        with suppress(SolutionError):
            steps = parse_log(data[:end]).trace
            assert all(value is None or math.isfinite(value) for step in steps for value in step)


def test_what_is_no_log_is_refused_in_one_line(tmp_path):
    solution = places.DATA / "solutions" / "scip-10.0_optimal.sol"
    for data, words in (
        (b"", "not a log of a known solver"),
        (solution.read_bytes(), "not a log of a known solver"),
        (bytes(range(256)) * 50, "not a log of a known solver"),
        (b"Running HiGHS 1.15.1 (git hash: 04024d7)\n", "neither a bound nor an objective"),
        (b"Gurobi Optimizer version 13\n" + b" " * 100_000 + b"\n" + b"a 0s " * 50_000, "neither a bound"),
    ):
        path = tmp_path / "mine.log"
        path.write_bytes(data)
        with pytest.raises(CrossfieldError, match=words) as refused:
            read_log(path)
        assert str(path) in str(refused.value)
        assert "\n" not in str(refused.value)
