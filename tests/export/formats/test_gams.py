"""GAMS files, read back by GAMS: translated by CONVERT, evaluated by CasADi, solved."""

from __future__ import annotations

import importlib.util
import re
import subprocess
from pathlib import Path

import numpy as np
import places
import pytest
from cases import CASES, make_field, make_problem, names_of, problem_of
from crossfield.export.formats import gams
from crossfield.export.formats.registry import write
from crossfield.export.programs import gams as gams_program
from crossfield.export.programs.comparison import behaviour_difference
from crossfield.export.writing.canonical import CanonicalForm
from crossfield.models.formulations.names import column_names
from crossfield.models.formulations.problem import Problem
from crossfield.models.instance.instance import Instance
from loops import for_each
from oracles import random_points

GOLDEN = places.GOLDEN
HEADER = ["a comment with %per cent%, a $dollar and an é", "$call in a comment"]
CHOSEN = [label for label in CASES if re.search("strokes|relax|facet|norm=|parts|row", label)]
needs_gams = pytest.mark.needs("gams")
SOLVED = ["milp-mccormick gauge=strokes", "qp-fixed gauge=strokes", "milp-mccormick shape=row"]


def text_of(problem: Problem, **options: np.ndarray) -> bytes:
    return b"".join(gams.generate(CanonicalForm(problem), HEADER, **options))


def run_gams(folder: Path, text: bytes, *options: str) -> dict[str, float]:
    """The values that the results switch writes; fails on any error of GAMS."""
    executable = Path(importlib.util.find_spec("gamspy_base").origin).parent / "gams"
    (folder / "x.gms").write_bytes(text)
    command = [executable, "x.gms", "lo=0", "o=x.lst", "--RESULTS=a result.csv", *options]
    done = subprocess.run(command, cwd=folder, check=False, capture_output=True)
    listing = (folder / "x.lst").read_text(errors="replace")
    assert done.returncode == 0, [line for line in listing.splitlines() if line.startswith("****")]
    results = folder / "a result.csv"
    lines = results.read_text().splitlines() if results.exists() else []
    pairs = (line.split(",") for line in lines)
    return {name: float(value) for name, value in pairs if name != "problem"}


@needs_gams
@for_each("label", CHOSEN)
def test_gams_reads_the_problem(label: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)  # where GAMS puts its files
    problem = problem_of(label)
    write(problem, tmp_path / "model.gms")
    points = random_points(problem)
    values = gams_program.evaluate(tmp_path / "model.gms", points)
    assert behaviour_difference(values, problem, points) == ""


@needs_gams
@for_each("label", [*SOLVED, "milp-mccormick shape=parts"])
def test_a_start_comes_back_under_our_names(label: str, tmp_path: Path):
    """CONVERT solves nothing, so the results are the start; `parts` has a column in no term."""
    problem = problem_of(label)
    start = problem.point(make_field(problem.instance))
    convert = [f"{model}=convert" for model in sorted(set(gams.MODEL_TYPES.values()))]
    results = run_gams(tmp_path, text_of(problem, start=start), *convert)
    head, names = list(results)[:3], list(results)[3:]
    assert head == ["model_status", "solver_status", "objective"]
    assert names == names_of(column_names(problem.instance, problem.blocks))
    assert results["objective"] == pytest.approx(problem.objective_value(start), rel=1e-14)
    np.testing.assert_allclose([results[name] for name in names], start, rtol=1e-15, atol=0)


@for_each("label", CHOSEN)
def test_text_is_plain(label: str):
    problem = problem_of(label)
    text = text_of(problem, start=problem.point(make_field(problem.instance))).decode()
    lines = text.splitlines()
    assert max(map(len, lines)) < 200
    assert not re.search(r"\t|\*\*|\0", text)
    assert all(re.match(r"\* ", line) for line in lines if line.startswith("*"))
    assert max(len(word) for word in re.findall(r"[A-Za-z]\w*", text.partition("$offListing")[2])) <= 63
    before_switch = text.partition("$ifThen set RESULTS")[0]
    assert not re.search(
        r"^\s*(\$include|\$call|execute|put|file)\b", before_switch, re.IGNORECASE | re.MULTILINE
    )


def test_a_small_model_has_the_bytes_of_its_golden_file():
    """A small model that people can read; the other tests check its meaning."""
    instance = Instance.on_pixels("golden", [[True, True], [True, False]], [[0, 1]], [2.5], [0.5])
    text = b"".join(
        gams.generate(
            CanonicalForm(make_problem("minlp-quartic", instance)), ["minlp-quartic on three pixels"]
        )
    )
    assert text == (GOLDEN / "minlp-quartic.gms").read_bytes()
    assert text.count(b"\n") < 80
