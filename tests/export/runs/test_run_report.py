"""A run reports its start, the solver that returned its start, and the seconds of each stage."""

import json
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.cli.output import show_report
from crossfield.export.runs.methods import METHODS, Candidate
from crossfield.export.runs.report import Report, Stopwatch
from crossfield.export.statuses import Status
from crossfield.models.search.starts import first_field


def test_stages_are_all_the_time_whatever_is_rounded():
    times = iter([10.0, 10.00049, 10.00098, 11.5, 13.25])
    watch = Stopwatch(lambda: next(times))
    for stage in ("a", "b", "c", "a"):
        watch.lap(stage)
    assert watch.stages == {"a": pytest.approx(1.75), "b": 0.001, "c": pytest.approx(1.499)}
    assert sum(watch.stages.values()) == pytest.approx(3.25, abs=1e-3)
    short = iter([0.0, 0.0006, 0.0007])
    watch = Stopwatch(lambda: next(short))
    watch.lap("a")
    watch.lap("b")
    assert [f"{seconds:.1f}" for seconds in watch.stages.values()] == ["0.0", "0.0"]


@pytest.mark.slow
def test_a_run_has_a_row_for_its_start_and_its_seconds_add_up(tmp_path):
    instance = cf.sample("mouse", 8, stroke_weight=10)
    command = [
        "run",
        "mouse",
        "--size",
        "8",
        "--stroke-weight",
        "10",
        "--time-limit",
        "0.5",
        "--threads",
        "1",
        "-q",
    ]
    assert invoke([*command, "-o", str(tmp_path)]) == 0
    document = json.loads((tmp_path / "report.json").read_text())
    assert {key: document["instance"][key] for key in ("sha256", "w_strokes", "w_beta", "stroke_weight")} == {
        "sha256": instance.sha256,
        "w_strokes": 30.0,
        "stroke_weight": 10.0,
        "w_beta": instance.skew_coefficient,
    }
    rows = {row["method"]: row for row in document["methods"]}
    assert rows["start"]["energy_2_norm"] == first_field(instance).energy(2).total
    assert rows["start"]["seconds"] == document["stages"]["start"]
    untimed = [method.name for method in METHODS.values() if not method.timed]
    rest = ["compiling", "search", "prove", "waiting", "fields", "certificate"]
    assert list(document["stages"]) == ["start", "models", *untimed, *rest]
    assert {"MILP", "two-stage"} & set(rows)
    assert document["surface"]["picture"] or document["surface"]["doubts"]
    assert document["seconds"] == round(sum(document["stages"].values()), 3)
    shape = cf.read_field(tmp_path / "field.npz").shape
    kept = rows[document["kept"]]
    assert kept["strokes_beyond_10_degrees"] == shape.far_strokes
    assert kept["lines_under_45_degrees"] == shape.narrow_pixels
    assert kept["stroke_deviation_mean_degrees"] == pytest.approx(np.degrees(shape.mean_deviation))
    assert kept["stroke_deviation_90_percent_degrees"] == pytest.approx(np.degrees(shape.most_deviation))


def test_a_solver_without_time_gives_back_its_start_and_it_is_said(capsys, tmp_path):
    instance = cf.sample("mouse", 8)
    problem, start = cf.formulate(instance, "milp-mccormick"), first_field(instance)
    given_back = cf.solve(problem, limits=cf.Limits(1e-6), start=start)
    assert given_back.start_returned is True
    assert given_back.gap is None
    late = replace(given_back, claimed=Status.LIMIT_WITH_POINT, claimed_bound=0.25 * given_back.objective)
    assert late.gap == pytest.approx(0.75)
    milp = Candidate("MILP", late.field, 1.0, late)
    show_report(Report(instance, (Candidate("start", start, 0.1), milp), (), stages={"start": 0.1}), tmp_path)
    text = capsys.readouterr().out
    assert "start returned" in text
    assert f"MILP returned its start: objective {late.objective:.4g}, bound" in text
    assert "gap 75%" in text
    assert "0.1 s: start 0.1" in text


def test_another_point_than_the_start_is_none_and_a_proven_one_has_no_gap():
    instance = cf.sample("skew", 4)
    problem, start = cf.formulate(instance, "milp-mccormick"), cf.power_field(instance).with_best_jumps()
    solved = cf.solve(problem, limits=cf.Limits(60, threads=1), start=start)
    assert solved.status == Status.OPTIMAL_GLOBAL
    assert solved.start_returned is False
    assert solved.gap == pytest.approx((solved.objective - solved.bound) / solved.objective)
    assert solved.gap < 1e-3
    assert cf.solve(problem, limits=cf.Limits(60, threads=1)).start_returned is None
