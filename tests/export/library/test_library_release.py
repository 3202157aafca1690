"""Origin, licence and citation of a library follow from its specification."""

import json
import re
import shutil

import pytest
from crossfield.export.library.building.build import build
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.documents.citation import REFERENCES, licence_terms
from crossfield.models.errors import InputError
from crossfield.models.sketch.samples import sample_svg
from libraries import spec_of

pytestmark = pytest.mark.usefixtures("short_searches")

FORMULATION = 'formulations = ["qp"]\n'
RELEASE = """[release]
version = "1.2"
date = "2026-03-01"
authors = ["The testers", "A. Name"]
"""
RUNG = """[rungs.tiny]
sizes = [4]
formats = ["mps"]
prove = false
"""
OURS = """[[sketches]]
name = "mouse"
sample = "mouse"
author = "The crossfield authors"
license = "CC-BY-4.0"
source = "a built-in sample"
added = "2026-02-03"
"""
FOREIGN = """[[sketches]]
name = "hers"
file = "drawn by hand.svg"
author = "A. Name"
license = "CC-BY-NC-4.0"
"""
UNSTATED = """[[sketches]]
name = "found"
file = "drawn by hand.svg"
"""
TEXTS = ("README.md", "LICENSE", "CITATION.cff", "CHANGELOG.md")


def drawn_spec(folder, *parts):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "drawn by hand.svg").write_text(sample_svg("mouse"))
    return spec_of(folder, FORMULATION + "".join(parts))


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mixed")
    return build(drawn_spec(folder, RELEASE, RUNG, OURS, FOREIGN, UNSTATED), folder / "library")


def texts(library):
    return {name: (library.folder / name).read_text() for name in TEXTS}


@pytest.mark.slow
def test_every_sketch_keeps_its_own_licence(mixed):
    origins = {entry["family"]: entry.get("origin") for entry in mixed.entries}
    assert origins == {
        "mouse": {"author": "The crossfield authors", "license": "CC-BY-4.0", "source": "a built-in sample"},
        "hers": {"author": "A. Name", "license": "CC-BY-NC-4.0"},
        "found": None,
    }
    assert [entry["licence"] for entry in mixed.entries] == ["CC-BY-4.0", "CC-BY-NC-4.0", None]
    assert [entry.get("added") for entry in mixed.entries] == ["2026-02-03", None, None]
    about = json.loads((mixed.folder / "cf_hers_n004.about.json").read_text())
    assert about["origin"] == origins["hers"]
    assert all(entry["references"] == list(REFERENCES) for entry in mixed.entries)
    licence = texts(mixed)["LICENSE"]
    assert "- mouse: CC-BY-4.0; author: The crossfield authors; source: a built-in sample\n" in licence
    assert "- hers: CC-BY-NC-4.0; author: A. Name\n" in licence
    assert "- found: no licence is stated; ask its author" in licence
    assert "SPDX-License-Identifier" not in licence
    assert not re.search(r"^license:", texts(mixed)["CITATION.cff"], re.MULTILINE)
    assert verify_library(mixed.folder) == []


@pytest.mark.slow
def test_without_a_licence_no_text_states_cc_by(tmp_path):
    plain = build(drawn_spec(tmp_path, RUNG, UNSTATED), tmp_path / "library")
    assert not [name for name, text in texts(plain).items() if re.search("CC.BY", text)]
    assert not any("CC-BY" in path.read_text() for path in plain.folder.glob("*.json"))
    assert "release" not in plain.document["spec"]
    ours = build(drawn_spec(tmp_path / "ours", RELEASE, RUNG, OURS), tmp_path / "other")
    assert "SPDX-License-Identifier: CC-BY-4.0\n" in texts(ours)["LICENSE"]
    assert "\nlicense: CC-BY-4.0\n" in texts(ours)["CITATION.cff"]
    assert "Licence of everything in this folder: CC-BY-4.0, see" in texts(ours)["README.md"]


@pytest.mark.slow
def test_index_and_texts_state_the_release(mixed):
    yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")
    release = mixed.document["spec"]["release"] | {"title": mixed.document["spec"]["title"]}
    assert {key: release[key] for key in ("title", "authors", "version", "date")} == {
        "title": "a library for tests",
        "authors": ["The testers", "A. Name"],
        "version": "1.2",
        "date": "2026-03-01",
    }
    shown = yaml.safe_load(texts(mixed)["CITATION.cff"])
    assert [shown[key] for key in ("title", "version", "date-released")] == [
        release[key] for key in ("title", "version", "date")
    ]
    assert [author["name"] for author in shown["authors"]] == release["authors"]
    assert shown["references"][0]["doi"] == "10.1145/2710026"
    assert "Extrapolating curvature lines" in shown["message"]
    assert "## 1.2, 2026-03-01" in texts(mixed)["CHANGELOG.md"]


def test_a_licence_of_the_library_is_known_and_that_of_all_sketches(tmp_path):
    known = drawn_spec(tmp_path, RUNG, OURS)
    other = OURS.replace("mouse", "saddle")
    assert licence_terms(known.sketches)["licence"] == "CC-BY-4.0"
    for more in (FOREIGN, UNSTATED, other.replace("CC-BY-4.0", "mine")):
        assert licence_terms(drawn_spec(tmp_path, RUNG, OURS, more).sketches)["licence"] == ""
    assert (
        licence_terms(drawn_spec(tmp_path, RUNG, OURS.replace("CC-BY-4.0", "all mine")).sketches)["licence"]
        == ""
    )
    assert licence_terms(drawn_spec(tmp_path, RUNG, OURS, other).sketches)["licence"] == "CC-BY-4.0"


@pytest.mark.slow
def test_another_origin_makes_an_instance_again(mixed, tmp_path):
    folder = shutil.copytree(mixed.folder, tmp_path / "library")
    stolen = FOREIGN.replace("A. Name", "B. Name")
    again = build(drawn_spec(tmp_path, RELEASE, RUNG, OURS, stolen, UNSTATED), folder)
    assert again.entry("cf_hers_n004_qp")["origin"]["author"] == "B. Name"
    assert verify_library(folder) == []


def test_an_invalid_origin_or_release_is_refused(tmp_path):
    for text, words in (
        (OURS.replace('"2026-02-03"', "2026-02-03"), r"sketches\[0\]\.added: .* write a day in quotes"),
        (
            OURS.replace("02-03", "02-30"),
            r"sketches\[0\]\.added: '2026-02-30' is not a 'day'; write a day in quotes",
        ),
        (OURS.replace('"CC-BY-4.0"', "4"), r"license: 4 is not of type 'string'; write one line of text"),
        (OURS + '[release]\nversion = "1"\n', "release: 'date' is a required property; write a table"),
    ):
        with pytest.raises(InputError, match=words):
            drawn_spec(tmp_path, RUNG, text)
