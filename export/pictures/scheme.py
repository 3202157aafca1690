"""What pictures for a browser share: the frame, labels, and colours in the reader's light or dark mode."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from html import escape


def style(
    colours: Mapping[str, tuple[str, str]], filled: Collection[str], shared: str = "", dark: str = ""
) -> str:
    """The style element of a picture: each class has a colour in light mode and one in dark mode.

    filled: classes that are filled; the others are lines. shared: rules of both modes; dark: more rules of
    dark mode.
    """

    def rules(mode: int) -> str:
        return "".join(
            f".{name}{{{'fill' if name in filled else 'stroke'}:{both[mode]}}}"
            for name, both in colours.items()
        )

    return f"<style>{shared}{rules(0)}@media (prefers-color-scheme:dark){{{rules(1)}{dark}}}</style>"


def opening(left: float, top: float, width: float, height: float) -> str:
    """The opening tag of a picture that shows this box, at its size."""
    box = " ".join(map(number, (left, top, width, height)))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}" '
        f'width="{number(width)}" height="{number(height)}">'
    )


def label(x: float, y: float, text: str, *, anchor: str = "start", turned: float = 0.0) -> str:
    """A text of the class `name` at a place, turned by degrees round it."""
    turn = f' transform="rotate({number(turned)} {number(x)} {number(y)})"' if turned else ""
    where = f'x="{number(x)}" y="{number(y)}"'
    return f'<text class="name" {where} text-anchor="{anchor}"{turn}>{escape(text)}</text>'


def number(value: float) -> str:
    """A coordinate to a tenth."""
    return f"{round(value, 1) + 0.0:.5g}"
