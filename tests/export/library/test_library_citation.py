"""Origin, licence and citation of a library follow from its specification alone."""

import json
import re
import shutil

import pytest
from crossfield.export.library.building.build import build
from crossfield.export.library.checking.check_library import verify_library
from crossfield.export.library.documents.citation import REFERENCES, bibtex, slug, terms
from crossfield.export.library.plan.recipe import plan
from crossfield.export.library.plan.spec import default_spec, read_spec
from crossfield.models.errors import InputError
from crossfield.models.sketch.samples import sample_svg

pytestmark = pytest.mark.usefixtures("short_searches")

HEAD = """format = "crossfield-library-spec"
version = 1
title = "tests & more"
formulations = ["qp"]
"""
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


def spec_of(folder, *parts):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "drawn by hand.svg").write_text(sample_svg("mouse"))
    (folder / "spec.toml").write_text("".join((HEAD, *parts)))
    return read_spec(folder / "spec.toml")


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mixed")
    return build(spec_of(folder, RELEASE, RUNG, OURS, FOREIGN, UNSTATED), folder / "library")


def texts(library):
    return {name: (library.folder / name).read_text() for name in TEXTS}


@pytest.mark.slow
def test_every_sketch_keeps_its_own_licence(mixed):
    origins = {each["family"]: each.get("origin") for each in mixed.entries}
    assert origins == {
        "mouse": {"author": "The crossfield authors", "license": "CC-BY-4.0", "source": "a built-in sample"},
        "hers": {"author": "A. Name", "license": "CC-BY-NC-4.0"},
        "found": None,
    }
    assert [each["licence"] for each in mixed.entries] == ["CC-BY-4.0", "CC-BY-NC-4.0", None]
    assert [each.get("added") for each in mixed.entries] == ["2026-02-03", None, None]
    about = json.loads((mixed.folder / "cf_hers_n004.about.json").read_text())
    assert about["origin"] == origins["hers"]
    assert all(each["references"] == list(REFERENCES) for each in mixed.entries)
    licence = texts(mixed)["LICENSE"]
    assert "- mouse: CC-BY-4.0; author: The crossfield authors; source: a built-in sample\n" in licence
    assert "- hers: CC-BY-NC-4.0; author: A. Name\n" in licence
    assert "- found: no licence is stated; ask its author" in licence
    assert "SPDX-License-Identifier" not in licence
    assert not re.search(r"^license:", texts(mixed)["CITATION.cff"], re.MULTILINE)
    assert verify_library(mixed.folder) == []


@pytest.mark.slow
def test_without_a_licence_no_text_states_cc_by(tmp_path):
    plain = build(spec_of(tmp_path, RUNG, UNSTATED), tmp_path / "library")
    assert not [name for name, text in texts(plain).items() if re.search("CC.BY|Commons", text)]
    assert not any("CC-BY" in path.read_text() for path in plain.folder.glob("*.json"))
    assert set(plain.document["release"]) == {"title", "authors", "bibtex"}
    assert plain.document["release"]["authors"] == []
    ours = build(spec_of(tmp_path / "ours", RELEASE, RUNG, OURS), tmp_path / "other")
    assert "SPDX-License-Identifier: CC-BY-4.0\n" in texts(ours)["LICENSE"]
    assert "\nlicense: CC-BY-4.0\n" in texts(ours)["CITATION.cff"]
    assert "Attribution 4.0 International (CC BY 4.0)" in texts(ours)["README.md"]


@pytest.mark.slow
def test_index_and_texts_state_the_release(mixed):
    yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")
    release = mixed.document["release"]
    assert {key: release[key] for key in ("title", "authors", "version", "date")} == {
        "title": "tests & more",
        "authors": ["The testers", "A. Name"],
        "version": "1.2",
        "date": "2026-03-01",
    }
    shown = yaml.safe_load(texts(mixed)["CITATION.cff"])
    assert (shown["title"], shown["version"], shown["date-released"]) == ("tests & more", "1.2", "2026-03-01")
    assert [each["name"] for each in shown["authors"]] == release["authors"]
    assert shown["references"][0]["doi"] == "10.1145/2710026"
    assert "Extrapolating curvature lines" in shown["message"]
    assert all(f"# {line}" in texts(mixed)["CITATION.cff"] for line in release["bibtex"].split("\n") if line)
    assert release["bibtex"] in texts(mixed)["README.md"]
    assert "## 1.2, 2026-03-01" in texts(mixed)["CHANGELOG.md"]


