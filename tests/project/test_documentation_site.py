"""The documentation site is built without a warning, and works in a browser without a network."""

from __future__ import annotations

import csv
import re
import subprocess
import sys

import places
import pytest
from browsing import served, show, sideways
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.choice import declare
from crossfield.models.formulations.symbols import p1

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("sphinx", reason="sphinx is not installed: pip install '.[docs]'")
    folder = tmp_path_factory.mktemp("documentation")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "-d", str(folder / "doctrees")]
    subprocess.run([*command, str(places.ROOT / "docs"), str(folder / "site")], check=True)
    return folder / "site"


def test_no_page_loads_anything_from_elsewhere(site):
    loaded = re.compile(r"<(?:script|img|iframe|link rel=\"stylesheet\")[^>]*(?:src|href)=\"(?:https?:)?//")
    pages = list(site.rglob("*.html"))
    assert pages
    assert [page.name for page in pages if loaded.search(page.read_text(encoding="utf-8"))] == []


def test_every_command_and_its_options_are_listed(site):
    page = (site / "reference" / "commands.html").read_text(encoding="utf-8")
    shown = subprocess.check_output([sys.executable, "-m", "crossfield", "prove", "--help"], text=True)
    options = set(re.findall(r"(--[a-z-]+)", shown)) - {"--help"}
    section = page.partition('id="crossfield-prove"')[2].partition("<section")[0]
    assert {option for option in options if option not in section} == set()
    assert "crossfield library verify" in page
    assert not re.search(r"\{[a-z ]+\}", re.sub(r"<(style|script).*?</\1>", "", page, flags=re.DOTALL))


@pytest.fixture
def address(site):
    with served(site) as served_at:
        yield served_at


FORMULAS = """
const inside = math => {
  const box = math.getBoundingClientRect();
  for (let frame = math.parentElement; frame; frame = frame.parentElement) {
    const { left, right } = frame.getBoundingClientRect();
    if (frame.matches('.table-wrapper')) return true;  // a wide table scrolls
    if (getComputedStyle(frame).overflowX !== 'visible' && (box.left < left - 1 || box.right > right + 1))
      return false;
  }
  return box.left >= 0 && box.right <= innerWidth + 1;
};
return [...document.querySelectorAll('math')].map(math =>
  [math.textContent, math.getBoundingClientRect().height > 4 && math.checkVisibility(), inside(math)]);
"""
"""Text of every formula, whether it is visible, and whether no edge of the page or of a frame cuts it."""


@pytest.mark.parametrize("width", [1280, 390])
def test_formulas_are_whole_and_inside_the_page(browser, address, site, width):
    show(browser, width=width)
    pages = [page for page in sorted(site.rglob("*.html")) if "<math" in page.read_text(encoding="utf-8")]
    assert pages
    for page in pages:
        browser.get(f"{address}/{page.relative_to(site)}")
        formulas = browser.execute_script(FORMULAS)
        assert formulas, page
        assert [text for text, *_ in formulas if re.search(r"[&\\\\]", text)] == [], page
        assert [each for each in formulas if each[1:] != [True, True]] == [], page


def test_a_model_has_every_term_and_equation_of_its_declaration(browser, address, docs_module):
    squared, expanded = docs_module("make").SQUARED, docs_module("make").EXPANDED
    browser.get(f"{address}/formulations.html")
    shown = browser.execute_script(
        "return [...document.querySelectorAll('.model')].map(model =>"
        " [model.querySelector('.formula').textContent,"
        "  [...model.querySelectorAll('tbody .equation')].map(cell => cell.textContent)])"
    )
    names = [name for name in FORMULATIONS if name not in {**squared, **expanded}]
    for name, (minimised, equations) in zip(names, shown, strict=True):
        declared = declare(name)
        assert len(re.findall(r"∑|\+strokes|\+skew", minimised)) == len(declared.objective), name
        assert {row.paper for row in declared.rows if row.paper not in ", ".join(equations)} == set(), name
    for name, other in squared.items():
        both = declare(name), declare(other, stroke_norm=2, beta_norm=2)
        expressions = [[family.expression for family in (*one.objective, *one.rows)] for one in both]
        assert expressions[0] == expressions[1], name
    for name, other in expanded.items():
        (smooth, *_), (found, *_) = declare(other).objective, declare(name).objective
        assert found.expression == smooth.expression.expanded(p1), name


def test_a_link_to_a_csv_file_opens_a_page_with_its_rows(browser, address):
    browser.get(f"{address}/files.html")
    browser.execute_script("""document.querySelector("a[href$='files/keys.html']").click()""")
    with (places.ROOT / "docs" / "files" / "keys.csv").open(newline="", encoding="utf-8") as file:
        _, *rows = csv.reader(file)
    cells = "[...document.querySelectorAll('tbody tr')].map(tr => [...tr.cells].map(td => td.textContent))"
    assert browser.execute_script(f"return {cells}") == rows


@pytest.mark.parametrize("page", ["index", "guides/solvers", "reference/api", "gallery", "notebooks/mesh"])
def test_a_phone_shows_a_page_without_scrolling_sideways(browser, address, page):
    show(browser, width=390, height=844)
    browser.get(f"{address}/{page}.html")
    assert sideways(browser)[0] == [390, 390]
