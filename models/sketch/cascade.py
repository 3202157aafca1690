"""Styles of SVG elements: what their attributes, the style sheets and their `style` declare together.

cssselect2 matches selectors, tinycss2 parses, and `colour.py` reads colours. A declaration that cannot be
read does not count, so an earlier one stays valid, as in browsers. The work is bounded by the limits of
`input_limits`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import groupby
from typing import Any, Final
from xml.etree.ElementTree import Element

import numpy as np

from ..errors import InputError, shortened
from ..input_limits import MAX_LENGTH, MAX_RULE_CHECKS, MAX_STYLE
from .colour import hex_colour

ATTRIBUTES: Final = frozenset(
    {"stroke", "fill", "color", "stop-color", "visibility", "display", "opacity", "stroke-width",
     "stroke-opacity", "fill-opacity", "stop-opacity", "fill-rule", "vector-effect", "transform-origin",
     "clip-path", "mask"}
)  # fmt: skip
"""Attributes of SVG elements that style sheets can override."""
_COLOURS: Final = frozenset({"stroke", "fill", "color", "stop-color"})
_KEYWORDS: Final = frozenset({"none", "currentcolor", "inherit", "context-fill", "context-stroke"})
_INITIAL: Final = {"stroke": "none"}  # black for the others
UNSHOWN: Final = re.compile(r"filter|marker|stroke-dash|mix-blend|isolation|font|animation|transition|-")
"""Beginnings of properties that the pictures of a drawing do without."""
_STYLING: Final = ("import", "container", "scope")
"""Rules of style sheets that may style elements, and are not read."""
_LIGHT: Final = re.compile(r"light-dark\(\s*((?:[^(),]|\([^()]*\))*),.*\)", re.DOTALL)
_VARIABLE: Final = re.compile(r"var\(\s*(--[\w-]+)\s*(?:,\s*((?:[^()]|\([^()]*\))*))?\)")
_DEEPEST: Final = 10  # variables inside of variables, and rules inside of rules

_Declared = tuple[str, str, bool]
"""Name, value, and whether it is important."""


@dataclass(eq=False)
class Cascade:
    """The rules of a drawing.

    matcher: of selectors, with the declarations of each, and how often it tries all ancestors and all
    siblings. unread: an element and its colour, for each colour that cannot be read. skipped: rules that are
    not read.
    """

    matcher: Any
    unread: dict[Element, str] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)
    checks: int = 0
    length: int = 0

    def declare(self, root: Element) -> dict[Element, dict[str, str]]:
        """The style of every element under a root, without what it inherits. Raises InputError."""
        import cssselect2

        styles: dict[Element, dict[str, str]] = {}
        variables: dict[Element, Mapping[str, str]] = {}
        for wrapper in cssselect2.ElementWrapper.from_xml_root(root).iter_subtree():
            element, parent = wrapper.etree_element, wrapper.parent
            inherited = variables[parent.etree_element] if parent is not None else {}
            declared = list(self._declarations(wrapper))
            own = {name: value for name, value, _ in declared if name.startswith("--")}
            variables[element] = {**inherited, **own} if own else inherited
            styles[element] = self._valid_style(element, declared, variables[element])
        return styles

    def _declarations(self, wrapper: Any) -> Iterator[_Declared]:
        """All declarations for an element, the ones that count most last."""
        element = wrapper.etree_element
        yield from ((key, element.attrib[key], False) for key in sorted(ATTRIBUTES & element.attrib.keys()))
        declared: list[_Declared] = []
        if self.matcher.order:
            self._count(wrapper)
            for *_, pseudo, (declarations, _) in self.matcher.match(wrapper):
                declared += declarations if pseudo is None else ()
        declared += style_declarations(element.get("style", ""))
        yield from sorted(declared, key=lambda declaration: declaration[2])

    def _count(self, wrapper: Any) -> None:
        """Count the comparisons for an element. Raises InputError beyond MAX_RULE_CHECKS."""
        ancestors, siblings = 1 + sum(1 for _ in wrapper.ancestors), 1 + wrapper.index
        matcher = self.matcher
        entries = [
            *matcher.other_selectors,
            *matcher.lower_local_name_selectors.get(wrapper.local_name.lower(), ()),
            *(entry for name in wrapper.classes for entry in matcher.class_selectors.get(name, ())),
            *matcher.id_selectors.get(wrapper.id, ()),
        ]
        self.checks += sum(ancestors**up * siblings**along for *_, (_, (up, along)) in entries)
        if self.checks > MAX_RULE_CHECKS:
            raise InputError(
                f"its style sheets take more than {MAX_RULE_CHECKS} comparisons; export it without"
            )

    def count_characters(self, length: int) -> None:
        """Count characters of rules, nested ones in full. Raises InputError beyond MAX_STYLE."""
        self.length += length
        if self.length > MAX_STYLE:
            raise InputError(f"its style sheets have more than {MAX_STYLE} characters; export it without")

    def _valid_style(
        self, element: Element, declared: Iterable[_Declared], variables: Mapping[str, str]
    ) -> dict[str, str]:
        """The values that can be read, colours as #rrggbb or #rrggbbaa."""
        style: dict[str, str] = {}
        for name, text, _ in declared:
            if UNSHOWN.match(name):
                continue
            value = _replace_variables(text, variables) if "var(" in text else text.strip()
            paint = _paint_value(name, value) if name in _COLOURS else value
            if paint is None:
                self.unread[element] = text
            else:
                style[name] = paint
        return style


