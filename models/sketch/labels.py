"""Labels of strokes, by which curvature lines are chosen where the colours of a drawing do not tell them.

Labels are `colour=`, `class=`, `id=` and `layer=` in SVG, also of groups, and `cluster=` in .scap.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from ..errors import InputError, shortened

LABEL_KINDS: Final = ("colour", "class", "id", "layer", "cluster")
_FEW: Final = 4  # labels of each kind that an error lists


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
            if len(listed) < _FEW and label not in listed:
                listed.append(label)
            if label in self.wanted:
                self.matched.add(label)
                wanted = True
        return wanted

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
