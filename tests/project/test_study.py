"""The study continues after a kill, each run with one row; its page is made from its rows."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from importlib import import_module
from types import SimpleNamespace

import places
import pytest
from clusters import cluster
from crossfield.export.solvers_table import SOLVERS

DOCS = places.ROOT / "docs"
DATA = DOCS / "studying" / "data"

SMALL = """
import sys
from pathlib import Path
sys.path.insert(0, {docs!r})
from studying import work
from studying.plan import Stage
from studying.rows import Run

HANDFUL = [Run("practice", "skew", 6 + n, way) for n in range(6) for way in ("greedy", "power")]
work.stages = lambda plan, folder: [Stage("a handful", tuple(HANDFUL))]
work.carry_out(None, Path({data!r}), jobs=1, scheduler={scheduler!r}, progress=lambda line: None)
"""


@pytest.fixture(scope="module")
def study():
    """The modules of the study."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(DOCS)
        names = ("facts", "page", "plan", "practice_page", "rows", "solver_page", "work")
        yield SimpleNamespace(**{name: import_module(f"studying.{name}") for name in names})


def lines_of(path):
    return path.read_text().splitlines(keepends=True) if path.exists() else []


@pytest.mark.slow
def test_a_study_that_is_killed_goes_on_and_every_run_has_one_row(study, tmp_path):
    program = SMALL.format(docs=str(DOCS), data=str(tmp_path), scheduler=None)
    file = tmp_path / "practice.csv"
    child = subprocess.Popen([sys.executable, "-c", program])
    while len(lines_of(file)) < 4:
        assert child.poll() is None
        time.sleep(0.01)
    child.send_signal(signal.SIGKILL)
    child.wait()
    before = [line for line in lines_of(file) if line.endswith("\n")]
    with file.open("a") as stream:
        stream.write("practice,skew,1")  # what a kill may leave of a line
    subprocess.run([sys.executable, "-c", program], check=True)
    after = lines_of(file)
    assert after[: len(before)] == before
    rows = list(study.rows.read(file))
    keys = [study.rows.key_of(row) for row in rows]
    assert len(keys) == len(set(keys)) == 12
    assert {row["status"] for row in rows} == {"field"}


@pytest.mark.slow
@pytest.mark.needs("distributed")
def test_a_study_on_a_cluster_has_the_rows_that_it_has_here(study, tmp_path):
    rows = {}
    with cluster(tmp_path, PYTHONPATH=str(DOCS)) as (address, workers):
        for name, scheduler in (("there", address), ("here", None)):
            program = SMALL.format(docs=str(DOCS), data=str(tmp_path / name), scheduler=scheduler)
            subprocess.run([sys.executable, "-c", program], check=True)
            rows[name] = list(study.rows.read(tmp_path / name / "practice.csv"))
        assert all(worker.poll() is None for worker in workers)
    assert len(rows["here"]) == 12
    found = {
        name: {study.rows.key_of(row): (row["status"], row["energy_2"], row["off"]) for row in each}
        for name, each in rows.items()
    }
    assert found["here"] == found["there"]


def test_a_second_row_of_a_run_and_a_file_of_another_study_are_refused(study, tmp_path):
    run = study.rows.Run("practice", "skew", 6, "greedy")
    table = study.rows.Rows(tmp_path / "a.csv")
    table.append(run, {"status": "field", "note": 'a, "b"\nc', "seconds": 0.5})
    with pytest.raises(ValueError, match="has a row already"):
        study.rows.Rows(tmp_path / "a.csv").append(run, {})
    (row,) = study.rows.Rows(tmp_path / "a.csv").rows
    assert (row["note"], row["seconds"], row["bound"]) == ('a, "b" c', 0.5, None)
    (tmp_path / "b.csv").write_text("other,columns\n1,2\n")
    with pytest.raises(ValueError, match="other columns"):
        study.rows.Rows(tmp_path / "b.csv")


def solver_rows(study, size, proven, count=10):
    for number in range(count):
        run = study.rows.Run("solvers", f"lines {number}", size, "milp-mccormick", "highs", limit=6.0)
        status = "optimal-global" if number < proven else "limit-with-point"
        yield run, {"status": status, "objective": 1.0, "bound": 1.0 if number < proven else 0.0}


