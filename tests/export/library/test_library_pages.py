"""Pages of a site beyond a sidecar's counts: loading, structure, presolve, runs, origin, citation."""

import json
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from html import escape, unescape
from pathlib import Path

import pytest
from browsing import CONTRAST, find, served, show, sideways
from crossfield.export.library.building.build import build
from crossfield.export.library.documents.documents import problem_of
from crossfield.export.library.plan.spec import read_spec
from crossfield.export.library.site.site import write_site
from crossfield.export.pictures.marks import FAMILIES, STROKE
from crossfield.export.writing.canonical import Canonical
from forging import seal

pytestmark = [pytest.mark.usefixtures("short_searches"), pytest.mark.slow]

SPEC = """format = "crossfield-library-spec"
version = 1
title = "a library to cite"

[rungs.tiny]
sizes = [4]
formats = ["nl", "gms", "lp", "mps", "mod"]
facets = ["hull", "printed"]
prove = false

[rungs.small]
sizes = [6]
formats = ["nl"]
compress = true
prove = false

[[sketches]]
name = "mouse"
sample = "mouse"
"""
ENTRY, INSTANCE = "cf_mouse_n004_milp", "cf_mouse_n004"
RUNS = [
    {
        "solver": "Gurobi",
        "version": "13.0.3",
        "status": "optimal",
        "objective": 2.5,
        "bound": 2.5,
        "seconds": 0.7,
        "threads": 4,
        "limit": 60,
        "evidence": "log",
        "machine": "8 cores <img src=x onerror=alert(1)>",
        "by": "A. Tester",
        "date": "2026-11-22",
        "trace": [[0.0, None, 9.0], [0.4, 1.5, 3.0], [0.7, 2.5, 2.5]],
    },
    {
        "solver": "SCIP",
        "version": "10.0",
        "status": "limit",
        "evidence": "word",
        "bound": 1.25,
        "trace": [[1.0, 0.5, None], [9.0, 1.25, None]],
    },
    {"solver": "HiGHS", "version": "1.15.1", "status": "no point"},
]
BIBTEX = "@misc{crossfield-library,\n  title = {A library to cite},\n  year = {2026}\n}"
TOLD = {
    "added": "2026-11-22",
    "references": ["A. Author, A paper, 2020"],
    "origin": {"author": "A. Drawer", "license": "CC0-1.0", "source": "drawn for this test"},
    "density": 0.1875,
    "difficulty": "hard",
    "status": "claimed",
    "claimed": [{"solver": "Gurobi", "version": "13.0.3"}],
    "runs": RUNS,
}


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("library")
    (folder / "spec.toml").write_text(SPEC)
    return build(read_spec(folder / "spec.toml"), folder / "built")


@pytest.fixture(scope="module")
def site(library, tmp_path_factory):
    folder = tmp_path_factory.mktemp("web") / "site"
    write_site(library.folder, folder)
    return folder


@pytest.fixture(scope="module")
def detailed(library, tmp_path_factory):
    """The site of a library with one entry that has every optional fact, and others without any."""
    folder = Path(shutil.copytree(library.folder, tmp_path_factory.mktemp("detailed") / "library"))
    path = folder / f"{ENTRY}.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | TOLD))
    about = folder / f"{INSTANCE}.about.json"
    about.write_text(json.dumps(json.loads(about.read_text()) | {"origin": TOLD["origin"]}))
    solved = folder / f"{INSTANCE}_exact.json"
    programs = [{"solver": name, "version": "1"} for name in ("Gurobi", "SCIP")]
    programs += [{"solver": "Bonmin", "version": "2", "via": f"{INSTANCE}_cubic"}]
    by = {"status": "optimal", "solved": {"by": "agreement", "programs": programs}}
    solved.write_text(json.dumps(json.loads(solved.read_text()) | by))
    index = json.loads((folder / "library.json").read_text())
    release = {
        "version": "1.2",
        "date": "2026-11-22",
        "authors": ["the authors"],
        "title": "t",
        "bibtex": BIBTEX,
    }
    (folder / "library.json").write_text(json.dumps(index | {"release": release}))
    seal(folder)
    write_site(folder, folder.parent / "site")
    return folder.parent / "site"


def text_of(site, entry):
    return (site / "entry" / f"{entry}.html").read_text()


def ways_of(site, entry):
    """The lines by which a page states that the entry is loaded, by program."""
    part = re.search(r'<section aria-labelledby="loading">(.*?)</section>', text_of(site, entry), re.DOTALL)[
        1
    ]
    found = re.findall(r"<h3>([^<]*)</h3>(?:\s*<pre[^>]*><code>([^<]*)</code></pre>)?", part)
    return {title.split(",")[0]: unescape(lines) for title, lines in found}


