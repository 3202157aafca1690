"""Runs and methods on meshes, and of orthogonal crosses on pixels."""

import json
from pathlib import Path

import crossfield as cf
import pytest
from cases import make_instance
from crossfield.export.cli.app import invoke
from crossfield.export.runs.methods import METHODS, Request, find_method, methods_of
from crossfield.models.errors import DomainError
from meshes import box, on_edges, write_obj

INSTANCES = {
    "mesh": lambda: on_edges(box(1)),
    "skewed mesh": lambda: on_edges(box(1), orthogonal=False, skew_coefficient=0.01),
    "orthogonal pixels": lambda: make_instance(orthogonal=True),
}


@pytest.mark.parametrize("name", INSTANCES)
def test_every_method_of_an_instance_finds_a_field(name, tmp_path):
    instance = INSTANCES[name]()
    for method in methods_of(instance):
        *_, last = method.find(Request(instance, tmp_path, cf.Limits(5.0)))
        last.field.check_instance(instance)
        assert last.field.beta.any() <= (not instance.orthogonal)


@pytest.mark.parametrize("name", INSTANCES)
def test_other_methods_name_those_that_work(name):
    instance = INSTANCES[name]()
    for method in set(METHODS) - {method.name for method in methods_of(instance)}:
        with pytest.raises(DomainError, match=f"^{method} finds no fields .*; use greedy, power, search"):
            find_method(method, instance)


def test_pixels_with_free_angles_have_every_method():
    assert methods_of(make_instance()) == list(METHODS.values())


def test_a_run_on_a_mesh_file_writes_fields_and_a_report(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_obj(Path("box.obj"), box(1))
    assert invoke(["run", "box.obj", "-o", "out", "--time-limit", "2"]) == 0
    shown = capsys.readouterr().out
    assert "faces whose lines are less than 45 degrees apart" in shown
    assert "pixel" not in shown
    assert shown.startswith("searches take at most ")
    assert cf.read_field("out/field.npz").energy().total == pytest.approx(0.0, abs=1e-9)
    out = tmp_path / "out"
    written = {path.name for path in out.iterdir()}
    assert written >= {"field.rawfield", "field.obj", "lowest.npz", "models", "report.json", "index.html"}
    facts = json.loads((out / "report.json").read_text())
    assert {method["method"] for method in facts["methods"]} >= {"greedy", "power", "search"}
    assert facts["methods"][0]["singularities"] == 8
    assert "12 faces of a mesh" in (out / "index.html").read_text()
