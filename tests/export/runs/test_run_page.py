"""The page of a run in a real browser: what it shows, its layers, and its width, contrast and links."""

from __future__ import annotations

import json
import re
import shlex
from html import unescape

import crossfield as cf
import pytest
from browsing import CONTRAST, find, served, show, sideways
from cases import write_point
from command_line import invoke

pytestmark = pytest.mark.slow


@pytest.fixture
def folder(two_parts):
    return two_parts[0]


@pytest.fixture
def address(folder):
    with served(folder) as site:
        yield f"{site}/index.html"


def displayed(browser, layer):
    return browser.execute_script(f"return getComputedStyle(document.getElementById('{layer}')).display")


def test_layers_are_switched(browser, address):
    browser.get(address)
    assert (displayed(browser, "crosses"), displayed(browser, "streamlines-u")) == ("none", "inline")
    find(browser, "#show-crosses").click()
    find(browser, "#show-streamlines-u").click()
    assert (displayed(browser, "crosses"), displayed(browser, "streamlines-u")) == ("inline", "none")


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_and_can_be_read(browser, address, width, scheme):
    show(browser, width=width, scheme=scheme)
    browser.get(address)
    browser.execute_script("document.querySelectorAll('details').forEach(each => each.open = true)")
    (window, page), beyond = sideways(browser)
    assert page <= window == width
    assert beyond == []
    assert browser.execute_script(CONTRAST)[0][0] >= 4.5


def test_links_lead_to_files_and_nothing_comes_from_elsewhere(folder):
    page = (folder / "index.html").read_text(encoding="utf-8")
    links = re.findall(r'href="((?!data:)[^"]+)"', page)
    assert len(links) > 34
    assert [link for link in links if not (folder / link).exists()] == []
    assert re.findall(r'(?:src|href)="(?:https?:)?//', page) == []
    report = json.loads((folder / "report.json").read_text())
    assert all(doubt in unescape(page) for doubt in report["surface"]["doubts"])


def test_the_line_that_reads_an_answer_back_reads_it(folder, monkeypatch):
    instance = cf.read_instance(next((folder / "models").glob("*.instance.json")))
    problem = cf.formulate(instance, "milp-mccormick")
    stem = f"{instance.name}.milp-mccormick"
    page = (folder / "index.html").read_text(encoding="utf-8")
    (line,) = re.findall(rf"^crossfield read {stem}\.mps\.sol .*$", page, re.MULTILINE)
    write_point(folder / f"{stem}.mps.sol", problem, problem.point(cf.greedy_field(instance)))
    monkeypatch.chdir(folder)
    assert invoke(shlex.split(line.removesuffix("</pre>"))[1:]) == 0
    assert (folder / f"{stem}.npz").exists()


def test_the_first_line_works_with_what_a_plain_installation_has(folder, monkeypatch):
    page = (folder / "index.html").read_text(encoding="utf-8")
    first, *_ = re.findall(r"<pre[^>]*>([^<]*)", page)
    monkeypatch.chdir(folder)
    program, *arguments = shlex.split(first)
    assert program == "crossfield"
    assert invoke([*arguments, "--time-limit", "2"]) == 0
    assert list((folder / arguments[-1]).glob("*.field.npz"))
