"""The programs in docs/ that measure: each can be imported, and measures a small input with real parts."""

import json
import subprocess
import sys
from dataclasses import asdict

import pytest
from places import ROOT

NEEDS = {
    "command_pages": "sphinx",
    "conf": "sphinx",
    "csv_pages": "sphinx",
    "formulas": "latex2mathml",
    "studio_pictures": "selenium",
    "studio_times": "selenium",
}
"""Packages of the extra `docs` that a program needs."""


@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "docs").glob("*.py")))
def test_every_program_can_be_imported(docs_module, name):
    if name in NEEDS:
        pytest.importorskip(NEEDS[name])
    docs_module(name)


@pytest.mark.parametrize("part", ["paper", "optima", "solvers"])
def test_the_first_row_of_proofs_is_measured(docs_module, part, tmp_path, monkeypatch):
    proofs = docs_module("proofs")
    monkeypatch.setattr(proofs, "SIZE", 8)
    _, row = next(iter(proofs.PARTS[part](proofs.Request((), 60.0, None, tmp_path))))
    assert json.loads(json.dumps(row))["energy"] >= 0


@pytest.mark.parametrize("measure, name", [("hidden", "mouse"), ("missed", "mouse"), ("surface", "vase")])
def test_a_field_is_measured(docs_module, measure, name):
    fields = docs_module("fields")
    rows = fields.Task(measure, name, 16, 0.0, None, 0.1, ("power",)).rows()
    assert {row[5] for row in rows} == {"power"}


@pytest.mark.filterwarnings("ignore:An input array is constant")  # the confidence, on so small a surface
@pytest.mark.parametrize(
    "part, arguments", [("known", ["vase"]), ("trust", ["mouse", "mouse"]), ("times", ["mouse"])]
)
def test_a_surface_is_measured(docs_module, part, arguments):
    assert docs_module("surface").MEASURES[part](*arguments, 12)


def test_the_fields_of_a_mesh_are_measured(docs_module):
    meshes = docs_module("mesh_fields")
    row = meshes.measure("disc", 0.0, rounds=1)
    assert 0 < meshes.excess(row) < 10
    assert meshes.table_row("disc", row)["mesh"] == "disc"


def test_a_run_of_the_study_is_measured(docs_module):
    rows, work = docs_module("studying.rows"), docs_module("studying.work")
    row = work.perform((rows.Run("practice", "skew", 8, "greedy"), None))
    assert row["status"] != rows.FAILED, row


def test_a_run_with_cycles_is_measured(docs_module, tmp_path):
    study = docs_module("cycle_study")
    assert study.measure(study.Run("cube", "milp-cycle", False, "highs"), 10.0)["objective"] == 0
    study.extended_model(study.Skewed("pixels 5 7001", True, True, "scip"), tmp_path / "it.lp")
    assert "\n cyc_0: +1 d_" in (tmp_path / "it.lp").read_text()


def test_a_run_of_a_solver_is_measured(docs_module, tmp_path):
    """In a process of its own, because a run limits the memory and the time of its process."""
    run = next(run for run in docs_module("studying.solvers.plan").QUICK.first() if run.solver == "highs")
    program = [sys.executable, str(ROOT / "docs" / "solver_study.py"), "--quick", "--data", str(tmp_path)]
    words = ["--one", json.dumps(asdict(run)), "0", "60"]
    done = subprocess.run([*program, *words], capture_output=True, check=True, text=True)
    assert json.loads(done.stdout)["objective"] >= 0