def test_a_licence_of_the_library_is_known_and_that_of_all_sketches(tmp_path):
    known = spec_of(tmp_path, RUNG, OURS)
    other = OURS.replace("mouse", "saddle")
    assert terms(known.sketches)["licence"] == "CC-BY-4.0"
    assert terms(known.sketches)["name"] == "Creative Commons Attribution 4.0 International (CC BY 4.0)"
    for more in (FOREIGN, UNSTATED, other.replace("CC-BY-4.0", "mine")):
        assert terms(spec_of(tmp_path, RUNG, OURS, more).sketches)["licence"] == ""
    assert terms(spec_of(tmp_path, RUNG, OURS.replace("CC-BY-4.0", "all mine")).sketches)["licence"] == ""
    assert terms(spec_of(tmp_path, RUNG, OURS, other).sketches)["licence"] == "CC-BY-4.0"


def test_bibtex_is_complete_and_escaped(tmp_path):
    given = spec_of(tmp_path, RELEASE.replace("A. Name", "100%_{x}\\\\^~"), RUNG, OURS)
    text = bibtex(given)
    assert text.startswith("@misc{tests_more_2026,\n  title = {{tests \\& more}},\n")
    assert (
        "author = {{The testers} and 100\\%\\_\\{x\\}\\textbackslash{}\\textasciicircum{}\\textasciitilde{}}"
        in text
    )
    bare = re.sub(r"\\[{}]", "", text)
    assert bare.count("{") == bare.count("}")
    assert len(re.findall(r"^@(misc|article)\{\w+,$", text, re.MULTILINE)) == 3
    assert (slug("Größe 1.0: x"), slug("..")) == ("gr-e-1.0-x", "library")


@pytest.mark.slow
def test_another_origin_makes_an_instance_again_and_a_forged_one_is_found(mixed, tmp_path):
    folder = shutil.copytree(mixed.folder, tmp_path / "library")
    stolen = FOREIGN.replace("A. Name", "B. Name")
    again = build(spec_of(tmp_path, RELEASE, RUNG, OURS, stolen, UNSTATED), folder)
    assert again.entry("cf_hers_n004_qp")["origin"]["author"] == "B. Name"
    assert verify_library(folder) == []
    for name in ("cf_found_n004_qp.json", "cf_found_n004.about.json"):
        path = folder / name
        whole = path.read_text()
        path.write_text(json.dumps(json.loads(whole) | {"origin": {"license": "CC0-1.0"}}))
        assert "states another origin" in " ".join(str(each) for each in verify_library(folder))
        path.write_text(whole)
    index = json.loads((folder / "library.json").read_text())
    index["release"]["authors"] = ["M. Allory"]
    (folder / "library.json").write_text(json.dumps(index))
    assert "library.json: is not what follows from the specification" in " ".join(
        str(each) for each in verify_library(folder)
    )


def test_an_invalid_origin_or_release_is_refused(tmp_path):
    for text, words in (
        (OURS.replace('"2026-02-03"', "2026-02-03"), r"sketches\[0\]\.added: must be a day in quotes"),
        (OURS.replace("02-03", "02-30"), r"sketches\[0\]\.added: '2026-02-30' is no day"),
        (OURS.replace('"CC-BY-4.0"', "4"), r"sketches\[0\]\.license: must be one line of text"),
        (OURS + '[release]\nversion = "1"\n', "release.date: there is none; write a day in quotes"),
    ):
        with pytest.raises(InputError, match=words):
            spec_of(tmp_path, RUNG, text)


def test_the_shipped_library_states_release_and_origins():
    spec = default_spec()
    assert spec.release is not None
    assert spec.release.authors == ("The crossfield authors",)
    assert {each.origin.license for each in spec.sketches} == {"CC-BY-4.0"}
    assert {each.origin.author for each in spec.sketches} == {"The crossfield authors"}
    assert all(each.recipe.added for each in plan(spec))
