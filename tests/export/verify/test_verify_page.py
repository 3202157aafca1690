"""The page of a verification: its matrix, its faults, and how a browser shows it."""

from __future__ import annotations

import re

import pytest
from browsing import CONTRAST, served, show, sideways
from cases import make_instance
from crossfield.export.bundle.manifest import write_all
from crossfield.export.verify.verify import verify


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    write_all(make_instance(), folder, formulations=["milp-mccormick", "qp-fixed"], formats=["mps", "lp"])
    return folder


def test_the_matrix_has_every_file_and_the_same_objectives_as_the_document(folder):
    found = verify(folder, seconds=5.0, programs=["highs"])
    page = (folder / "verify.html").read_text(encoding="utf-8")
    assert found.ok
    assert "all files agree" in page
    rows = re.findall(r'<tr><th scope="row">(.*?)</th><td.*?>(.*?)</td></tr>', page)
    read = [check.file for check in found.checks if check.step == "read"]
    solved = [check for check in found.checks if check.step == "solve"]
    assert [name for name, _ in rows] == read + [check.file for check in solved]
    assert len(solved) == 2
    assert all(f"{check.objective:.7g}" in page for check in solved)
    assert re.findall(r'(?:src|href)="(?:https?:)?//', page) == []


def test_a_changed_file_and_an_absent_program_are_named(folder, tmp_path, monkeypatch):
    for path in folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (changed,) = tmp_path.glob("*.qp-fixed.lp")
    changed.write_bytes(changed.read_bytes() + b"\n")
    monkeypatch.setenv("PATH", "")
    found = verify(tmp_path, programs=["highs", "glpk"])
    page = (tmp_path / "verify.html").read_text(encoding="utf-8")
    assert not found.ok
    assert "faults: 1<" in page
    assert re.search(rf'class="warning"><b>{re.escape(changed.name)}</b>.*manifest describes', page)
    assert "GLPK is not installed" in page


@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_and_can_be_read(browser, folder, width, scheme):
    verify(folder, seconds=2.0, programs=["highs", "casadi"])
    show(browser, width=width, scheme=scheme)
    with served(folder) as address:
        browser.get(f"{address}/verify.html")
        browser.execute_script("document.querySelectorAll('details').forEach(each => each.open = true)")
        (window, page), beyond = sideways(browser)
        assert page <= window == width
        assert beyond == []
        assert browser.execute_script(CONTRAST)[0][0] >= 4.5
