"""The page of a library, index.html: on disk, and in a browser."""

import json
import re
from dataclasses import replace
from urllib.parse import unquote

import pytest
from browsing import check_legibility, find, served, show
from libraries import build, library_of, spec_of

RAND = """[[sketches]]
name = "rand"
random = "ragged"
seeds = [1]
points = "greedy"
"""
SPEC = f"""formulations = ["minlp-quartic", "milp-mccormick", "qp-fixed"]

[rungs.tiny]
sizes = [4]
formats = ["nl", "mps"]

[rungs.small]
sizes = [6]
formats = ["mps"]
compress = true

[[sketches]]
name = "mouse"
sample = "mouse"
points = "greedy"
{RAND}"""


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return library_of(tmp_path_factory.mktemp("library"), SPEC)


@pytest.fixture(scope="module")
def address(library):
    """Address of the library on a plain web server."""
    with served(library.folder) as address:
        yield f"{address}/index.html"


# the file


def test_every_file_of_an_entry_is_linked_and_every_link_is_a_file(library):
    page = (library.folder / "index.html").read_text()
    linked = {unquote(target) for target in re.findall(r'(?:href|src)="([^"]*)"', page)}
    assert {name for name in linked if not (library.folder / name).is_file()} == set()
    for entry in library.entries:
        files = {file["name"] for file in entry["files"]}
        assert linked >= {f"{entry['name']}.json", entry["instance"]["file"], *files}
    assert "index.html" in (library.folder / "SHA256SUMS").read_text()


def test_texts_of_a_specification_are_escaped(tmp_path):
    hostile = "<script>alert(1)</script> & <img src=x>"
    wanted = spec_of(tmp_path, SPEC.partition("[[")[0] + RAND.replace("seeds", f'title = "{hostile}"\nseeds'))
    page = (build(replace(wanted, title=hostile), tmp_path / "lib").folder / "index.html").read_text()
    assert page.count("<script>") == 1
    assert "<img src=x>" not in page
    assert "&lt;script&gt;" in page


# in a browser


def shown_rows(browser):
    """Texts and values of the cells of visible rows."""
    script = """return [...document.querySelectorAll('tbody tr')].filter(row => row.offsetParent)
      .map(row => [...row.cells].map(cell => cell.dataset.v ?? cell.innerText))"""
    return browser.execute_script(script)


def head(browser, title):
    """Number and head of a column of the table."""
    titles = browser.find_elements("css selector", "thead th")
    (column,) = [number for number, cell in enumerate(titles) if cell.text.startswith(title)]
    return column, titles[column]


def choose(browser, column, option):
    """Choose from a list, which a headless browser cannot show."""
    field = find(browser, f"select[data-column='{column}']")
    script = (
        "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input', { bubbles: true }))"
    )
    browser.execute_script(script, field, option)
    assert field.get_attribute("value") == option


@pytest.mark.slow
def test_the_page_is_whole_without_any_other_place(browser, address):
    browser.get(address)
    browser.execute_script(
        "document.querySelectorAll('img').forEach(each => each.loading = 'eager'); scrollTo(0, 1e6)"
    )
    assert browser.execute_script(
        "return [...document.images].every(each => each.complete ? each.naturalWidth : true)"
    )
    assert [entry for entry in browser.get_log("browser") if "favicon" not in entry["message"]] == []
    events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = {
        event["params"]["request"]["url"]
        for event in events
        if event["method"] == "Network.requestWillBeSent"
    }
    origin = address.removesuffix("index.html")
    assert {f"{origin}cf_{family}.field.svg" for family in ("mouse", "rand")} <= asked
    assert [url for url in asked if not url.startswith((origin, "data:", "about:"))] == []


@pytest.mark.slow
def test_a_head_sorts_by_value_both_ways_and_what_is_missing_comes_last(browser, address, library):
    browser.get(address)
    assert [row[0] for row in shown_rows(browser)] == [entry["name"] for entry in library.entries]
    for title in ("Variables", "Best objective", "Best bound"):
        for order in ("ascending", "descending"):
            column, cell = head(browser, title)
            find(cell, "button").click()
            assert cell.get_attribute("aria-sort") == order
            held = [row[column] for row in shown_rows(browser)]
            known = [float(value) for value in held if value]
            assert known == sorted(known, reverse=order == "descending")
            assert all(not value for value in held[len(known) :])
    assert len(known) < len(held)
    find(head(browser, "Name")[1], "button").click()
    names = [row[0] for row in shown_rows(browser)]
    order = ("cf_mouse_n004_qp", "cf_mouse_n006_milp", "cf_rand_n004_s1_milp")
    assert sorted(map(names.index, order)) == [*map(names.index, order)]


@pytest.mark.slow
def test_filters_narrow_the_table_together_and_can_be_cleared(browser, library):
    """From a folder, without a server."""
    from selenium.webdriver import Keys

    browser.get((library.folder / "index.html").as_uri())
    assert find(browser, "output").text == "12 of 12 entries"
    choose(browser, 7, "MILP")
    choose(browser, 4, "small")
    assert {row[0] for row in shown_rows(browser)} == {"cf_mouse_n006_milp", "cf_rand_n006_s1_milp"}
    search = find(browser, "input[name=q]")
    search.send_keys("RAND mcc")
    assert [row[0] for row in shown_rows(browser)] == ["cf_rand_n006_s1_milp"]
    search.send_keys(" & <b>")
    assert find(browser, "output").text == "0 of 12 entries"
    find(browser, "form button").send_keys(Keys.ENTER)
    assert len(shown_rows(browser)) == 12


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 1280])
def test_it_fits_the_window_and_can_be_read_in_both_modes(browser, address, width):
    for scheme in ("light", "dark"):
        show(browser, width=width, height=844, scheme=scheme)
        browser.get(address)
        check_legibility(browser, width)