@pytest.mark.parametrize("proven", [0, 1])
def test_a_pair_that_proves_too_little_of_a_rung_has_one_row_on_the_next(study, tmp_path, proven):
    kept = study.rows.tables(tmp_path)
    for run, found in solver_rows(study, 4, proven):
        kept["solvers"].append(run, found)
    stages = [
        study.plan.Stage(str(size), tuple(run for run, _ in solver_rows(study, size, 0)), after)
        for size, after in ((6, 4), (8, 6))
    ]
    left = study.work.left(list(stages[0].runs), stages[0], kept)
    assert len(left) == (10 if proven else 0)
    if proven:
        return
    assert study.work.left(list(stages[1].runs), stages[1], kept) == []
    rows = [row for row in kept["solvers"].rows if row["status"] == "not run"]
    assert [(row["size"], row["note"]) for row in rows] == [
        (6.0, "proved 0 of 10 on the rung of 4"), (8.0, "proved 0 of 10 on the rung of 4")
    ]  # fmt: skip
    standing = study.solver_page.rungs_of(kept["solvers"].rows)
    assert {size: rung.cell() for size, rung in standing["milp-mccormick", "highs"].items()} == {
        4: "0 of 10, 6.0 s", 6: "-", 8: "-",
    }  # fmt: skip


def test_profiles_are_those_of_dolan_and_more(study):
    inf = float("inf")
    times = {"a": {(1,): 1.0, (2,): 4.0, (3,): inf}, "b": {(1,): 3.0, (2,): 2.0, (3,): inf, (4,): 1.0}}
    found = study.facts.ratios(times)  # case 4 is not one of a
    assert {name: ratios.tolist() for name, ratios in found.items()} == {
        "a": [1.0, 2.0, inf], "b": [1.0, 3.0, inf],
    }  # fmt: skip


def test_answers_that_contradict_the_optimum_are_reported(study):
    known = {("1-norm", "lines 0", 4.0): (2.0, 2.0)}
    rows = []
    for status, objective, bound in (
        ("optimal-global", 2.0, 2.0), ("optimal-global", 2.1, 2.1), ("limit-with-point", 1.9, 0.0),
        ("limit-with-point", 3.0, 2.5), ("limit-with-point", 3.0, 1.5),
    ):  # fmt: skip
        row = dict.fromkeys(study.rows.COLUMNS) | {
            "way": "milp-mccormick",
            "solver": "highs",
            "facet": "hull",
        }
        row |= {"instance": "lines 0", "size": 4.0, "status": status, "objective": objective, "bound": bound}
        rows.append(row)
    found = study.facts.contradictions(rows, known)
    assert [rows.index(row) for row, _ in found] == [1, 2, 3]


def practice_rows(study, errors, size=24.0):
    for number, (way, (error, energy, seconds, limit)) in enumerate(errors.items()):
        for drawing in ("mouse", "ring", "saddle"):
            row = dict.fromkeys(study.rows.COLUMNS) | {"part": "practice", "instance": drawing, "way": way}
            row |= {"size": size, "hidden": 0.0, "status": "field", "energy_2": energy, "off": 1.0}
            row |= {"error": error + 0.01 * number, "seconds": seconds, "limit": limit}
            yield row


