"""Given points of a specification: a build with them does not search and is the same everywhere."""

import json
import os
import shutil
import subprocess
import sys

import pytest
from crossfield.export.library.building.build import build
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.documents.documents import read_about, read_library
from crossfield.export.library.ledger.grades import EASY, difficulty
from crossfield.export.library.ledger.known_points import ROLES, read_points
from crossfield.export.library.ledger.ledger import Record
from crossfield.export.library.plan.instances import make_instance
from crossfield.export.library.plan.recipe import NORMS, plan_library
from crossfield.export.library.plan.spec import default_spec, read_spec
from crossfield.models.errors import InputError
from libraries import content, improve, library_of, spec_of
from processors import PROCESSORS

pytestmark = pytest.mark.usefixtures("short_searches")

SPEC = """[rungs.tiny]
sizes = [3]
gauges = ["strokes", "box"]
facets = ["hull", "printed"]
compress = true

[[sketches]]
name = "rand"
random = "full"
seeds = [1]

[[sketches]]
name = "saddle"
sample = "saddle"
sizes = { tiny = [4] }
"""
SEARCHED = """formulations = ["qp-fixed", "miqp-exact"]

[rungs.tiny]
sizes = [4]
formats = ["mps"]

[[sketches]]
name = "saddle"
sample = "saddle"
"""
STEM, SADDLE = "cf_rand_n003_s1", "cf_saddle_n004_box"


def worsened(path):
    """State the greedy field as the best known one, and return its 2-norm energy."""
    about = read_about(path)
    poor = about["fields"]["baseline"]
    assert poor["energy_2norm"] > about["fields"]["least_2"]["energy_2norm"] + 1e-6
    about["fields"] = dict.fromkeys(ROLES, poor)
    path.write_text(json.dumps(about))
    return poor["energy_2norm"]


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    """A library whose points were searched for; not to be changed."""
    return library_of(tmp_path_factory.mktemp("searched"), SPEC).folder


@pytest.fixture(scope="module")
def spec(searched, tmp_path_factory):
    """A specification with the points of that library."""
    folder = tmp_path_factory.mktemp("spec")
    spec_of(folder, f'points = "{searched}"\n' + SPEC)
    return folder / "spec.toml"


