"""Representations of objects in notebooks: a picture, or a table as HTML.

This module does not draw. The top-level package finds the drawing function when a notebook requests it.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from html import escape
from importlib import import_module
from typing import Final

_FACE: Final = __name__.removesuffix(".models.previews")


class Pictured:
    """An object that notebooks show as a picture."""

    def _repr_png_(self) -> bytes:
        """The picture, PNG."""
        picture: bytes = import_module(_FACE).preview(self)
        return picture


def table_of(title: str, facts: Mapping[str, object], picture: bytes | None = None) -> str:
    """An HTML table of facts below a title, with a picture (PNG) at its side; it loads no other files."""
    rows = "".join(
        f'<tr><th style="text-align:left">{escape(name)}</th>'
        f'<td style="text-align:left">{escape(str(value))}</td></tr>'
        for name, value in facts.items()
    )
    table = f"<table><caption>{escape(title)}</caption><tbody>{rows}</tbody></table>"
    if picture is None:
        return table
    image = f'<img alt="" src="data:image/png;base64,{b64encode(picture).decode()}"/>'
    return f'<div style="display:flex;gap:1em;align-items:center">{table}{image}</div>'
