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

LABEL_KINDS: Final = ("colour", "class", "id", "layer", "cluster")
_FEW: Final = 4  # labels of each kind that an error lists
_INKSCAPE: Final = "{http://www.inkscape.org/namespaces/inkscape}"
_LAYER_NAMES: Final = ("data-name", "{http://www.serif.com/}id")  # Illustrator's and Affinity's
_ESCAPE: Final = re.compile(r"_x([0-9a-f]{2,6})_")  # a character in an id of Illustrator
_NUMBERED: Final = re.compile(r" \d+ $")  # the second layer of a name is `Flow_1_` there


@dataclass(eq=False)
class LabelMatcher:
    """A matcher of labels while a drawing is read. seen: a few labels of each kind that the drawing has."""

    wanted: frozenset[str]
    matched: set[str] = field(default_factory=set)
    seen: dict[str, list[str]] = field(default_factory=lambda: {kind: [] for kind in LABEL_KINDS})

    def matches(self, labels: Iterable[str]) -> bool:
        """Whether one of the labels is wanted; all of them are recorded."""
        wanted = False
        for label in labels:
            listed = self.seen[label.partition("=")[0]]
            as_id = label.replace("layer=", "id=", 1)  # of a group that has only an id
            if len(listed) < _FEW and not {label, as_id} & {*listed, *self.seen["id"]}:
                listed.append(label)
            matched = self._wanted_by_key.get(_key_of(label), ())
            self.matched.update(matched)
            wanted = wanted or bool(matched)
        return wanted

    @cached_property
    def _wanted_by_key(self) -> dict[str, list[str]]:
        keys: dict[str, list[str]] = {}
        for label in self.wanted:
            keys.setdefault(_key_of(label), []).append(label)
        return keys

    def check(self, *, any_stroke: bool) -> None:
        """Raise InputError if a wanted label is missing, or if no stroke has one."""
        if missing := sorted(self.wanted - self.matched):
            there = [shortened(label, 40) for labels in self.seen.values() for label in labels]
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
    return _named_colour(value) if kind == "colour" else f"{kind}={value}"


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


def _named_colour(colour: str) -> str:
    """The label of a colour by its name or CSS notation. Raises InputError for other text."""
    from PIL import ImageColor

    try:
        red, green, blue = (min(channel, 255) / 255 for channel in ImageColor.getrgb(colour)[:3])
    except ValueError as error:
        raise InputError(f"{shortened(colour)!r} is not a colour; write a name or #rrggbb") from error
    return colour_label((red, green, blue))
