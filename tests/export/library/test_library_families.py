"""Families of random instances: seeds and points of a specification, and their builds."""

import json
import tomllib
from dataclasses import replace

import pytest
from crossfield.export.library.building import fields
from crossfield.export.library.building.build import build
from crossfield.export.library.plan.recipe import plan_library
from crossfield.export.library.plan.spec import DEFAULT, default_spec, read_spec, spec_of
from crossfield.models.errors import InputError
from crossfield.models.field.file import read_field
from loops import for_each

SPEC = """format = "crossfield-library-spec"
version = 1
title = "a family for tests"
formulations = ["exact", "milp"]

[rungs.tiny]
sizes = [3]
formats = ["nl", "mps"]
gauges = ["strokes", "box"]

[[sketches]]
name = "fam"
random = "full"
seeds = "1-5"
share = 0.3
points = "proven"
"""


SMALL = SPEC.replace('"1-5"', '"3-5"')
"""The same with fewer instances, for builds."""


def written(folder, text=SPEC):
    path = folder / "spec.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The library of the specification; not to be changed."""
    folder = tmp_path_factory.mktemp("family")
    return build(read_spec(written(folder, SMALL)), folder / "library")


# The specification


def test_the_specification_that_ships_obeys_its_schema():
    assert read_spec(DEFAULT) == default_spec()


@for_each(
    "old, new",
    [
        ("", ""),
        ('seeds = "1-5"', "seeds = [3, 1, 5, 4, 2]"),
        ("share = 0.3", "share = 0.25"),
        ('points = "proven"', 'points = "none"'),
    ],
)
def test_the_document_of_a_specification_is_that_specification(tmp_path, old, new):
    spec = read_spec(written(tmp_path, SPEC.replace(old, new)))
    again = spec_of(json.loads(json.dumps(spec.document())), tmp_path / "library.json")
    assert again == spec


BAD = {
    "range that falls": ('"1-5"', '"5-1"', "sketches[0].seeds: '5-1' must rise"),
    "range too long": ('"1-5"', '"1-200000"', "by less than 100000"),
    "proof of fixed jumps": ('"exact", "milp"', '"qp"', "formulations: fam has proven points"),
    "share of nothing": ("0.3", "0", "; write a number above 0"),
}


@for_each("case", BAD)
def test_a_bad_family_is_named_with_its_place_and_remedy(tmp_path, case):
    old, new, words = BAD[case]
    with pytest.raises(InputError) as error:
        read_spec(written(tmp_path, SPEC.replace(old, new)))
    assert words in str(error.value)
    assert "spec.toml" in str(error.value)


def test_a_family_that_states_nothing_more_has_the_recipes_of_before():
    """Digests of recipes are in every document, so a new key there would change files that exist."""
    recipes = [planned.recipe.document() for planned in plan_library(default_spec())]
    assert {key for document in recipes for key in document} == {
        *("name", "sketch", "rung", "size", "seed", "gauge", "prove", "added")
    }
    assert {key for document in recipes for key in document["sketch"]} == {
        *("kind", "what", "title", "sha256", "origin")
    }
    sketch = next(listed for listed in default_spec().document()["sketches"] if "random" in listed)
    assert sketch["seeds"] == [1, 2, 3]
    assert sketch.keys() <= tomllib.loads(SPEC)["sketches"][0].keys() | {
        *("title", "rungs", "sizes", "author", "license", "source", "added")
    } - {"share", "points"}


# The build


def test_proven_points_are_optimal_under_the_gauge_strokes(built):
    exact = [entry for entry in built.entries if entry["formulation"] == "miqp-exact"]
    assert {(sidecar["source"]["gauge"], sidecar["status"]) for sidecar in exact} == {
        ("strokes", "optimal"),
        ("box", "best known"),
    }
    assert {sidecar["solved"]["by"] for sidecar in exact if sidecar["status"] == "optimal"} == {"certificate"}


def test_less_work_gives_the_same_instances_and_points_of_no_lower_energy(built, tmp_path):
    energies = {}
    spec = read_spec(written(tmp_path, SMALL))
    for points in ("none", "greedy"):
        (sketch,) = spec.sketches
        less = build(replace(spec, sketches=(replace(sketch, points=points),)), tmp_path / points)
        assert {entry["status"] for entry in less.entries} == {"best known"}
        assert {entry["best"]["solver"] for entry in less.entries} == {
            {"none": "crossfield (nearest stroke)", "greedy": "crossfield (greedy)"}[points]
        }
        names = [f"cf_fam_n003_s{seed}" for seed in range(3, 6)]
        for name in names:
            file = f"{name}.instance.json"
            assert (less.folder / file).read_bytes() == (built.folder / file).read_bytes()
        energies[points] = [read_field(less.folder / f"{one}.field.json").energy().total for one in names]
    proven = [read_field(built.folder / f"{one}.field.json").energy().total for one in names]
    assert all(map(lambda *one: one[0] <= one[1] + 1e-12, proven, energies["greedy"]))
    assert sum(energies["greedy"]) < sum(energies["none"])


@pytest.mark.slow
def test_a_large_certificate_of_an_optimum_is_kept(tmp_path, monkeypatch):
    """It was left out with its field, although it proved the optimum."""
    monkeypatch.setattr(fields, "_MOST_BYTES", 1)  # which any certificate exceeds
    text = SMALL.replace('"3-5"', "[524]").replace("[3]", "[5]").replace("0.3", "0.2")
    text = text.replace('"exact", "milp"', '"exact"').replace(', "box"', "")
    (entry,) = build(read_spec(written(tmp_path, text)), tmp_path / "library").entries
    assert (entry["status"], entry["best"]["solver"]) == ("optimal", "crossfield (prove)")
    assert (tmp_path / "library" / "cf_fam_n005_s524.certificate.npz").exists()
