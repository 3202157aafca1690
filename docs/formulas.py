"""Formulas of the pages as MathML in pieces, so that long ones wrap on a narrow page."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Final

from crossfield.templates import ENVIRONMENT
from defusedxml.ElementTree import fromstring
from latex2mathml.converter import convert

_LABEL: Final = re.compile(r" \\quad \\text\{(.*)\}$")
_NAMESPACE: Final = ' xmlns="http://www.w3.org/1998/Math/MathML"'
_BREAKING: Final = frozenset("+−=≠<>≤≥∈")
"""Operators before which a line may break."""
_BRACKETS: Final = {"(": 1, "[": 1, "{": 1, ")": -1, "]": -1, "}": -1}
_SCRIPTED: Final = frozenset({"msub", "msup", "msubsup"})
_WIDE: Final = 2.0
"""Width in em of the space that separates formulas on one line."""


def model_table(name: str, source: str) -> str:
    """Return a model as a table in HTML. source: LaTeX in an environment `aligned`."""
    template = Path(__file__).with_name("model.html.j2").read_text(encoding="utf-8")
    return ENVIRONMENT.from_string(template).render(name=name, lines=lines_of(source))


@cache
def lines_of(source: str) -> tuple[dict[str, str], ...]:
    """Return the lines of a model as role, formula, set and equation of the paper.

    role: `minimise`, `subject to`, or empty as on the line before. Formula and set are MathML made from our
    declarations alone.
    """
    last, lines = "", []
    for row in source.strip().split("\n")[1:-1]:  # lead & formula && set, label; a term has no set
        _, formula, *rest = (part.strip() for part in row.removesuffix(r" \\").split("&", maxsplit=2))
        over = rest[0].removeprefix("&").strip() if rest else ""
        label = _LABEL.search(over)
        role = "subject to" if rest else "minimise"
        domains = formula.split(r" \qquad ")
        text = " ".join(mathml(domain, whole=True) for domain in domains) if domains[1:] else mathml(formula)
        line = {"role": "" if role == last else role, "formula": text}
        lines.append(line | {"over": mathml(_LABEL.sub("", over)), "label": label[1] if label else ""})
        last = role
    return tuple(lines)


def mathml(formula: str, *, whole: bool = False) -> str:
    """Return trusted LaTeX as MathML in display style; unless `whole`, in pieces where a line may break.

    Browsers break no line inside an element `math`. Environments such as `aligned` are not supported:
    `lines_of` splits them.
    """
    if not formula:
        return ""
    root = fromstring(convert(formula, display="block").replace(_NAMESPACE, ""))
    for bar in (operator for operator in root.iter("mo") if operator.text == "|"):
        # A bracket, which browsers take for a relation, and lower where it alone has an exponent.
        bar.attrib = {"stretchy": "false", **bar.attrib, "lspace": "0", "rspace": "0"}
    pieces: list[str] = []
    for children in [list(root[0])] if whole else _pieces(list(root[0])):
        math = ET.Element("math", {"xmlns": "http://www.w3.org/1998/Math/MathML", "displaystyle": "true"})
        if pieces and children[0].text in _BREAKING:
            children[0].set("form", "infix")  # at the beginning of an element it would be a sign
        ET.SubElement(math, "mrow").extend(children)
        pieces.append(ET.tostring(math, encoding="unicode"))
    return "<wbr/>".join(pieces)


def _pieces(children: list[ET.Element]) -> Iterator[list[ET.Element]]:
    """Split a row before its operators, except signs and those in brackets of the height of text."""
    begin = depth = 0
    for place, (before, child) in enumerate(pairwise(children), start=1):
        last = before[0] if before.tag in _SCRIPTED else before
        bracket = _BRACKETS.get(last.text or "", 0) if last.tag == "mo" else 0
        depth += 0 if "minsize" in last.attrib else bracket
        is_sign = before.tag == "mo" and bracket >= 0
        breaks = child.tag == "mo" and child.text in _BREAKING and not is_sign
        ends = before.tag == "mspace" and float(before.get("width", "0em").removesuffix("em")) >= _WIDE
        if depth == 0 and (breaks or ends):
            yield children[begin:place]
            begin = place
    yield children[begin:]