def ran(lines, folder, *more):
    """The last line that a Python program prints in the folder of the files."""
    done = subprocess.run(
        [sys.executable, "-c", "\n".join([lines, *more])],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()[-1]


# how to load an entry


def test_every_file_that_is_to_be_loaded_is_there(library, site):
    for entry in library.entries:
        found = ways_of(site, entry["name"])
        assert {"Pyomo", "JuMP"} <= set(found)
        assert ("GAMS" in found) == ("AMPL" in found) == (entry["rung"] == "tiny")
        for title, lines in found.items():
            packed = set(re.findall(r"cf_\w+[\w.]*\.gz", lines))
            for name in re.findall(r"cf_\w+(?:\.\w+)+", lines):
                there = (site / "files" / name).is_file()
                assert there or f"{name}.gz" in packed, (title, name)


def test_the_lines_for_highs_find_the_known_optimum(library, site):
    for entry in library.entries:
        lines = ways_of(site, entry["name"]).get("HiGHS", "")
        if entry["class"] not in {"MILP", "QP"} or entry["rung"] != "tiny":
            assert not lines
            continue
        assert len(lines.splitlines()) == 3
        printed = ran(lines, site / "files", "print(highs.getInfo().objective_function_value)")
        assert float(printed) == pytest.approx(entry["best"]["objective"], abs=1e-5, rel=1e-5)


def test_the_lines_for_pyomo_make_the_problem_with_its_options_and_jumps(library, site):
    entries = [entry for entry in library.entries if entry["rung"] == "tiny"]
    script = ["import pyomo.environ as pyo", "found = []"]
    count = "sum(1 for _ in model.component_data_objects({}))"
    for entry in entries:
        lines = ways_of(site, entry["name"])["Pyomo"]
        assert ("printed" in lines) == (entry["options"]["facet"] == "printed")
        script += [lines, f"found += [{count.format('pyo.Var')}, {count.format('pyo.Constraint')}]"]
    wanted = [entry["counts"][key] for entry in entries for key in ("variables", "constraints")]
    assert ran("\n".join(script), site / "files", "print(*found)") == " ".join(map(str, wanted))


def test_jump_reads_nl_files_without_a_legacy_block_and_states_the_loss_of_names(library, site):
    names = [entry["name"] for entry in library.entries]
    lines = {name: ways_of(site, name)["JuMP"] for name in names}
    nl = [name for name in names if ".nl" in lines[name]]
    assert 0 < len(nl) < len(names)
    assert [name for name in names if "; use_nlp_block = false)" in lines[name]] == nl
    assert [name for name in names if "JuMP reads no names with .nl files" in text_of(site, name)] == nl


@pytest.mark.needs("gurobi")
def test_the_lines_for_gurobi_read_every_file_of_its_class(library, site):
    for name in (ENTRY, f"{INSTANCE}_bilin", f"{INSTANCE}_exact"):
        lines = ways_of(site, name)["Gurobi"]
        columns = columns_of(library, library.entry(name))
        assert ran(lines, site / "files", "print(model.NumVars, model.Status)") == f"{columns} 2"


def columns_of(library, entry):
    """Number of columns in the .mps of an entry, including ONE."""
    return Canonical(problem_of(library, entry)).column_count


# structure and presolve


def test_every_matrix_and_every_hessian_has_its_picture(library, site):
    for entry in library.entries:
        counts, text = entry["counts"], text_of(site, entry["name"])
        for kind, there in (("matrix", counts["nonzeros"]), ("hessian", counts["nonlinear_variables"])):
            name = f"{entry['name']}.{kind}.svg"
            assert (f"../pictures/{name}" in text) == (site / "pictures" / name).is_file() == bool(there)
        assert ("all is linear" in text) == (entry["class"] == "MILP")
        if counts["nonzeros"]:
            drawn = ET.parse(site / "pictures" / f"{entry['name']}.matrix.svg").getroot()
            assert drawn.findall(f".//*[@fill='{FAMILIES[0]}']")
            assert bool(drawn.findall(f".//*[@fill='{STROKE}']")) == bool(counts["nonlinear_nonzeros"])


def test_presolve_is_shown_of_linear_models_alone(library, site):
    for entry in library.entries:
        found = re.search(r"presolve by HiGHS .*?</table>", text_of(site, entry["name"]), re.DOTALL)
        assert bool(found) == (entry["class"] == "MILP" and entry["rung"] == "tiny")
        if not found:
            continue
        before, after = (
            [int(each) for each in re.findall(r'class="number">(\d+)<', line)]
            for line in re.findall(r"<tr><th scope=\"row\">.*?</tr>", found[0])
        )
        counts = entry["counts"]
        integer = counts["integer"] + counts["binary"]
        assert before == [columns_of(library, entry), integer, counts["constraints"], counts["nonzeros"]]
        assert all(left <= held for left, held in zip(after, before, strict=True))


# runs, origin and citation


def test_an_entry_shows_its_runs_origin_and_citation(site, detailed):
    text = text_of(detailed, ENTRY)
    wanted = [
        "A. Drawer",
        "drawn for this test",
        "A. Author, A paper, 2020",
        "A. Tester",
        "CC0-1.0",
        "8 cores &lt;img",
    ]
    wanted += [
        "the submitter&#39;s word",
        "2026-11-22",
        "18.8",
        "hard",
        "Gurobi 13.0.3",
        "SCIP 10.0",
    ]
    assert [each for each in wanted if each not in text] == []
    assert re.search(r"Optimality is\s+claimed by Gurobi 13\.0\.3", text)
    assert 'class="status claimed">claimed' in text
    assert "@misc{crossfield-library," in text
    assert "@misc{a_library_to_cite," in text_of(site, ENTRY)
    agreed = r"Solved\s+by agreement of Gurobi 1, SCIP 1, Bonmin 2 on cf_mouse_n004_cubic\."
    assert re.search(agreed, text_of(detailed, f"{INSTANCE}_exact"))
    for other in (text_of(site, ENTRY), text_of(detailed, f"{INSTANCE}_qp")):
        assert [each for each in wanted[:4] if each in other] == []
    about = (detailed / "about.html").read_text()
    assert "@misc{crossfield-library," in about
    assert "1.2" in about


def test_every_page_states_a_licence_only_if_all_entries_share_it(library, site, detailed):
    free = {entry["licence"] for entry in library.entries} == {"CC-BY-4.0"}
    for folder, claimed in ((site, free), (detailed, False)):
        about = (folder / "about.html").read_text()
        assert ("CC BY 4.0" in re.search(r"<footer.*?</footer>", about, re.DOTALL)[0]) == claimed
        assert ("A. Drawer" in about) == (folder == detailed)
        assert escape((folder / "files" / "LICENSE").read_text(), quote=False) in about.replace("&#39;", "'")


# in a browser


@pytest.fixture(scope="module")
def address(detailed):
    with served(detailed) as address:
        yield address


@pytest.mark.parametrize("width", [320, 390])
@pytest.mark.parametrize("page", ["index.html", f"instance/{INSTANCE}.html"])
def test_a_phone_shows_every_status_and_gap_without_scrolling_sideways(browser, address, page, width):
    show(browser, width=width, height=844)
    browser.get(f"{address}/{page}")
    script = """return [...document.querySelectorAll('table.entries tbody tr')].map(row =>
      [row.cells[0], row.querySelector('.status'), row.cells[2]].map(each => each.getBoundingClientRect())
      .map(box => [box.left, box.right]))"""
    rows = browser.execute_script(script)
    assert len(rows) >= 9
    for name, status, gap in rows:
        assert name[0] >= 0
        assert name[1] <= status[0], "the name that stays in sight covers no status"
        assert status[1] <= gap[1] <= width


@pytest.mark.parametrize("page", [f"entry/{ENTRY}.html", f"entry/{INSTANCE}_quartic.html", "about.html"])
def test_pages_that_tell_everything_fit_a_phone_and_can_be_read_in_both_modes(browser, address, page):
    for scheme in ("light", "dark"):
        show(browser, width=390, height=844, scheme=scheme)
        browser.get(f"{address}/{page}")
        browser.execute_script("document.querySelectorAll('details').forEach(each => each.open = true)")
        assert sideways(browser) == ([390, 390], [])
        assert browser.execute_script(CONTRAST)[0][0] >= 4.5


def test_pictures_of_structure_follow_dark_mode(browser, address):
    from io import BytesIO

    from PIL import Image, ImageStat

    means = []
    for scheme in ("light", "dark"):
        show(browser, scheme=scheme)
        browser.get(f"{address}/entry/{ENTRY}.html")
        shown = find(browser, "img[src$='.matrix.svg']")
        browser.execute_script(
            "arguments[0].loading = 'eager'; arguments[0].scrollIntoView(); return arguments[0].decode()",
            shown,
        )
        picture = Image.open(BytesIO(shown.screenshot_as_png)).convert("L")
        assert picture.getextrema()[1] - picture.getextrema()[0] > 60
        means.append(ImageStat.Stat(picture).mean[0])
    assert means[0] > 180
    assert means[1] < 90


def test_a_button_copies_the_citation(browser, address):
    from selenium.webdriver.support.wait import WebDriverWait

    browser.get(f"{address}/about.html")
    blocks = browser.find_elements("css selector", "#citation ~ pre")
    assert blocks[0].text.startswith("@misc{crossfield-library")
    button = find(browser, "#citation ~ button")
    button.click()
    WebDriverWait(browser, 5).until(lambda _: button.text in {"Copied", "Selected"})
