"""The site of a library: pages and files on disk, and in a browser."""

import json
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from browsing import CONTRAST, find, served, show, sideways
from crossfield.export.cli.app import invoke
from crossfield.export.library.site.site import count, write_site
from crossfield.export.pictures.draw import count_singularities
from crossfield.export.pictures.marks import FAMILIES, NEGATIVE, POSITIVE, STROKE
from crossfield.models.errors import InputError, InstanceError, OutputError
from crossfield.models.field.file import read_field
from crossfield.models.instance.file import read_instance
from forging import seal
from libraries import library_of

pytestmark = [pytest.mark.usefixtures("short_searches"), pytest.mark.slow]

SPEC = """formulations = ["minlp-quartic", "milp-mccormick", "qp-fixed"]

[rungs.tiny]
sizes = [4]
formats = ["nl", "gms", "lp", "mps"]

[rungs.small]
sizes = [6]
formats = ["nl", "mps"]
compress = true
prove = false

[[sketches]]
name = "mouse"
sample = "mouse"

[[sketches]]
name = "rand"
random = "ragged"
seeds = [1]
"""
ENTRY, INSTANCE = "cf_mouse_n006_milp", "cf_mouse_n006"
KINDS = ("index.html", "about.html", f"instance/{INSTANCE}.html", f"entry/{ENTRY}.html")


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return library_of(tmp_path_factory.mktemp("library"), SPEC)


@pytest.fixture(scope="module")
def site(library, tmp_path_factory):
    folder = tmp_path_factory.mktemp("web") / "site"
    write_site(library.folder, folder)
    return folder


@pytest.fixture
def other_library(library, tmp_path):
    """A copy that may be damaged."""
    return Path(shutil.copytree(library.folder, tmp_path / "library"))


def names_in(folder):
    return sorted(path.name for path in folder.iterdir())


