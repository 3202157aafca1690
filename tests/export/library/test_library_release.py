"""Origin, licence and citation of a library follow from its specification; drawings lose all but strokes."""

import re
import shutil

import crossfield as cf
import pytest
from libraries import content, defects, document, library_of
from loops import for_each
from small_drawings import HOSTILE

SHOWN = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 150 110" fill="none" stroke="#000" \
stroke-width="0.375" stroke-linecap="round" stroke-linejoin="round">
<path d="M20 30L120 30 120 90 20 90 20 30"/>
<path stroke="#c8102e" d="M20 60L120 60M70 30L70 90"/>
</svg>
"""

RELEASE = '[release]\nversion = "1.2"\ndate = "2026-03-01"\nauthors = ["The testers", "A. Name"]\n'
RUNG = 'formulations = ["qp"]\n{}[rungs.tiny]\nsizes = [8]\nformats = ["mps"]\n'
OURS = """[[sketches]]
name = "mouse"
sample = "mouse"
points = "greedy"
author = "The crossfield authors"
license = "CC-BY-4.0"
source = "a built-in sample"
added = "2026-02-03"
"""
ALSO_OURS = OURS.replace("mouse", "saddle")
UNSTATED = '[[sketches]]\nname = "found"\nfile = "drawn by hand.html"\npoints = "greedy"\n'
FOREIGN = UNSTATED.replace("found", "hers") + 'author = "A. Name"\nlicense = "CC-BY-NC-4.0"\n'


def build(folder, *sketches, release="", name="lib"):
    """Build the library of some sketches, one of which may be a drawing beside the specification."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "drawn by hand.html").write_bytes(HOSTILE)
    return library_of(folder, RUNG.format(release) + "".join(sketches), name).folder


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """A library of sketches under several licences; not to be changed."""
    return build(tmp_path_factory.mktemp("mixed"), OURS, FOREIGN, UNSTATED, release=RELEASE)


def test_every_sketch_keeps_its_own_licence(mixed):
    origins = {
        "mouse": {"author": "The crossfield authors", "license": "CC-BY-4.0", "source": "a built-in sample"},
        "hers": {"author": "A. Name", "license": "CC-BY-NC-4.0"},
        "found": None,
    }
    for family, origin in origins.items():
        entry = document(mixed, f"cf_{family}_n008_qp")
        assert entry.get("origin") == document(mixed, f"cf_{family}_n008.about").get("origin") == origin
        assert entry["licence"] == (origin or {}).get("license")
        assert entry.get("added") == ("2026-02-03" if family == "mouse" else None)
    licence = (mixed / "LICENSE").read_text()
    assert "- mouse: CC-BY-4.0; author: The crossfield authors; source: a built-in sample\n" in licence
    assert "- hers: CC-BY-NC-4.0; author: A. Name\n" in licence
    assert "- found: no licence is stated; ask its author" in licence
    assert defects(mixed) == {}


def test_index_and_texts_state_the_release(mixed):
    yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")
    release = document(mixed, "library")["spec"]["release"]
    assert release == {"version": "1.2", "date": "2026-03-01", "authors": ["The testers", "A. Name"]}
    cited = yaml.safe_load((mixed / "CITATION.cff").read_text())
    assert (cited["title"], cited["version"]) == ("a library for tests", "1.2")
    assert cited["date-released"] == "2026-03-01"
    assert [author["name"] for author in cited["authors"]] == release["authors"]
    assert cited["references"][0]["doi"] == "10.1145/2710026"
    assert "## 1.2, 2026-03-01" in (mixed / "CHANGELOG.md").read_text()


@for_each(
    "sketches, licence",
    [
        ([OURS], "CC-BY-4.0"),
        ([OURS, ALSO_OURS], "CC-BY-4.0"),
        ([OURS, FOREIGN], ""),
        ([OURS.replace("CC-BY-4.0", "all mine")], ""),
        ([UNSTATED], ""),
    ],
)
def test_a_licence_of_the_library_is_a_known_one_of_all_sketches(sketches, licence, tmp_path):
    lib = build(tmp_path, *sketches, release=RELEASE if licence else "")
    stated = re.findall(r"^SPDX-License-Identifier: (.*)$", (lib / "LICENSE").read_text(), re.MULTILINE)
    cited = re.findall(r"^license: (.*)$", (lib / "CITATION.cff").read_text(), re.MULTILINE)
    assert stated == cited == [licence] * bool(licence)
    read_me = (lib / "README.md").read_text()
    assert (f"Licence of everything in this folder: {licence}, see" in read_me) == bool(licence)
    assert ("release" in document(lib, "library")["spec"]) == bool(licence)
    if sketches == [UNSTATED]:
        assert not [name for name, data in content(lib).items() if re.search(rb"CC.BY", data)]


def test_another_origin_makes_an_instance_again(mixed, tmp_path):
    shutil.copytree(mixed, tmp_path / "lib")
    lib = build(tmp_path, OURS, FOREIGN.replace("A. Name", "B. Name"), UNSTATED, release=RELEASE)
    assert document(lib, "cf_hers_n008_qp")["origin"]["author"] == "B. Name"
    assert defects(lib) == {}


def test_a_published_drawing_has_its_strokes_and_nothing_else_of_its_file(mixed):
    assert (mixed / "cf_found.sketch.svg").read_text() == SHOWN
    instance = cf.read_instance(mixed / "cf_found_n008.instance.json")
    drawn = cf.read_sketch(mixed.parent / "drawn by hand.html", size=8)
    assert (instance.theta.tolist(), instance.w.tolist()) == (drawn.theta.tolist(), drawn.w.tolist())
    for word in (b"evil.example", b"alert", b"evil title", b"foreignObject"):
        assert [name for name, data in content(mixed).items() if word in data] == []
