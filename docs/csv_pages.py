"""Sphinx extension: a link to a CSV file opens a page with its rows, and a link to the file."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING, Any

from docutils.nodes import document, reference
from sphinx.addnodes import download_reference

if TYPE_CHECKING:
    from sphinx.application import Sphinx


def link_pages(app: Sphinx, doctree: document, name: str) -> None:
    """Replace downloads of CSV files by links to their pages."""
    for node in list(doctree.findall(download_reference)):
        path, _ = app.env.relfn2path(node["reftarget"], name)
        if path.endswith(".csv"):
            link = reference(refuri=app.builder.get_relative_uri(name, path.removesuffix(".csv")))
            link.extend(node.children)
            node.replace_self(link)


def csv_pages(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    """Name, content and layout of the page of every linked CSV file."""
    for path, (pages, copy) in app.env.dlfiles.items():
        if path.suffix == ".csv":
            name = path.with_suffix("").as_posix()
            with (app.srcdir / path).open(newline="", encoding="utf-8") as file:
                head, *rows = csv.reader(file)
            download = f"{'../' * name.count('/')}_downloads/{copy}"
            links = [
                f'<a href="{app.builder.get_relative_uri(name, page)}">{app.env.titles[page].astext()}</a>'
                for page in sorted(pages)
            ]
            links.append(f'<a href="{download}" download>Download</a>')
            facts = f"<p>{len(rows)} rows. {' · '.join(links)}</p>"
            body = f"<h1>{path.name}</h1>{facts}{table(head, rows)}"
            yield name, {"title": path.name, "body": body}, "page.html"


def table(head: list[str], rows: list[list[str]]) -> str:
    """An HTML table, whose long names may break at each underscore."""
    lines = ["".join(f"<td>{escape(cell).replace('_', '_<wbr>')}</td>" for cell in row) for row in rows]
    heads = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    return (
        f'<div class="table-wrapper"><table class="docutils"><thead><tr>{heads}</tr></thead><tbody>'
        f"<tr>{'</tr><tr>'.join(lines)}</tr></tbody></table></div>"
    )


def setup(app: Sphinx) -> None:
    """Show CSV files in the builders that write HTML."""
    app.connect("doctree-resolved", link_pages)
    app.connect("html-collect-pages", csv_pages)