def on(processor, *arguments):
    """Run a command as on another processor."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"} | processor
    command = [sys.executable, "-W", "ignore", "-m", "crossfield", "library", *map(str, arguments)]
    subprocess.run(command, env=environment, check=True, capture_output=True)


@pytest.mark.slow
def test_a_library_with_points_is_the_same_on_every_processor_and_verifies_there(spec, tmp_path):
    first, *others = (tmp_path / str(number) for number in range(len(PROCESSORS)))
    for processor, folder in zip(PROCESSORS, (first, *others), strict=True):
        on(processor, "build", spec, "-o", folder, "--quiet")
    for folder in others:
        assert content(folder) == content(first)
    on(PROCESSORS[-1], "verify", first)


@pytest.mark.slow
@pytest.mark.skipif(len(PROCESSORS) < 2, reason="this processor runs only one kind of OpenBLAS kernels")
def test_a_library_without_points_is_the_same_under_other_kernels(tmp_path):
    spec_of(tmp_path, SEARCHED)
    spec = tmp_path / "spec.toml"
    libraries = []
    for number, processor in enumerate((PROCESSORS[0], PROCESSORS[-1])):
        folder = tmp_path / str(number)
        on(processor, "build", spec, "-o", folder, "--quiet")
        libraries.append(content(folder))
    first, other = libraries
    assert other.keys() == first.keys()
    assert [name for name in first if other[name] != first[name]] == []


@pytest.mark.slow
def test_given_points_are_stated_and_the_models_are_those_of_a_search(searched, spec, tmp_path):
    library = build(read_spec(spec), tmp_path / "lib").folder
    assert verify_library(library) == []
    before, after = content(searched), content(library)
    assert before.keys() == after.keys()
    stated = {name for name in before if before[name] != after[name]}
    assert all(name.endswith(".json") or name == "SHA256SUMS" for name in stated)
    about = read_about(library / f"{STEM}.about.json")
    old = read_about(searched / f"{STEM}.about.json")
    assert all(about[key] == old[key] for key in ("fields", "certificates"))
    assert "given" in about
    assert "given" not in old


@pytest.mark.slow
def test_a_build_with_points_searches_for_nothing(searched, tmp_path):
    """A greedy field that is given as the best one stays, and no optimum is proven."""
    known = shutil.copytree(searched, tmp_path / "known")
    poor = worsened(known / f"{SADDLE}.about.json")
    about = read_about(known / f"{STEM}.about.json")
    del about["certificates"]
    (known / f"{STEM}.about.json").write_text(json.dumps(about))
    library = library_of(tmp_path, 'points = "known"\n' + SPEC).folder
    fields = read_about(library / f"{SADDLE}.about.json")["fields"]
    assert {field["energy_2norm"] for field in fields.values()} == {poor}
    assert read_library(library).entry(f"{STEM}_exact")["bounds"] == []


@pytest.mark.slow
def test_a_better_point_keeps_given_points_and_another_build_gives_the_same(searched, tmp_path):
    """A library of poor points accepts a better one, which a new build from the ledger reproduces."""
    known = shutil.copytree(searched, tmp_path / "known")
    worsened(known / f"{SADDLE}.about.json")
    spec = spec_of(tmp_path, 'points = "known"\n' + SPEC)
    library = build(spec, tmp_path / "lib").folder
    (tmp_path / "sent").mkdir()
    shutil.copy(searched / f"{SADDLE}_exact.sol", tmp_path / "sent")
    improved, _ = improve(library, tmp_path / "sent")
    assert f"{SADDLE}_exact" in improved[f"{SADDLE}_exact.sol"]
    assert verify_library(library) == []
    again = spec_of(tmp_path, 'points = "known"\nledger = "lib/ledger.json"\n' + SPEC)
    assert content(build(again, tmp_path / "other").folder) == content(library)


@pytest.mark.slow
def test_points_of_another_instance_are_reported_and_do_not_count(searched, tmp_path):
    text = 'points = "known"\n' + SPEC.replace("seeds = [1]", "seeds = [2]")
    known = shutil.copytree(searched, tmp_path / "known")
    other = "cf_rand_n003_s2"
    for path in [*known.glob(f"{STEM}.*"), *known.glob(f"{STEM}_box.*")]:
        renamed = path.read_bytes()
        if path.name.endswith(".about.json"):
            renamed = renamed.replace(STEM.encode(), other.encode())
        path.with_name(path.name.replace(STEM, other)).write_bytes(renamed)
    lines = []
    library = build(spec_of(tmp_path, text), tmp_path / "lib", progress=lines.append).folder
    assert [line for line in lines if "another instance" in line] == [
        f"{name}: the points given are of another instance; searched for others"
        for name in (f"{other}_box", other)
    ]
    assert verify_library(library) == []


@pytest.mark.slow
def test_points_that_are_missing_or_damaged_are_reported(searched, tmp_path):
    with pytest.raises(InputError, match="points: there is no points"):
        spec_of(tmp_path, 'points = "points"\n' + SPEC)
    known = shutil.copytree(searched, tmp_path / "points")
    spec = spec_of(tmp_path, 'points = "points"\n' + SPEC)
    (known / f"{STEM}.field.json").write_text("{}")
    assert f"{STEM}.field.json" in " ".join(map(str, build(spec, tmp_path / "lib").failed.values()))
    (known / f"{STEM}.field.json").unlink()
    with pytest.raises(InputError, match=rf"{STEM}\.field\.json: cannot be read"):
        build(spec, tmp_path / "lib")


# The library that ships


@pytest.mark.slow
def test_the_points_that_ship_are_about_the_shipped_instances():
    """No search is needed, and tiny and small instances with a proof have their certificates."""
    spec = default_spec()
    sizes = {path: path.stat().st_size for path in spec.points.iterdir()}
    assert max(size for path, size in sizes.items() if path.suffix == ".npz") <= 2_000_000
    assert sum(sizes.values()) < 32_000_000
    points = read_points(spec.points)
    for planned in plan_library(spec):
        known = points(planned.recipe.name)
        assert known.instance == make_instance(planned.recipe).sha256
        for role in ROLES:
            field, facts = known.field(role).field, known.about["fields"][role]
            assert field.instance.sha256 == known.instance
            for norm in NORMS:
                assert field.energy(norm).total == facts[f"energy_{norm}norm"]
        certificates = known.certificates(make_instance(planned.recipe), NORMS)
        assert all(certificate.facts["status"] == "optimal" for certificate in certificates)
        if planned.recipe.rung in {"tiny", "small"}:
            assert tuple(certificate.norm for certificate in certificates) == planned.recipe.prove


# Grades


def run(**more):
    facts = {"status": "optimal", "bound": 1.0, "threads": 1, "seconds": EASY} | more
    return Record("cf_a_n004_milp", "0" * 64, "HiGHS", "1", **facts)


@pytest.mark.parametrize(
    "status, runs, tangent, grade",
    [
        ("best known", [run(status="limit")], False, "open"),
        ("optimal", [run()], False, "easy"),
        ("claimed", [run()], False, "easy"),
        ("optimal", [], True, "easy"),
        ("optimal", [], False, "hard"),
        ("optimal", [run(seconds=EASY + 1), run(threads=4), run(seconds=None)], False, "hard"),
        ("optimal", [run(status="limit", seconds=1.0)], False, "hard"),
        ("claimed", [run(bound=0.6)], False, "hard"),
        ("claimed", [run(bound=1.0 - 2e-6), run(bound=None)], False, "hard"),
        ("claimed", [run(bound=1.0 - 5e-7)], False, "easy"),
    ],
)
def test_grades_follow_the_runs_on_an_entry(status, runs, tangent, grade):
    """The best point has the objective 1; a claim of an optimum counts with a bound that proves it."""
    assert difficulty(status, 1.0, runs, tangent=tangent) == grade