def test_the_recommendation_follows_the_rows(study):
    slow = {"search": (5.0, 1.0, 10.0, 10.0), "two-stage": (6.0, 2.0, 10.0, 10.0)}
    texts = []
    for bend, greedy in ((3.0, 4.0), (4.0, 3.0)):
        ways = {"bend": (bend, 1.5, 0.1, 0.0), "greedy": (greedy, 1.2, 0.1, 0.0)} | slow
        kept = {"practice": list(practice_rows(study, ways)), "solvers": [], "proofs": []}
        texts.append(study.practice_page.recommendation(kept))
    assert [sentences[0].split("`")[1] for sentences in texts] == ["bend", "greedy"]
    assert {sentences[1] for sentences in texts} == {
        "For the lowest energy, use `search, 10 s` at 24 pixels."
    }
    assert all(len(sentences) == 2 for sentences in texts)
    sizes = {
        24.0: {"bend": (3.0, 1.5, 0.1, 0.0), "greedy": (4.0, 1.2, 0.1, 0.0)} | slow,
        48.0: {"bend": (3.0, 1.5, 2.0, 0.0), "greedy": (4.0, 1.2, 0.9, 0.0)} | slow,
        128.0: {"bend": (3.0, 1.5, 9.0, 0.0), "greedy": (4.0, 1.2, 8.0, 0.0)} | slow,
    }
    rows = [row for size, ways in sizes.items() for row in practice_rows(study, ways, size)]
    first, second = study.practice_page.recommendation({"practice": rows, "solvers": [], "proofs": []})
    assert all(each in first for each in ("`bend` at 24 pixels", "`greedy` at 48 pixels"))
    assert second == "For the lowest energy, use `search, 10 s` at 24, 48 and 128 pixels."
    nothing = {"practice": [], "solvers": [], "proofs": []}
    assert study.practice_page.recommendation(nothing) == ["The methods are not measured yet."]


@pytest.mark.slow
def test_every_planned_run_is_another_one_and_the_instances_are_the_same_again(study):
    runs = [run for stage in study.plan.stages(study.plan.QUICK, None) for run in stage.runs]
    assert len({run.key for run in runs}) == len(runs) > 200
    instances = import_module("studying.instances")
    names = instances.rung(4)
    assert len(names) == len(set(names)) == 30
    found = [instances.made(name, 4).sha256 for name in names]
    assert len(set(found)) == 30
    instances.made.cache_clear()
    assert found == [instances.made(name, 4).sha256 for name in names]


@pytest.mark.slow
def test_the_page_and_its_tables_are_made_from_the_rows(study, tmp_path):
    study.page.write_page(DATA, tmp_path, study.plan.FULL)
    names = ["evidence.md", *(f"evidence/{path.name}" for path in (DOCS / "evidence").iterdir())]
    assert len(list((tmp_path / "evidence").iterdir())) == len(names) - 1 > 10
    for name in names:
        assert (tmp_path / name).read_text() == (DOCS / name).read_text(), name
    short = study.page.in_short(study.page.read(DATA), study.plan.FULL)
    assert f" -->\n{short}\n<!-- end of answers -->" in (DOCS / "index.md").read_text()


def test_no_instance_is_proven_twice_with_two_optima(study):
    kept = study.page.read(DATA)
    for row in kept["proofs"]:
        assert row["bound"] <= row["objective"] * (1 + 1e-9), (row["instance"], row["size"], row["norm"])
    for rows in kept.values():
        keys = [study.rows.key_of(row) for row in rows]
        assert len(keys) == len(set(keys))


@pytest.mark.slow
def test_a_quick_study_makes_its_page(study, tmp_path):
    program = (
        f"import sys; sys.path.insert(0, {str(DOCS)!r})\n"
        "from dataclasses import replace\nfrom pathlib import Path\n"
        "from studying import page, plan, work\n"
        "small = replace(plan.QUICK, instances=1, limit=0.3, proof=1.0, quality=(12,), quality_limit=0.5,\n"
        "                practice=(12,), practice_limit=0.5, quick_search=0.2)\n"
        "if __name__ == '__main__':\n"
        f"    work.carry_out(small, Path({str(tmp_path)!r}), jobs=2)\n"
        f"    page.write_page(Path({str(tmp_path)!r}), Path({str(tmp_path)!r}), small)\n"
    )
    script = tmp_path / "small.py"
    script.write_text(program)
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    subprocess.run([sys.executable, str(script)], check=True, env=environment)
    text = (tmp_path / "evidence.md").read_text()
    assert "still missing" not in text or any(solver.missing for solver in SOLVERS.values())
    for name in ("profiles", "growth", "quality", "weights", "practice"):
        assert (tmp_path / "pictures" / f"evidence_{name}.svg").read_bytes().startswith(b"<?xml")
    assert not list(tmp_path.glob(".lock"))
