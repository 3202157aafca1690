"""Elements of SVG drawings: their tags, names and lengths."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final
from xml.etree.ElementTree import Element

from .path_data import length_in_pixels

SVG: Final = "{http://www.w3.org/2000/svg}"
HREFS: Final = ("href", "{http://www.w3.org/1999/xlink}href")
GROUP: Final = ("id", "style", "transform")
"""Attributes of an element that its group keeps."""


def length_of(text: str, default: float, whole: float | None = None) -> float:
    """A length in CSS pixels, a percentage of `whole`; `default` when it is missing or unreadable."""
    if text.endswith("%") and whole is not None:
        return whole * number_of(text) / 100
    pixels = length_in_pixels(text)
    return default if pixels is None else pixels


def number_of(text: str | None) -> float:
    """The number at the start of a style value; 1 without one."""
    match = re.match(r"[+-]?(?:\d+\.?\d*|\.\d+)", text or "")
    return float(match[0]) if match else 1.0


def tag_of(element: Element) -> str:
    """The tag of an SVG element without its namespace; empty for elements of other languages."""
    return element.tag.removeprefix(SVG) if element.tag.startswith(SVG) else ""


def name_of(element: Element) -> str:
    """An element as a message names it."""
    name = element.get("id")
    return f"<{tag_of(element)}" + (f' id="{name[:40]}">' if name else ">")


def chosen_attributes(element: Element, names: Sequence[str]) -> dict[str, str]:
    """The attributes with these names that an element has."""
    return {name: element.attrib[name] for name in names if name in element.attrib}
