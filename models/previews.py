"""Representations of objects in notebooks as a picture."""

from __future__ import annotations

from . import above


class Pictured:
    """An object that notebooks show as a picture."""

    def _repr_png_(self) -> bytes:
        """The picture, PNG."""
        picture: bytes = above.pictures().preview(self)
        return picture
