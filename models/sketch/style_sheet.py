"""Style sheets of SVG drawings: the properties that they give to an element.

tinycss2 parses, in time linear in the text. Only simple selectors of tag, id and classes count; the time of
others grows with the depth of a drawing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import Any, Final, NamedTuple

from ..errors import InputError
from ..input_limits import MAX_RULE_CHECKS, MAX_STYLE

PAINT: Final = ("stroke", "fill", "visibility", "color", "stroke-width", "stroke-opacity", "fill-opacity")
"""The properties that determine how a stroke appears; nested elements inherit them."""
KNOWN: Final = frozenset({*PAINT, "display", "opacity", "transform"})
"""The properties that determine which strokes there are."""


class _Selector(NamedTuple):
    tag: str
    id: str
    classes: frozenset[str]

    @property
    def rank(self) -> tuple[bool, int, bool]:
        return bool(self.id), len(self.classes), bool(self.tag)

    @property
    def key(self) -> str:
        """Key in the table of rules, which every matching element has."""
        if self.id:
            return f"#{self.id}"
        return f".{min(self.classes)}" if self.classes else self.tag


@dataclass(eq=False)
class StyleSheet:
    """The rules of a drawing: for each simple selector its properties, with the number of each."""

    rules: dict[str, dict[_Selector, dict[str, tuple[int, str]]]] = field(default_factory=dict)
    checks: int = 0
    _known: dict[tuple[str, str, str], Mapping[str, str]] = field(default_factory=dict)

    def properties(self, tag: str, identifier: str, classes: str) -> Mapping[str, str]:
        """The properties of an element: the most specific rule decides, and of equal ones the last."""
        asked = (tag, identifier if f"#{identifier}" in self.rules else "", classes)
        if asked not in self._known:
            self._known[asked] = self._found(*asked)
        return self._known[asked]

    def _found(self, tag: str, identifier: str, classes: str) -> dict[str, str]:
        names = frozenset(classes.split())
        found: dict[str, tuple[tuple[Any, ...], str]] = {}
        for key in ("", tag, f"#{identifier}", *(f".{name}" for name in sorted(names))):
            rules = self.rules.get(key, {})
            self.count(1 + len(rules))
            for selector, properties in rules.items():
                if selector.tag in ("", tag) and selector.classes <= names:
                    for name, (place, value) in properties.items():
                        candidate = ((selector.rank, place), value)
                        found[name] = max(found.get(name, candidate), candidate)
        return {name: value for name, (_, value) in found.items()}

    def count(self, more: int) -> None:
        """Add to the number of comparisons. Raises InputError beyond MAX_RULE_CHECKS."""
        self.checks += more
        if self.checks > MAX_RULE_CHECKS:
            raise InputError(
                f"its style sheets take more than {MAX_RULE_CHECKS} comparisons; export it without"
            )


def style_sheet(texts: Iterable[str]) -> StyleSheet:
    """The style sheet of all these texts, in order. Raises InputError beyond MAX_STYLE characters."""
    import tinycss2

    sheet, length = StyleSheet(), 0
    for text in texts:
        length += len(text)
        if length > MAX_STYLE:
            raise InputError(f"its style sheets have more than {MAX_STYLE} characters; export it without")
        try:
            rules = tinycss2.parse_stylesheet(text, skip_comments=True, skip_whitespace=True)
        except ValueError:  # a whole number of thousands of digits
            continue
        for rule in rules:
            if rule.type == "qualified-rule":
                properties = _declared(rule.content)
                for selector in _selectors(rule.prelude) if properties else ():
                    sheet.count(1)
                    held = sheet.rules.setdefault(selector.key, {}).setdefault(selector, {})
                    held.update((name, (sheet.checks, value)) for name, value in properties.items())
    return sheet


@lru_cache(maxsize=1024)
def style_properties(text: str) -> Mapping[str, str]:
    """The properties in a `style` attribute."""
    try:
        return _declared(text)
    except ValueError:  # a whole number of thousands of digits
        return {}


def _declared(content: Any) -> dict[str, str]:
    """The known properties in a text or in the tokens of a rule; the last one counts."""
    import tinycss2

    declarations = tinycss2.parse_blocks_contents(content, skip_comments=True, skip_whitespace=True)
    return {
        declaration.lower_name: _text(declaration.value)
        for declaration in declarations
        if declaration.type == "declaration" and declaration.lower_name in KNOWN
    }


def _text(tokens: list[Any]) -> str:
    import tinycss2

    try:
        return str(tinycss2.serialize(tokens)).strip()
    except RecursionError:
        return ""


def _selectors(prelude: list[Any]) -> Iterator[_Selector]:
    """The simple selectors of a rule."""
    tokens = [each for each in prelude if each.type != "comment"]
    ends = [place for place, each in enumerate(tokens) if each == ","]
    for start, end in pairwise([-1, *ends, len(tokens)]):
        selector = _selector(tokens[start + 1 : end])
        if selector is not None:
            yield selector


def _selector(part: list[Any]) -> _Selector | None:
    """The selector formed by tokens, None when it is not a simple one."""
    tag, ids, classes = "", set[str](), set[str]()
    blank = [each.type == "whitespace" for each in part]
    if all(blank):
        return None
    left = deque(part[blank.index(False) : len(part) - blank[::-1].index(False)])
    if left[0].type == "ident" or left[0] == "*":
        first = left.popleft()
        tag = first.value.replace("*", "")
    while left:
        each = left.popleft()
        if each.type == "hash":
            ids.add(each.value)
        elif each == "." and left and left[0].type == "ident":
            classes.add(left.popleft().value)
        else:
            return None
    return _Selector(tag, min(ids, default=""), frozenset(classes)) if len(ids) <= 1 else None
