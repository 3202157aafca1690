"""Labels of strokes, by which curvature lines are chosen where the colours of a drawing do not tell them.

Labels are `colour=`, `class=`, `id=` and `layer=` in SVG, also of groups, and `cluster=` in .scap. They are
compared without regard to case. Names of layers and ids are compared as the program shows them: Illustrator
writes `_x26_` for `&` and `_` for a blank, so blanks and underscores are equal, and it numbers equal names.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

from ..errors import InputError, shortened
from .colour import hex_colour

LABEL_KINDS: Final = ("colour", "class", "id", "layer", "cluster")
_FEW: Final = 4  # labels of each kind that an error lists
_INKSCAPE: Final = "{http://www.inkscape.org/namespaces/inkscape}"
_LAYER_NAMES: Final = ("data-name", "{http://www.serif.com/}id")  # Illustrator's and Affinity's
_ESCAPE: Final = re.compile(r"_x([0-9a-f]{2,6})_")  # a character in an id of Illustrator
_NUMBERED: Final = re.compile(r" \d+ $")  # the second layer of a name is `Flow_1_` there


@dataclass(eq=False)
class LabelMatcher:
    """A matcher of labels while a drawing is read. seen: the labels of the drawing, by what is compared."""

    wanted: frozenset[str]
    seen: dict[str, str] = field(default_factory=dict)

    def matches(self, labels: Iterable[str]) -> bool:
        """Whether one of the labels is wanted; all of them are recorded."""
        by_key = {_key_of(label): label for label in labels}
        for key, label in by_key.items():
            self.seen.setdefault(key, label)
        return not self._keys.isdisjoint(by_key)

    @cached_property
    def _keys(self) -> set[str]:
        return set(map(_key_of, self.wanted))

    def check(self, *, any_stroke: bool) -> None:
        """Raise InputError if a wanted label is missing, or if no stroke has one."""
        if missing := sorted(label for label in self.wanted if _key_of(label) not in self.seen):
            there = [
                shortened(label, 40)
                for kind in LABEL_KINDS
                for label in [*filter(lambda one: one.startswith(f"{kind}="), self.seen.values())][:_FEW]
            ]
            listed = f"it has {', '.join(there)}" if there else "its strokes have no labels at all"
            raise InputError(f"has no stroke of {shortened(missing[0])}; {listed}")
        if not any_stroke:
            raise InputError(f"draws nothing of {shortened(', '.join(sorted(self.wanted)))}; choose others")


def label_of(selector: str) -> str:
    """The label that a selector such as "colour=red" denotes; colours as #rrggbb. Raises InputError."""
    kind, _, value = (part.strip() for part in selector.partition("="))
    kind = "colour" if kind == "color" else kind
    if kind not in LABEL_KINDS or not value:
        raise InputError(
            f"{shortened(selector)!r} chooses no strokes; "
            "write colour=red, class=flow, id=group2, layer=Flow or cluster=3"
        )
    if kind != "colour":
        return f"{kind}={value}"
    colour = hex_colour(value)
    if colour is None:
        raise InputError(f"{shortened(value)!r} is not a colour; write a name or #rrggbb")
    return f"colour={colour[:7]}"


def labels_of(tag: str, attributes: Mapping[str, str]) -> Iterator[str]:
    """Labels of the strokes in an SVG element: its id, its classes, and its name as a layer.

    attributes: by names as ElementTree writes them, `{namespace}name`. A layer is a group with the name that
    Inkscape, Illustrator or Affinity has given it, or only an id.
    """
    identifier = attributes.get("id", "")
    if identifier:
        yield f"id={identifier}"
    for name in attributes.get("class", "").split():
        yield f"class={name}"
    names = [attributes.get(key, "") for key in _LAYER_NAMES]
    if attributes.get(_INKSCAPE + "groupmode") == "layer":
        names.insert(0, attributes.get(_INKSCAPE + "label", ""))
    elif tag == "g":
        names.append(identifier)
    if name := next(filter(None, map(str.strip, names)), ""):
        yield f"layer={name}"


def _key_of(label: str) -> str:
    """The text by which labels are compared."""
    kind, _, value = label.casefold().partition("=")
    if kind in ("id", "layer"):
        value = _ESCAPE.sub(lambda escape: chr(min(int(escape[1], 16), sys.maxunicode)), value)
        value = _NUMBERED.sub("", re.sub(r"[\s_]", " ", value)).strip()
    return f"{kind}={value}"


def colour_label(rgb: tuple[float, float, float]) -> str:
    """The label of a colour given as red, green, blue in [0, 1]."""
    return "colour=#" + "".join(f"{round(255 * channel):02x}" for channel in rgb)
