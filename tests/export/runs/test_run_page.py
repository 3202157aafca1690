"""The page of a run in a real browser: what it shows, its layers, and its width, contrast and links."""

from __future__ import annotations

import re
import shlex
from functools import partial

import crossfield as cf
import pytest
from browsing import CONTRAST, find, served, show, sideways
from crossfield.export.bundle.problem_files import write_all
from crossfield.export.cli.app import invoke
from crossfield.export.formats.registry import DEFAULTS, FORMATS, Format
from crossfield.export.runs import run

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    cf.run(cf.sample("mouse", 10), folder, limits=cf.Limits(0.5), drawing="mouse")
    return folder


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
    links = re.findall(r'href="([^"]+)"', page)
    assert len(links) > 34
    assert [link for link in links if not (folder / link).exists()] == []
    assert re.findall(r'(?:src|href)="(?:https?:)?//', page) == []


def test_the_line_that_reads_an_answer_back_reads_it(folder, monkeypatch):
    instance = cf.read_instance(next((folder / "models").glob("*.instance.json")))
    problem = cf.formulate(instance, "milp-mccormick")
    stem = f"{instance.name}.milp-mccormick"
    page = (folder / "index.html").read_text(encoding="utf-8")
    (line,) = re.findall(rf"^crossfield read {stem}\.mps\.sol .*$", page, re.MULTILINE)
    point = problem.point(cf.greedy_field(instance))
    names = problem.to_arrays().column_names
    text = "\n".join(f"{name} {value!r}" for name, value in zip(names, point.tolist(), strict=True))
    (folder / f"{stem}.mps.sol").write_text(f"{text}\n")
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


def test_a_new_default_format_needs_no_other_edit(tmp_path, monkeypatch):
    """Its entry in the table is enough; without a command in it, the page has the line that reads."""
    monkeypatch.setitem(FORMATS, "ninth", Format("ninth", "LP by another name", 2, "lp"))
    monkeypatch.setattr(run, "write_all", partial(write_all, formats=(*DEFAULTS, "ninth")))
    cf.run(cf.sample("mouse", 4), tmp_path, limits=cf.Limits(0.1))
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "mouse.milp-mccormick.ninth" in page
    assert re.search(r"<pre[^>]*>crossfield read mouse.milp-mccormick.sol --manifest models/", page)


def test_a_doubted_surface_and_warnings_are_explained(tmp_path):
    square = '<path stroke="black" d="M5 47V5H95V95H5V54"/><path stroke="black" d="M120 5V95"/>'
    lines = "".join(
        f'<path stroke="red" d="M{x} 10V90"/><path stroke="red" d="M10 {x}H90"/>' for x in (30, 60)
    )
    drawing = tmp_path / "flat.svg"
    drawing.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="130" height="100" fill="none">{square}{lines}</svg>'
    )
    report = cf.run(
        cf.read_sketch(drawing, size=40), tmp_path / "out", limits=cf.Limits(0.3), drawing=drawing
    )
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert report.surface.doubts
    assert report.instance.reading.warnings
    for sentence in (*report.surface.doubts, *report.instance.reading.warnings):
        assert sentence in page