def cascade_of(texts: Iterable[str]) -> Cascade:
    """The rules of style sheets, in order. Raises InputError beyond MAX_STYLE characters."""
    import cssselect2
    import tinycss2

    cascade = Cascade(cssselect2.Matcher())
    for text in texts:
        cascade.count_characters(len(text))
        try:
            rules = tinycss2.parse_stylesheet(text, skip_comments=True, skip_whitespace=True)
        except ValueError:  # a whole number of thousands of digits
            continue
        _add_rules(cascade, rules)
    return cascade


def _add_rules(cascade: Cascade, rules: list[Any], around: str = "", depth: int = 0) -> None:
    """Add rules, which may be nested in that of a selector. Layers count in the order of the sheet."""
    import tinycss2

    if rules and depth > _DEEPEST:
        cascade.skipped.append("rules nested too deep")
        return
    for rule in rules:
        kind = rule.lower_at_keyword if rule.type == "at-rule" else ""
        if rule.type == "qualified-rule":
            text = _text(rule.prelude)
            if around:
                cascade.count_characters(len(text) + max(text.count("&"), 1) * len(around))
                text = text.replace("&", f":is({around})") if "&" in text else f":is({around}) {text}"
            if declared := _declared(rule.content):
                _add_selector(cascade, text, declared)
            inner = tinycss2.parse_blocks_contents(rule.content, skip_comments=True, skip_whitespace=True)
            _add_rules(cascade, [part for part in inner if part.type.endswith("-rule")], text, depth + 1)
        elif kind in ("layer", "supports") or (
            kind == "media" and _text(rule.prelude).lower() in ("", "all", "screen")
        ):
            content = rule.content or []
            if around:
                content = f"{around}{{{_text(content)}}}"
                cascade.count_characters(len(content))
            inner = tinycss2.parse_rule_list(content, skip_comments=True, skip_whitespace=True)
            _add_rules(cascade, inner, depth=depth + 1)
        elif kind in _STYLING:
            cascade.skipped.append(shortened(f"@{kind} {_text(rule.prelude)}".strip(), 40))


def _add_selector(cascade: Cascade, text: str, declared: tuple[_Declared, ...]) -> None:
    """Add a rule that matches a list of selectors; one that cannot be read is recorded."""
    import cssselect2
    import tinycss2

    prelude = tinycss2.parse_component_value_list(text)
    try:
        # :has() tries all elements inside, and rules may be nested too deep.
        is_hard = ":has(" in text or (text.count(":is(") > _DEEPEST)
        selectors = [] if is_hard else cssselect2.compile_selector_list(prelude)
    except (cssselect2.SelectorError, RecursionError, MemoryError, SyntaxError):
        selectors = []
    if not selectors:
        cascade.skipped.append(shortened(text, 40))
        return
    # A comma in parentheses is part of a selector, whose combinators multiply.
    lists = groupby(prelude, lambda part: part == ",")
    parts = [_combinators(_text(list(part))) for is_comma, part in lists if not is_comma]
    bounds = np.max(parts, axis=0).tolist()
    for selector in selectors:
        cascade.matcher.add_selector(selector, (declared, bounds))


def _combinators(selector: str) -> tuple[int, int]:
    """Bounds on how often a selector tries all ancestors, and all siblings, of an element."""
    signs = re.findall(r"\s*([>+~])\s*|\s+", selector.strip())
    return signs.count(""), signs.count("~")


@lru_cache(maxsize=1024)
def style_declarations(text: str) -> tuple[_Declared, ...]:
    """The declarations in a `style` attribute."""
    try:
        return _declared(text) if text else ()
    except ValueError:  # a whole number of thousands of digits
        return ()


def _declared(content: Any) -> tuple[_Declared, ...]:
    """The declarations in a text or in the tokens of a rule."""
    import tinycss2

    return tuple(
        (name if (name := declaration.name).startswith("--") else declaration.lower_name,
         _text(declaration.value), declaration.important)
        for declaration in tinycss2.parse_blocks_contents(content, skip_comments=True, skip_whitespace=True)
        if declaration.type == "declaration"
        and (declaration.name.startswith("--") or ":" not in declaration.value)  # else without a semicolon
    )  # fmt: skip


def _text(tokens: list[Any]) -> str:
    import tinycss2

    try:
        return str(tinycss2.serialize(tokens)).strip()
    except RecursionError:
        return ""


def _replace_variables(text: str, variables: Mapping[str, str]) -> str:
    """The text with the values of its variables; empty where one has no value."""
    for _ in range(_DEEPEST):
        if len(text) > MAX_LENGTH or "var(" not in text:
            break
        text = _VARIABLE.sub(lambda use: variables.get(use[1], use[2] or ""), text)
    return text.strip()


def background_of(style: Mapping[str, str]) -> str | None:
    """The colour of the background that a style declares, as #rrggbb; None without an opaque one."""
    colours = (_paint_value("color", style.get(key, "")) for key in ("background-color", "background"))
    return next((colour for colour in colours if colour and len(colour) == 7 and colour[0] == "#"), None)


@lru_cache(maxsize=1024)
def _paint_value(name: str, text: str) -> str | None:
    """A paint with its colour as #rrggbb or #rrggbbaa; None where it cannot be read."""
    text = text.partition(" icc-color(")[0]  # Inkscape writes it after the colour for screens
    lower = text.lower()
    if light := _LIGHT.fullmatch(lower):
        return _paint_value(name, light[1].strip())
    if lower in _KEYWORDS:
        return lower.replace("currentcolor", "currentColor")  # as resvg writes it
    if lower in ("unset", "revert", "initial"):
        return _INITIAL.get(name, "#000000") if lower == "initial" or name == "stop-color" else "inherit"
    if lower.startswith("url("):
        server, _, fallback = text.partition(")")
        return f"{server}) {_paint_value(name, fallback.strip()) or ''}".rstrip()
    return hex_colour(text)