def content_of(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


class Page(HTMLParser):
    """Links, ids, headings and shown checksums of a page."""

    VOID = frozenset({"meta", "link", "img", "input", "br", "wbr"})

    def __init__(self, path):
        super().__init__()
        self.elements, self.open, self.texts, self.misplaced = [], [], [], []
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.misplaced.append((tag, self.getpos()))

    def handle_data(self, data):
        if data.strip():
            self.texts.append((self.open[-1] if self.open else "", data.strip()))

    def all(self, *tags):
        return [attributes for tag, attributes in self.elements if tag in tags]

    @property
    def ids(self):
        return [attributes["id"] for _, attributes in self.elements if "id" in attributes]


@pytest.fixture(scope="module")
def pages(site):
    return {path.relative_to(site).as_posix(): Page(path) for path in sorted(site.rglob("*.html"))}


# files


def test_there_is_a_page_for_every_entry_and_every_instance(library, pages):
    instances = {entry["instance"]["file"].removesuffix(".instance.json") for entry in library.entries}
    expected = {
        "index.html",
        "about.html",
        *(f"entry/{entry['name']}.html" for entry in library.entries),
        *(f"instance/{name}.html" for name in instances),
    }
    assert set(pages) == expected
    assert (len(library.entries), len(instances)) == (12, 4)


def test_the_same_library_gives_the_same_bytes(library, site, tmp_path):
    write_site(library.folder, tmp_path / "again")
    assert content_of(tmp_path / "again") == content_of(site)


def test_the_whole_library_is_in_the_folder_of_files(library, site):
    assert content_of(site / "files") == content_of(library.folder)


def test_the_command_prints_the_number_of_pages_and_replaces_an_earlier_site(library, site, tmp_path, capsys):
    earlier = shutil.copytree(site, tmp_path / "web")
    (earlier / "index.html").write_text("old")
    (earlier / "entry" / "cf_gone.html").write_text("old")
    assert invoke(["library", "site", str(library.folder), "-o", str(earlier)]) == 0
    assert "18 pages" in capsys.readouterr().out
    assert content_of(earlier) == content_of(site)
    assert names_in(tmp_path) == ["web"]


def test_a_run_that_fails_leaves_the_earlier_site_and_nothing_else(site, other_library, tmp_path):
    earlier = Path(shutil.copytree(site, tmp_path / "web"))
    path = other_library / f"{INSTANCE}.field.json"
    path.write_text(path.read_text().replace('"pixels"', '"pixel"', 1))
    seal(other_library)
    with pytest.raises(InstanceError, match=rf"{INSTANCE}\.field\.json"):
        write_site(other_library, earlier)
    assert content_of(earlier) == content_of(site)
    assert names_in(tmp_path) == ["library", "web"]


def test_a_file_that_differs_from_its_checksum_is_named(other_library, tmp_path):
    with (other_library / f"{ENTRY}.sol").open("a") as stream:
        stream.write("\n")
    with pytest.raises(InputError, match=rf"{ENTRY}\.sol: is missing or differs"):
        write_site(other_library, tmp_path / "web")
    assert names_in(tmp_path) == ["library"]


@pytest.mark.parametrize("line", ["", "../secret", "a/b", ".hidden"])
def test_checksums_of_places_elsewhere_are_refused(other_library, tmp_path, line):
    with (other_library / "SHA256SUMS").open("a") as stream:
        stream.write(f"{64 * '0'}  {line}\n")
    with pytest.raises(InputError, match="is no checksum of a plain file name"):
        write_site(other_library, tmp_path / "web")


def test_a_folder_with_other_things_is_left_alone(library, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(OutputError, match=r"holds 'thesis\.tex', which is no part of a site"):
        write_site(library.folder, tmp_path)
    with pytest.raises(OutputError, match="is a file"):
        write_site(library.folder, tmp_path / "thesis.tex")
    for inside in (library.folder, library.folder / "web"):
        with pytest.raises(OutputError, match="lies inside the library"):
            write_site(library.folder, inside)
    assert names_in(tmp_path) == ["thesis.tex"]


def test_texts_of_files_are_escaped_everywhere(other_library, tmp_path):
    hostile = "\"'><img src=x onerror=alert(1)> & <script>"
    for path in other_library.glob("cf_*.json"):
        document = json.loads(path.read_text())
        if document.get("format") in {"crossfield-library-entry", "crossfield-library-instance"}:
            document |= {"title": hostile, "generator": hostile}
            document["source"] |= {
                "sketch": hostile,
                "description": hostile,
                "parameters": {hostile: hostile},
            }
            if document["format"] == "crossfield-library-entry":
                document |= {
                    "refused": {hostile: hostile},
                    "references": [hostile],
                    "paper": hostile,
                }
                document["best"] |= {"solver": hostile, "version": hostile, "by": hostile}
                document["files"][0] |= {"dialect": hostile, "notes": [hostile]}
                relation = {"formulation": hostile, "entry": None, "why": hostile}
                document["equivalent"] = [relation]
            path.write_text(json.dumps(document))
    index = json.loads((other_library / "library.json").read_text())
    index["generator"] = index["spec"]["title"] = hostile
    (other_library / "library.json").write_text(json.dumps(index))
    (other_library / "CITATION.cff").write_text(hostile)
    seal(other_library)
    write_site(other_library, tmp_path / "web")
    for path in (tmp_path / "web").rglob("*.html"):
        page = Page(path)
        assert [attributes.get("defer") for attributes in page.all("script")] == [None]
        assert not [values for _, values in page.elements if "onerror" in values]
        assert not page.misplaced
        assert page.open == []
    shown = Page(tmp_path / "web" / "entry" / f"{ENTRY}.html")
    assert sum(hostile in text for _, text in shown.texts) >= 10


# pages as documents


def test_every_internal_link_leads_somewhere_and_only_anchors_lead_out(site, pages):
    for name, page in pages.items():
        targets = [anchor["href"] for anchor in page.all("a", "link")] + [
            image["src"] for image in page.all("img", "script")
        ]
        for target in targets:
            parts = urlsplit(target)
            if parts.scheme:
                assert parts.scheme == "https"
                assert target in [anchor["href"] for anchor in page.all("a")]
                continue
            path = (site / name).parent / unquote(parts.path) if parts.path else site / name
            assert path.resolve().is_relative_to(site)
            assert path.is_file(), (name, target)
            if parts.fragment:
                assert parts.fragment in pages[path.resolve().relative_to(site).as_posix()].ids
    css = (site / "site.css").read_text()
    assert "url(" not in css
    assert "@import" not in css


def test_pages_are_well_formed_and_accessible(pages):
    titles = []
    for name, page in pages.items():
        assert page.misplaced == [], name
        assert page.open == []
        assert page.all("html")[0]["lang"] == "en"
        assert (
            len(page.all("h1"))
            == len(page.all("main"))
            == len(page.all("header"))
            == len(page.all("footer"))
            == 1
        )
        assert len(set(page.ids)) == len(page.ids)
        assert all("alt" in image for image in page.all("img"))
        assert len(page.all("caption")) == len(page.all("table"))
        assert all(attributes.get("scope") for attributes in page.all("th"))
        assert all(nav.get("aria-label") for nav in page.all("nav"))
        assert all(
            {"aria-label", "aria-labelledby"} & set(attributes)
            for _, attributes in page.elements
            if attributes.get("role") == "region"
        )
        assert all(
            attributes["aria-labelledby"] in page.ids
            for _, attributes in page.elements
            if "aria-labelledby" in attributes
        )
        levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch("h[1-6]", tag)]
        assert levels[0] == 1
        assert all(after <= before + 1 for before, after in pairwise(levels))
        titles += [text for tag, text in page.texts if tag == "title"]
    assert len(set(titles)) == len(pages)


def test_an_entry_shows_its_sidecar(library, site, pages):
    for entry in library.entries:
        page = pages[f"entry/{entry['name']}.html"]
        texts = {text for _, text in page.texts}
        wanted = [
            *map(count, entry["counts"].values()),
            entry["class"],
            entry["status"],
            repr(entry["best"]["objective"] + 0.0),
            *(repr(bound["bound"] + 0.0) for bound in entry["bounds"]),
        ]
        assert {word for word in wanted if word not in texts} == set()
        download = [anchor["href"] for anchor in page.all("a") if "download" in anchor]
        assert {f"../files/{file['name']}" for file in entry["files"]} <= set(download)


def test_the_command_that_a_page_shows_checks_the_point(site, pages):
    for name in (f"entry/{ENTRY}.html", f"entry/{INSTANCE}_quartic.html", "about.html"):
        (command,) = {text for tag, text in pages[name].texts if text.startswith("python3 check_point.py")}
        program, *arguments = command.split()
        assert program == "python3"
        done = subprocess.run(
            [sys.executable, *arguments], cwd=site / "files", capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stderr) == (0, "")


# pictures


def test_pictures_hold_the_strokes_and_the_singularities(library, site):
    for entry in library.entries:
        name = entry["instance"]["file"].removesuffix(".instance.json")
        instance = read_instance(library.folder / entry["instance"]["file"])
        field = read_field(library.folder / f"{name}.field.json")
        picture = ET.parse(site / "pictures" / f"{name}.svg").getroot()
        strokes = [element.get("d").count("M") for element in picture if element.get("stroke") == STROKE]
        assert sum(strokes) == len(instance.theta)
        drawn = ET.parse(site / "pictures" / f"{name}.field.svg").getroot()
        crosses = [element.get("d").count("M") for element in drawn if element.get("stroke") in FAMILIES]
        assert crosses == [instance.grid.size, instance.grid.size]
        index = field.singularities.index
        dots = {element.get("fill"): len(element) for element in drawn if element.tag.endswith("}g")}
        assert (dots.get(POSITIVE, 0), dots.get(NEGATIVE, 0)) == (sum(index > 0), sum(index < 0))
        assert count_singularities(field).startswith(f"{len(index) or 'no'} singularit")


# in a browser


@pytest.fixture(scope="module")
def address(site):
    """Address of the site on a plain web server."""
    with served(site) as address:
        yield address


def press(browser, *keys):
    from selenium.webdriver import ActionChains

    ActionChains(browser).send_keys(*keys).perform()


def choose(browser, name, option):
    """Choose by keyboard, because a headless browser cannot show the list."""
    script = (
        "const [name, value] = arguments, field = document.querySelector(`[name=${name}]`); "
        "field.value = value;"
    )
    browser.execute_script(
        f"{script} field.dispatchEvent(new Event('input', {{ bubbles: true }}))", name, option
    )
    assert find(browser, f"[name={name}]").get_attribute("value") == option


def shown_rows(browser):
    """Visible rows of the table: name and numeric columns."""
    script = """return [...document.querySelectorAll('#table tbody tr')].filter(row => row.offsetParent)
      .map(row => [row.cells[0].innerText, ...[...row.cells].slice(10, 16).map(cell => cell.dataset.v)])"""
    return browser.execute_script(script)


def head(browser, title):
    """The head of a column of the table."""
    (column,) = [
        cell for cell in browser.find_elements("css selector", "#table thead th") if cell.text == title
    ]
    return column


def test_no_page_complains_or_asks_anything_of_another_place(browser, address):
    for page in KINDS:
        browser.get(f"{address}/{page}")
        browser.execute_script(
            "document.querySelectorAll('img').forEach(each => each.loading = 'eager'); scrollTo(0, 1e6)"
        )
        assert browser.execute_script(
            "return [...document.images].every(each => each.complete ? each.naturalWidth : true)"
        )
    assert browser.get_log("browser") == []
    events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = {
        event["params"]["request"]["url"]
        for event in events
        if event["method"] == "Network.requestWillBeSent"
    }
    statuses = {
        event["params"]["response"]["status"]
        for event in events
        if event["method"] == "Network.responseReceived"
    }
    assert {
        f"{address}/{page}" for page in (*KINDS, "site.css", "site.js", f"pictures/{INSTANCE}.svg")
    } <= asked
    assert [url for url in asked if not url.startswith((f"{address}/", "data:", "about:"))] == []
    assert statuses <= {200, 304}
    assert browser.get_cookies() == []


def test_a_click_on_a_head_sorts_by_value_and_what_is_missing_comes_last(browser, address, library):
    browser.get(f"{address}/index.html")
    assert [row[0] for row in shown_rows(browser)] == [entry["name"] for entry in library.entries]
    for title, column in (("Nonzeros", 4), ("Best objective", 5), ("Best bound", 6)):
        for order in ("ascending", "descending"):
            find(head(browser, title), "button").click()
            assert head(browser, title).get_attribute("aria-sort") == order
            held = [row[column] for row in shown_rows(browser)]
            known = [float(cell) for cell in held if cell]
            assert known == sorted(known, reverse=order == "descending")
            assert all(not cell for cell in held[len(known) :])
    assert len(known) < len(held)
    others = [
        cell.get_attribute("aria-sort") for cell in browser.find_elements("css selector", "#table thead th")
    ]
    assert others.count("none") == len(others) - 1
    find(head(browser, "Name"), "button").click()
    names = [row[0] for row in shown_rows(browser)]
    assert (
        names.index("cf_mouse_n004_qp")
        < names.index("cf_mouse_n006_milp")
        < names.index("cf_rand_n004_s1_milp")
    )


@pytest.mark.slow
def test_everything_works_from_the_keyboard(browser, address):
    from selenium.webdriver import Keys

    browser.get(f"{address}/index.html")
    press(browser, Keys.TAB)
    focused = browser.switch_to.active_element
    assert focused.text == "Skip to the content"
    assert focused.rect["y"] >= 0
    press(browser, Keys.ENTER)
    assert browser.switch_to.active_element.get_attribute("id") == "main"
    names = []
    while "Variables" not in names:
        press(browser, Keys.TAB)
        focused = browser.switch_to.active_element
        style = "const s = getComputedStyle(arguments[0]); return s.outlineStyle + parseFloat(s.outlineWidth)"
        assert browser.execute_script(style, focused) == "solid3"
        names.append(focused.get_attribute("name") or focused.text)
        assert len(names) < 60
    assert {"q", "family", "status", "Clear", "Name"} <= set(names)
    press(browser, Keys.ENTER)
    assert head(browser, "Variables").get_attribute("aria-sort") == "ascending"
    press(browser, Keys.SPACE)
    assert head(browser, "Variables").get_attribute("aria-sort") == "descending"
    assert browser.switch_to.active_element.text == "Variables"
    browser.execute_script("document.querySelector('select[name=family]').focus()")
    press(browser, "rand")
    assert find(browser, "#told").text == "6 of 12 entries"
    browser.execute_script("document.querySelector('input[name=q]').focus()")
    press(browser, "MILP n006")
    assert [row[0] for row in shown_rows(browser)] == ["cf_rand_n006_s1_milp"]


@pytest.mark.slow
def test_filters_narrow_the_table_and_live_in_the_address(browser, address):
    from selenium.webdriver.support.wait import WebDriverWait

    browser.get(f"{address}/index.html")
    choose(browser, "class", "MILP")
    choose(browser, "rung", "small")
    assert {row[0] for row in shown_rows(browser)} == {"cf_mouse_n006_milp", "cf_rand_n006_s1_milp"}
    find(head(browser, "Name"), "button").click()
    find(head(browser, "Name"), "button").click()
    find(browser, "input[name=q]").send_keys("mouse & <b>")
    assert find(browser, "#told").text == "0 of 12 entries"
    find(browser, "input[name=q]").clear()
    find(browser, "input[name=q]").send_keys("MCC")
    state, before = browser.current_url, shown_rows(browser)
    assert urlsplit(state).fragment == "q=MCC&rung=small&class=MILP&sort=name&order=descending"
    assert [row[0] for row in before] == ["cf_rand_n006_s1_milp", "cf_mouse_n006_milp"]
    browser.get("about:blank")
    browser.get(state)
    assert shown_rows(browser) == before
    assert head(browser, "Name").get_attribute("aria-sort") == "descending"
    browser.execute_script("location.hash = 'family=nobody&status=optimal&sort=nothing&order=up'")
    # The browser tells the page of a new address when it likes, not before the next line.
    WebDriverWait(browser, 200).until(lambda _: find(browser, "#told").text == "8 of 12 entries")
    assert {row[0].rpartition("_")[2] for row in shown_rows(browser)} == {"qp", "quartic", "milp"}
    browser.execute_script("location.hash = 'gallery'")
    assert find(browser, "#told").text == "8 of 12 entries"
    find(browser, "button[type=reset]").click()
    assert find(browser, "#told").text == "12 of 12 entries"
    assert len(shown_rows(browser)) == 12
    browser.get("about:blank")
    browser.get(f"{address}/index.html#entries")
    assert find(browser, "#told").text == "12 of 12 entries"


def downloaded(browser, folder, button):
    """The files of the archive that a button offers, by name."""
    from selenium.webdriver.support.wait import WebDriverWait

    behaviour = {"behavior": "allow", "downloadPath": str(folder)}
    browser.execute_cdp_cmd("Browser.setDownloadBehavior", behaviour)
    find(browser, button).click()
    WebDriverWait(browser, 200).until(lambda _: list(folder.glob("*.zip")))
    (path,) = folder.glob("*.zip")
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        return path.name, {name: archive.read(name) for name in archive.namelist()}


def test_the_filtered_entries_are_downloaded_as_one_archive(browser, address, library, tmp_path):
    browser.get(f"{address}/index.html")
    choose(browser, "class", "MILP")
    choose(browser, "rung", "small")
    name, files = downloaded(browser, tmp_path, ".archive button")
    assert name == "2_entries.zip"
    wanted = set()
    for entry in ("cf_mouse_n006_milp", "cf_rand_n006_s1_milp"):
        sidecar = library.entry(entry)
        wanted |= {f"{entry}.json", sidecar["instance"]["file"], *(file["name"] for file in sidecar["files"])}
    assert files == {path: (library.folder / path).read_bytes() for path in wanted}


def test_it_works_from_a_folder_without_any_server(browser, site):
    browser.get((site / "index.html").as_uri())
    find(browser, "input[name=q]").send_keys("qp-fixed")
    find(head(browser, "Variables"), "button").click()
    held = [float(row[1]) for row in shown_rows(browser)]
    assert len(held) == 4
    assert held == sorted(held)
    assert browser.current_url.endswith("index.html#q=qp-fixed&sort=variables")
    find(browser, ".archive button").click()
    assert find(browser, ".archive [role=status]").text.endswith("or run: crossfield library get")
    find(browser, f"a[href='instance/{INSTANCE}.html']").click()
    assert find(browser, "h1").text == INSTANCE
    find(browser, f"a[href='../entry/{ENTRY}.html']").click()
    assert find(browser, "h1").text == ENTRY
    assert browser.get_log("browser") == []


@pytest.mark.parametrize("page", [*KINDS, f"entry/{INSTANCE}_quartic.html"])
def test_pages_fit_a_phone_and_can_be_read_in_both_modes(browser, address, page):
    for scheme in ("light", "dark"):
        show(browser, width=390, height=844, scheme=scheme)
        browser.get(f"{address}/{page}")
        assert sideways(browser) == ([390, 390], [])
        assert browser.execute_script(CONTRAST)[0][0] >= 4.5
