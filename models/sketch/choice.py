"""Selection of curvature lines of a drawing by labels, beyond its colours.

Labels are `colour=`, `class=`, `id=` and `layer=` in SVG, also of groups, and `cluster=` in .scap.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final, Literal, get_args

from ..errors import InputError, printable, shortened

Kind = Literal["svg", "scap", "curves", "picture"]
Silhouette = Literal["none", "outer"]
_UNLABELLED: Final = {
    "curves": "is a .curves file, whose strokes have no labels",
    "picture": "is a picture, whose strokes have no labels: only red strokes are recognised",
}
KINDS: Final = ("colour", "class", "id", "layer", "cluster")
"""Kinds of labels by which strokes can be chosen."""
_FEW: Final = 4  # labels of each kind that an error lists
_SEEN_FROM: Final = ", seen from "


@dataclass(frozen=True)
class Choice:
    """The choice of curvature lines in a drawing, and the view, as for `read_sketch`. Checks its values."""

    silhouette: Silhouette = "none"
    curvature: tuple[str, ...] = ()
    view: str | None = None

    def __post_init__(self) -> None:
        if self.silhouette not in get_args(Silhouette):
            known = " or ".join(get_args(Silhouette))
            raise InputError(f"there is no silhouette {shortened(self.silhouette)!r}; choose {known}")
        object.__setattr__(self, "curvature", tuple(label_of(each) for each in self.curvature))

    @property
    def chooser(self) -> Chooser | None:
        """A new matcher for the chosen labels, None when the drawing's colours decide."""
        return Chooser(frozenset(self.curvature)) if self.curvature else None

    def source(self, file: str) -> str:
        """Source of an instance read from a file of that name: one line, with the view for `view_in`."""
        seen = "" if self.view is None else f"{_SEEN_FROM}{self.view}"
        return printable(f"{file}{seen}")

    def check(self, kind: Kind) -> None:
        """Raise InputError if strokes or a view are chosen in a sketch that has none."""
        if self.curvature and kind in _UNLABELLED:
            raise InputError(f"{_UNLABELLED[kind]}; leave the choice of {self.curvature[0]} out")
        if self.view is not None and kind != "curves":
            view = shortened(self.view)
            raise InputError(f"is flat: only a .curves file can be seen from {view}; leave the view out")


def view_in(source: str) -> str | None:
    """View that the source of an instance records, None without one."""
    return source.rpartition(_SEEN_FROM)[2] if _SEEN_FROM in source else None


AS_DRAWN: Final = Choice()  # selects everything drawn in red, or in the only colour


@dataclass(eq=False)
class Chooser:
    """A matcher of labels while a drawing is read. seen: a few labels of each kind that the drawing has."""

    wanted: frozenset[str]
    found: set[str] = field(default_factory=set)
    seen: dict[str, list[str]] = field(default_factory=lambda: {kind: [] for kind in KINDS})

    def takes(self, labels: Iterable[str]) -> bool:
        """Whether one of the labels is wanted; all of them are recorded."""
        taken = False
        for label in labels:
            some = self.seen[label.partition("=")[0]]
            if len(some) < _FEW and label not in some:
                some.append(label)
            if label in self.wanted:
                self.found.add(label)
                taken = True
        return taken

    def check(self, *, taken: bool) -> None:
        """Raise InputError if a wanted label is missing, or if no stroke was taken."""
        if missing := sorted(self.wanted - self.found):
            there = [shortened(label, 40) for some in self.seen.values() for label in some]
            listed = f"it has {', '.join(there)}" if there else "its strokes have no labels at all"
            raise InputError(f"has no stroke of {shortened(missing[0])}; {listed}")
        if not taken:
            raise InputError(f"draws nothing of {shortened(', '.join(sorted(self.wanted)))}; choose others")


def label_of(selector: str) -> str:
    """The label that a selector such as "colour=red" denotes; colours as #rrggbb. Raises InputError."""
    kind, _, value = (part.strip() for part in selector.partition("="))
    kind = "colour" if kind == "color" else kind
    if kind not in KINDS or not value:
        raise InputError(
            f"{shortened(selector)!r} chooses no strokes; "
            "write colour=red, class=flow, id=group2, layer=Flow or cluster=3"
        )
    return _of_colour(value) if kind == "colour" else f"{kind}={value}"


def colour_label(rgb: tuple[float, float, float]) -> str:
    """The label of a colour given as red, green, blue in [0, 1]."""
    return "colour=#" + "".join(f"{round(255 * channel):02x}" for channel in rgb)


def _of_colour(colour: str) -> str:
    """The label of a colour by its name or CSS notation. Raises InputError for other text."""
    from PIL import ImageColor

    try:
        red, green, blue = (min(channel, 255) / 255 for channel in ImageColor.getrgb(colour)[:3])
    except ValueError as error:
        raise InputError(f"{shortened(colour)!r} is not a colour; write a name or #rrggbb") from error
    return colour_label((red, green, blue))
